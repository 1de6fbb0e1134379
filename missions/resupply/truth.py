"""Truth, metrics and figures of this mission: what was really surveyed and bored, and where all energy went."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from exchange.arithmetic import distance
from missions.figure import Declared, Figure, Mark, RunResults, Style
from missions.meeting.meeting import Meeting
from missions.meeting.progress import done_s, draw_steps, first_s, mean_of_all_s
from missions.meeting.staying import THERE_M
from missions.meeting.truth import JOBS, JobTruth
from missions.metric import Better, MeasuredRun, Metric
from missions.resupply.boring import Boring
from missions.resupply.energy import LEAST_SHARE, ChargerSettings, DrillSettings, Transfer
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
HALTED, CAME, BROUGHT, BORED = "halted", "came", "brought", "bored"
GAP_S = 20.0
"""Who passes energy on again within this time has not left meanwhile."""
BORED_SHARE = 0.98
"""A hole is bored once the drill has really worked on it for this share of the time that it takes: a vehicle counts by
decisions, and by where it takes itself to be."""


class ResupplyTruth(JobTruth):
    """Keeps account of all energy, whatever vehicles believe, and notes which holes were bored with it.

    Args:
        meeting: of the mission; objective: of roles with a job; recorder: takes the rows.
        borings: by name; transfer: how energy passes over.
    """

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, borings: Mapping[str, Boring], transfer: Transfer
    ) -> None:
        super().__init__(meeting, objective, recorder)
        self._energy = recorder.rows(ENERGY.name)
        self._borings, self._transfer = borings, transfer
        self._open = set(borings)
        self._worked_s = dict.fromkeys(borings, 0.0)
        self.battery_j: dict[str, float] = {}
        self.store_j: dict[str, float] = {}
        self._passing: dict[
            tuple[str, str], tuple[float, float]
        ] = {}  # by who brings and hole: energy so far, when last
        self._halted: set[str] = set()
        self._is_starved = False
        self._last_s = 0.0

    @property
    def jobs_done(self) -> Collection[str]:
        """Sites that were surveyed and holes that were really bored."""
        return self._done - self._open

    @property
    def goal_fraction(self) -> float:
        """Share of all sites and holes."""
        return len(self.jobs_done) / len(self._jobs) if self._jobs else 1.0

    @property
    def jobs_as_they_are(self) -> Mapping[str, Job]:
        """Holes for which no energy is left are beyond everybody."""
        if not self._is_starved:
            return self._jobs
        return {**self._jobs, **{name: replace(self._borings[name], is_starved=True) for name in self._open}}

    def reachable_fraction(self, fleet: FleetView) -> float:
        """Share of the goal that somebody left is able to reach with the energy that is left."""
        stores = any(self.store_j.get(vehicle.name, 1.0) > 0.0 for vehicle in fleet.vehicles if self._charger(vehicle))
        self._is_starved = not stores and all(
            self.battery_j.get(vehicle.name, math.inf) < LEAST_SHARE * drill.battery_j
            for vehicle in fleet.vehicles
            for drill in self._drills(vehicle)
        )
        return super().reachable_fraction(fleet)

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Pass energy on and let drills work for the time since the last look, and note what was done."""
        super().watch(fleet, now_s)
        dt_s, self._last_s = now_s - self._last_s, now_s
        if dt_s <= 0.0:
            return
        for vehicle in fleet.vehicles:
            for boring in self._borings.values():
                drill = boring.drill_of(vehicle.data)
                if drill is not None and drill.name in vehicle.sensing and _is_there(vehicle, boring.place_m):
                    self._come_in(fleet, vehicle, boring, drill, dt_s, now_s)
                    self._bore(vehicle, boring, drill, dt_s, now_s)
        for key, (_, last_s) in list(self._passing.items()):
            if now_s - last_s > GAP_S:
                self._note_brought(key)

    def _note_brought(self, key: tuple[str, str]) -> None:
        energy_j, last_s = self._passing.pop(key)
        self._energy.append((last_s, *key, BROUGHT, energy_j))

    def _bore(self, vehicle: VehicleView, boring: Boring, drill: DrillSettings, dt_s: float, now_s: float) -> None:
        left_j = self.battery_j.setdefault(vehicle.name, drill.battery_j)
        most_j = min(drill.power_w * dt_s, left_j, drill.power_w * (boring.stay_s - self._worked_s[boring.name]))
        used_j = 0.0 if boring.name in self._halted else max(0.0, most_j)
        self.battery_j[vehicle.name] = left_j - used_j
        self._worked_s[boring.name] += used_j / drill.power_w
        if boring.name in self._open and self._worked_s[boring.name] >= BORED_SHARE * boring.stay_s:
            self._open.remove(boring.name)
            self._energy.append((now_s, vehicle.name, boring.name, BORED, 0.0))
        elif self.battery_j[vehicle.name] <= 0.0 and boring.name not in self._halted:
            self._halted.add(boring.name)
            self._energy.append((now_s, vehicle.name, boring.name, HALTED, 0.0))

    def _come_in(
        self, fleet: FleetView, vehicle: VehicleView, boring: Boring, drill: DrillSettings, dt_s: float, now_s: float
    ) -> None:
        """Energy from whoever lies at the berth with its charger on."""
        berth_m, comes = self._transfer.berth(boring.place_m), False
        for other in fleet.vehicles:
            charger = self._charger(other)
            if charger is None or charger.name not in other.sensing or not _is_there(other, berth_m):
                continue
            store_j = self.store_j.setdefault(other.name, charger.store_j)
            lacks_j = drill.battery_j - self.battery_j.setdefault(vehicle.name, drill.battery_j)
            passes_j = self._transfer.passes_j(dt_s, store_j, lacks_j)
            if passes_j > 0.0:
                self.store_j[other.name] = store_j - passes_j / self._transfer.efficiency
                self.battery_j[vehicle.name] += passes_j
                key, comes = (other.name, boring.name), True
                if key not in self._passing:
                    self._energy.append((now_s, *key, CAME, 0.0))
                self._passing[key] = self._passing.get(key, (0.0, now_s))[0] + passes_j, now_s
        if not comes and self.battery_j.get(vehicle.name, math.inf) >= LEAST_SHARE * drill.battery_j:
            self._halted.discard(boring.name)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Say who is missing where, and what was not done; whoever passes energy on has brought so much."""
        for key in list(self._passing):
            self._note_brought(key)
        return super().close(fleet, now_s)

    @staticmethod
    def _charger(vehicle: VehicleView) -> ChargerSettings | None:
        data = vehicle.able_data
        return None if data is None else data.sensor(ChargerSettings)

    @staticmethod
    def _drills(vehicle: VehicleView) -> list[DrillSettings]:
        data = vehicle.able_data
        return [] if data is None else [one for one in data.sensors if isinstance(one, DrillSettings)]


def _is_there(vehicle: VehicleView, place_m: tuple[float, float]) -> bool:
    return vehicle.is_alive and distance(vehicle.position_m, place_m) <= THERE_M


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
    surveyed_s, sites = done_s(run), [site.name for site in scenario.site]
    times_s = [surveyed_s[name] for name in sites if name in surveyed_s] + [row[0] for row in _rows(run, BORED)]
    return mean_of_all_s(times_s, len(sites) + len(scenario.boring), run)


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
