"""Truth, metrics and figures of this mission: what was really surveyed and lifted, and how long objects waited."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from exchange.arithmetic import distance
from missions.figure import Declared, Figure, Mark, RunResults, Style
from missions.meeting.meeting import Meeting
from missions.meeting.staying import THERE_M
from missions.meeting.truth import (
    ATTRIBUTE,
    JOBS,
    SUBJECT,
    WAITS,
    JobTruth,
    draw_steps,
    event_s,
    first_s,
    mean_wait_s,
    mean_with_sites_s,
)
from missions.metric import Better, MeasuredRun, Metric
from missions.recovery.lifting import LYING_AT, Lift, SeaField
from remoras.mission import FleetView
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIFTS = Table("lifts", (TIME, VEHICLE, Column("lift", "str"), Column("event", "str")))
"""When a vehicle had come to an end of an object that nobody was at (``waits``), and when it was really ``lifted``."""
LIFTED = "lifted"


class RecoveryTruth(JobTruth):
    """Notes what was lifted, whatever vehicles believe: all ends were taken for as long as a lift takes.

    Args:
        meeting: of the mission; objective: of roles with a job; recorder: takes the rows.
        lifts: by name; world: where they lie.
    """

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, lifts: Mapping[str, Lift], world: SeaField
    ) -> None:
        super().__init__(meeting, objective, recorder)
        self._lift_rows = recorder.rows(LIFTS.name)
        self._lifts = lifts
        self._open = {name: lifts[name].ends_m(middle_m) for name, middle_m in world.lying_m}
        self._since_s: dict[str, float] = {}
        self._waited: set[str] = set()

    @property
    def jobs_done(self) -> Collection[str]:
        """Sites that were surveyed and objects that were really lifted."""
        return self._done - self._open.keys()

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Note what was done since the last look."""
        super().watch(fleet, now_s)
        for name, ends_m in list(self._open.items()):
            there = [
                vehicle.name
                for end_m in ends_m
                for vehicle in fleet.vehicles
                if vehicle.is_alive and distance(vehicle.position_m, end_m) <= THERE_M
            ]
            if there and name not in self._waited:
                self._waited.add(name)
                self._lift_rows.append((now_s, there[0], name, WAITS))
            if len(set(there)) < len(ends_m):
                self._since_s.pop(name, None)
            elif now_s - self._since_s.setdefault(name, now_s) >= self._lifts[name].lift_s:
                del self._open[name]
                self._lift_rows.append((now_s, there[0], name, LIFTED))
                self.note(there[0], name, now_s)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Say who is missing where, what was not done, and which objects nobody has found."""
        found = {row[SUBJECT] for row in self._items[0:] if row[ATTRIBUTE] == LYING_AT}
        hidden = ", ".join(name for name in self._open if name not in found)
        reason = super().close(fleet, now_s)
        return "; ".join(text for text in (reason, f"nobody knows where they lie: {hidden}" if hidden else "") if text)


def mean_done_s(run: MeasuredRun) -> float:
    """Mean time by which a site was surveyed or an object lifted; what was not counts with the mission's duration."""
    scenario: Any = run.scenario
    return mean_with_sites_s(run, event_s(run, LIFTS.name, LIFTED).values(), int(scenario.lifts.number))


def mean_lift_wait_s(run: MeasuredRun) -> float | None:
    """Mean time from when the first vehicle was at an object to when it was lifted; None if no vehicle came to any."""
    return mean_wait_s(run, LIFTS.name, LIFTED)


METRICS = (
    Metric("mean_done_s", "s", Better.LOWER, "mean time until work is done", mean_done_s, headline=True),
    Metric("mean_wait_s", "s", Better.LOWER, "mean wait at an object", mean_lift_wait_s, headline=True),
)
"""Metrics of the mission, in the order of the summary."""


def draw_done(axes: Axes, results: RunResults, style: Style) -> str:
    """Sites surveyed and objects lifted over time."""
    lifted = {row["lift"]: row["time_s"] for row in results.table(LIFTS.name).to_pylist() if row["event"] == LIFTED}
    sites = [time_s for job, time_s in first_s(results).items() if not job.startswith("lift ")]
    draw_steps(axes, results, style, {"sites surveyed": sites, "objects lifted": lifted.values()}, "done")
    return "An object counts once all of its ends were taken for as long as a lift takes."


FIGURES: tuple[Declared, ...] = (
    Figure(
        "recovered", "Sites surveyed and objects lifted over mission time", draw_done, needs=(JOBS.name, LIFTS.name)
    ),
    Mark("job_done", "job done"),
)
"""Figures of the mission."""
