"""Truth, metrics and figures of this mission: what was really surveyed and bored, and where all energy went."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from missions.figure import Declared, Figure, Mark, RunResults, Style
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JOBS, JobTruth, draw_steps, first_s, mean_with_sites_s
from missions.metric import Better, MeasuredRun, Metric
from missions.resupply.boring import Boring
from missions.resupply.energy import (
    BORED,
    BROUGHT,
    CAME,
    HALTED,
    LEAST_SHARE,
    ChargerSettings,
    Energies,
)
from remoras.mission import FleetView, VehicleView
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table
from remoras.work import Job

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ENERGY = Table(
    "energy", (TIME, VEHICLE, Column("boring", "str"), Column("event", "str"), Column("energy_j", "float", "J"))
)
"""What befell a hole: its drill had no energy (``halted``), another one ``came`` and passed some on, had ``brought``
so much when it left, and the hole was really ``bored``."""


class ResupplyTruth(JobTruth):
    """Notes what really befell holes, whatever vehicles believe, and which were bored.

    Args:
        meeting: of the mission; objective: of roles with a job; recorder: takes the rows.
        borings: by name; energies: of the run.
    """

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, borings: Mapping[str, Boring], energies: Energies
    ) -> None:
        super().__init__(meeting, objective, recorder)
        self._energy_rows = recorder.rows(ENERGY.name)
        self._borings, self._energies = borings, energies
        self._open = set(borings)
        self._starved: set[str] = set()
        self._halted_s: dict[str, float] = {}  # since when, where nobody has come
        self._is_left = False
        self._n_noted = 0

    @property
    def jobs_done(self) -> Collection[str]:
        """Sites that were surveyed and holes that were really bored."""
        return self._done - self._open

    @property
    def jobs_as_they_are(self) -> Mapping[str, Job]:
        """Holes for which no energy is left are beyond everybody."""
        return {**self._jobs, **{name: replace(self._borings[name], is_starved=True) for name in self._starved}}

    def reachable_fraction(self, fleet: FleetView) -> float:
        """Share of the goal that somebody left is able to reach with the energy that is left."""
        self._starved = set() if self._is_energy_left(fleet) else {
            name for name in self._open if not self._is_drill_charged(fleet, self._borings[name])
        }  # fmt: skip
        return super().reachable_fraction(fleet)

    def _is_energy_left(self, fleet: FleetView) -> bool:
        """True if somebody is left with something in a store."""
        for vehicle in fleet.vehicles:
            data = vehicle.able_data
            charger = None if data is None else data.sensor(ChargerSettings)
            if charger is not None and charger.of(vehicle.name, self._energies).left_j > 0.0:
                return True
        return False

    def _is_drill_charged(self, fleet: FleetView, boring: Boring) -> bool:
        """True if somebody is left whose drill for that hole goes on boring with what it has."""
        for vehicle in fleet.vehicles:
            data = vehicle.able_data
            drill = None if data is None else boring.drill_of(data)
            if drill is not None and drill.of(vehicle.name, self._energies).left_j >= LEAST_SHARE * drill.battery_j:
                return True
        return False

    @property
    def is_given_up(self) -> bool:
        """True if vehicles say so, or have left each job that is open, of which nobody tells others."""
        return super().is_given_up or self._is_left

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Note what has happened since the last look."""
        super().watch(fleet, now_s)
        self._note_events()
        self._is_left = bool(self._halted_s) and not any(
            vehicle.communicates or self._holds_any(vehicle) for vehicle in fleet.vehicles
        )

    def _holds_any(self, vehicle: VehicleView) -> bool:
        """True if a vehicle, as it sees itself, has a job that is open."""
        if not vehicle.is_alive:
            return False
        plays, done = vehicle.organisation.plays, self.jobs_done
        roles = [(group.name, role) for group in self._groups for role in group.roles if role.job is not None]
        return any(role.job not in done and plays(vehicle.name, group, role.name) for group, role in roles)

    def _note_events(self) -> None:
        events = self._energies.events
        for event in events[self._n_noted :] if len(events) > self._n_noted else ():
            self._energy_rows.append(event)
            if event[3] == BORED:
                self._open.discard(event[2])
            if event[3] == HALTED:
                self._halted_s[event[2]] = event[0]
            elif event[3] in (CAME, BORED):
                self._halted_s.pop(event[2], None)
        self._n_noted = len(events)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Say who is missing where, what was not done, and where no energy came to."""
        for key in list(self._energies.passing):
            self._energies.note_left(key, now_s)
        self._note_events()
        reason = super().close(fleet, now_s)
        halted = ", ".join(f"{hole} since {at_s:.0f} s" for hole, at_s in self._halted_s.items() if hole in self._open)
        return "; ".join(text for text in (reason, f"without energy: {halted}" if halted else "") if text)


# What the results say ----------------------------------------------------------------------------


def _rows(run: MeasuredRun, event: str) -> list[tuple[Any, ...]]:
    return [row for row in run.recorder.rows(ENERGY.name) if row[3] == event]


def mean_energy_wait_s(run: MeasuredRun) -> float | None:
    """Mean time from when a drill had no energy to when another one came with some; to the end where nobody came.

    None if no drill ever had none.
    """
    came = _rows(run, CAME)
    waits_s = []
    for at_s, _, boring, *_ in _rows(run, HALTED):
        after_s = [row[0] for row in came if row[2] == boring and row[0] > at_s]
        waits_s.append(min(after_s, default=run.end_s) - at_s)
    return math.fsum(waits_s) / len(waits_s) if waits_s else None


def brought_j(run: MeasuredRun) -> float:
    """Energy that has come into the batteries of drills."""
    return math.fsum(row[4] for row in _rows(run, BROUGHT))


def mean_sampled_s(run: MeasuredRun) -> float:
    """Mean time by which a site was surveyed or a hole bored; what was not counts with the mission's duration."""
    scenario: Any = run.scenario
    return mean_with_sites_s(run, [row[0] for row in _rows(run, BORED)], len(scenario.boring))


METRICS = (
    Metric("mean_done_s", "s", Better.LOWER, "mean time until work is done", mean_sampled_s, headline=True),
    Metric("mean_wait_s", "s", Better.LOWER, "mean wait for energy", mean_energy_wait_s, headline=True),
    Metric("brought_j", "J", Better.LOWER, "energy brought", brought_j),
)
"""Metrics of the mission, in the order of the summary."""


def draw_sampled(axes: Axes, results: RunResults, style: Style) -> str:
    """Sites surveyed and holes bored over time."""
    bored = {row["boring"]: row["time_s"] for row in results.table(ENERGY.name).to_pylist() if row["event"] == BORED}
    sites = [time_s for job, time_s in first_s(results).items() if job not in bored]
    draw_steps(axes, results, style, {"sites surveyed": sites, "holes bored": bored.values()}, "done")
    return "A hole counts once its drill has really worked on it for as long as it takes."


FIGURES: tuple[Declared, ...] = (
    Figure("sampled", "Sites surveyed and holes bored over mission time", draw_sampled, needs=(JOBS.name, ENERGY.name)),
    Mark("job_done", "job done"),
)
"""Figures of the mission."""
