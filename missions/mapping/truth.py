"""Truth of the mapping and rendezvous mission: what was really covered, and who finished or gave up.

The truth keeps its own map, by geometry alone: a cell is covered once its centre was within half a swath of a vehicle
whose mapping sensor was on, worked, and was carried slowly enough. What sensors claim does not count.

A find is inspected once a vehicle whose sensor worked has really stayed near it, slowly, for as long as it takes. In
the goal it counts for as many cells as could be mapped in the mean time of a stay.

The goal is judged over all cells and all finds, whoever is left to map and inspect them, and whether or not a find was
ever found. What the vehicles left are able to map and inspect counts in the reachable fraction alone.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from missions.mapping.detections import FindsWatch
from missions.mapping.sensors import LIMIT_TOLERANCE, Cell, Seabed, SwathSettings
from missions.meeting.meeting import Meeting
from missions.meeting.truth import MeetingTruth
from remoras.activities import Objective
from remoras.mission import FleetView, Milestone, VehicleView
from remoras.organisation import Group
from remoras.recorder import TIME, Column, Recorder, Table
from remoras.truth import left

GOAL = Table("goal", (TIME, Column("goal_fraction", "float")))
"""Share of the goal that was reached on the ground, whenever it changed."""


class Swath(NamedTuple):
    """What a mapping sensor really sees: as far as ``reach_m`` on both sides, up to a speed."""

    reach_m: float
    speed_limit_mps: float


class MappingTruth(MeetingTruth):
    """Watches the run: what is covered, when consultation ends, who finishes or gives up, which group is together.

    Args:
        meeting: of the mission.
        seabed: cells of all areas.
        swaths_m: of the vehicles that are able to map each area, by name of area and vehicle.
        goal: share of the cells that must be covered for the mission to complete.
        recorder: takes the rows of what is covered.
        find_weight: cells that a find counts for.
    """

    work = "map"

    def __init__(
        self,
        meeting: Meeting,
        seabed: Seabed,
        swaths_m: Mapping[str, Mapping[str, float]],
        goal: float,
        recorder: Recorder,
        find_weight: float = 1.0,
    ) -> None:
        super().__init__(meeting)
        self._finds = FindsWatch(seabed)
        self._find_weight = find_weight
        self._seabed = seabed
        self._swaths_m = swaths_m
        self._goal = goal
        self._coverage, self._progress = recorder.rows("coverage"), recorder.rows(GOAL.name)
        self._covered: defaultdict[str, set[Cell]] = defaultdict(set)  # by vehicle
        self._swaths: dict[tuple[str, Sequence[str]], list[Swath]] = {}  # by vehicle, and which of its sensors are on
        self._all_covered: set[Cell] = set()
        self._n_uncovered = dict.fromkeys(swaths_m, 0)
        for area, _ in seabed.cells.values():
            self._n_uncovered[area] += 1
        self._beside_m = seabed.box_m
        self._patience_s = meeting.patience_s
        names = [group.name for group in self._apart]
        self._meeting = {group: [other for other in names if group in self._meets_after[other]] for group in names}
        self._met_s: float | None = None
        self._now_s = 0.0
        self._done_fraction = self._goal_fraction = 0.0
        self._last_performed: dict[int, tuple[str, ...]] = {}
        self._exploring: dict[str, bool] = {}
        self._stopped: dict[str, Milestone] = {}
        self._finished: set[Objective] = set()

    # What is covered -----------------------------------------------------------------------------

    @property
    def goal_fraction(self) -> float:
        """Share of the goal that is reached on the ground, 0..1; without areas that of the meeting."""
        return self._goal_fraction if self._seabed.cells else super().goal_fraction

    @property
    def open_fraction(self) -> float:
        """Share of the work that is not done."""
        return 1.0 - self._done_fraction

    def reachable_fraction(self, fleet: FleetView) -> float:
        """With all cells of the areas that somebody left is able to map, and all finds that may be inspected."""
        if not self._seabed.cells:
            return super().reachable_fraction(fleet)
        able = self._able(fleet)
        n_within: float = sum(n for area, n in self._n_uncovered.items() if able[area])
        if self._seabed.features:
            n_within += self._find_weight * self._finds.n_within_reach(able)
        n_done, n_open = self._done_and_open()
        return self._share_of_goal((n_done + n_within) / (n_done + n_open))

    def _able(self, fleet: FleetView) -> dict[str, bool]:
        """By area, whether somebody left is able to map it: by its role, its working sensor and its depth."""
        mappers = {vehicle.name for vehicle, data in left(fleet) if data.sensor(SwathSettings) is not None}
        return {area: not mappers.isdisjoint(names) for area, names in self._swaths_m.items()}

    def out_of_reach(self, fleet: FleetView) -> Sequence[str]:
        """Areas with cells left that nobody left is able to map; none by name if these are all of them."""
        able = self._able(fleet)
        areas = [area for area, n in self._n_uncovered.items() if n]
        return [area for area in areas if not able[area]] if any(able[area] for area in areas) else ()

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Keep the map, and note what has happened; True once the goal is reached and the last group is together."""
        self._now_s, self._fleet = now_s, fleet
        changed = False
        for vehicle in fleet.vehicles:
            if sensing := vehicle.sensing:
                changed |= self._look_under(vehicle, sensing, now_s)
        if changed:
            self._judge(now_s)
        is_complete = super().observe(fleet, now_s)
        if self._apart or self._is_awaited or self._is_open(fleet) or self._is_anybody_at_work(fleet):
            self._met_s = None
        elif self._met_s is None:
            self._met_s = now_s
        return is_complete

    @property
    def _there(self) -> set[str]:
        """Names of the vehicles that are alive or will be back."""
        return {vehicle.name for vehicle in self._fleet.vehicles if vehicle.is_alive or vehicle.will_return}

    def _is_open(self, fleet: FleetView) -> bool:
        """True while a head does not take its group for gathered: it waits for somebody, or has given work anew.

        Or it is patient, and goes on with what is left when it is so no longer.

        Or it has not heard yet that the groups which meet after its own have: then it finds out what is left.
        """
        heads = ((v, group) for v in fleet.vehicles if v.is_alive for group in self._meeting if v.leads(group))
        for head, group in heads:
            awaited = [group, *(self._meeting[group] if head.communicates and head.is_in_contact else ())]
            if head.is_patient or not all(head.has_met(of) for of in awaited):
                return True
        return False

    def _is_anybody_at_work(self, fleet: FleetView) -> bool:
        there = self._there
        return any(
            self._exploring.get(vehicle.name, False) or "Inspecting" in vehicle.performed
            for vehicle in fleet.vehicles
            if vehicle.name in there
        )

    def _swaths_of(self, vehicle: VehicleView, sensing: Sequence[str]) -> list[Swath]:
        """What those of the mapping sensors of a vehicle see that are on."""
        data = vehicle.data
        swaths = self._swaths[vehicle.name, sensing] = [
            Swath(sensor.swath_m / 2.0, data.speed_factor * sensor.speed_limit_mps * LIMIT_TOLERANCE)
            for sensor in data.sensors
            if isinstance(sensor, SwathSettings) and sensor.name in sensing
        ]
        return swaths

    def _look_under(self, vehicle: VehicleView, sensing: Sequence[str], now_s: float) -> bool:
        """Note what the sensors of a vehicle that are on pass; True if the fleet has got on by it."""
        x_m, y_m = vehicle.position_m
        x_min, y_min, x_max, y_max = self._beside_m
        if not (x_min <= x_m <= x_max and y_min <= y_m <= y_max):  # no swath reaches an area from there
            return False
        name, changed = vehicle.name, False
        swaths, covered = self._swaths.get((name, sensing)), self._covered[name]
        for swath in self._swaths_of(vehicle, sensing) if swaths is None else swaths:
            under = self._seabed.under(x_m, y_m, swath.reach_m)
            if not covered.issuperset(under) and vehicle.speed_mps <= swath.speed_limit_mps:  # mostly nothing is new
                changed |= self._cover(name, under, now_s)
        if self._seabed.features and self._swaths[name, sensing]:
            changed |= self._inspect(vehicle, now_s)
        return changed

    def _cover(self, name: str, cells: Sequence[Cell], now_s: float) -> bool:
        """Note those of the cells that a vehicle covers for the first time; True if nobody had covered one of them."""
        covered, changed = self._covered[name], False
        for cell in cells:
            if cell in covered:
                continue
            covered.add(cell)
            self._coverage.append((now_s, name, *cell))
            if self._finds.is_new(cell, name):
                self.milestones.append(Milestone(now_s, "found", name))
            if cell not in self._all_covered:
                self._all_covered.add(cell)
                self._n_uncovered[self._seabed.cells[cell][0]] -= 1
                changed = True
        return changed

    def _inspect(self, vehicle: VehicleView, now_s: float) -> bool:
        """Note what a vehicle has inspected; True if nobody had before."""
        n_new = self._finds.n_inspected_by(vehicle, now_s)
        if n_new:
            self.milestones += [Milestone(now_s, "inspected", vehicle.name)] * n_new
        return n_new > 0

    def is_worked_off(self, group: Group) -> bool:
        """True unless somebody who is left has found something in the group's areas that waits to be inspected."""
        return not (self._finds.has_open(self._there) and any(role.job in self._swaths_m for role in group.roles))

    def _share_of_goal(self, share: float) -> float:
        return min(1.0, share / self._goal + 1e-9)

    def _done_and_open(self) -> tuple[float, float]:
        """How many cells are covered and how many are not, with what finds count for."""
        n_done: float = len(self._all_covered)
        n_open: float = len(self._seabed.cells) - len(self._all_covered)
        if self._seabed.features:
            n_done += self._find_weight * self._finds.n_inspected
            n_open += self._find_weight * (len(self._seabed.features) - self._finds.n_inspected)
        return n_done, n_open

    def _judge(self, now_s: float) -> None:
        """Work out the share of the goal that is reached."""
        n_done, n_open = self._done_and_open()
        self._done_fraction = n_done / (n_done + n_open)
        fraction = self._share_of_goal(self._done_fraction)
        if fraction != self._goal_fraction:
            self._goal_fraction = fraction
            self._progress.append((now_s, fraction))

    # How it ends ---------------------------------------------------------------------------------

    @property
    def is_over(self) -> bool:
        """True once the groups have met without the goal, and for the patience nobody goes on or will be back."""
        return super().is_over or (self._met_s is not None and self._now_s - self._met_s > self._patience_s)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Add who gave up; say who is missing where, and how much of the work is done if it is not enough."""
        self.milestones += self._stopped.values()
        self.milestones.sort(key=lambda milestone: milestone.time_s)
        reason = super().close(fleet, now_s)
        if not self._seabed.cells or self.goal_fraction >= 1.0 or (self._apart and not self._consulted):
            return reason
        done = f"{100.0 * self._done_fraction:.0f} % of the work done of {100.0 * self._goal:g} %"
        stopped = [f"{stone.vehicle} left its survey at {stone.time_s:.0f} s" for stone in self._stopped.values()]
        share = "; ".join([f"{100.0 * self.goal_fraction:.0f} % of the goal, {done}", *stopped])
        return f"{reason}; {share}" if reason else f"together after {now_s:.0f} s: {share}"

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Note who finishes an area, and who turns away from one."""
        for number, vehicle in enumerate(fleet.vehicles):
            performed = vehicle.performed
            if performed is self._last_performed.get(number) or not vehicle.is_alive:
                continue
            self._last_performed[number] = performed
            exploring = "ZigzagExploring" in performed
            if exploring:
                self._stopped.pop(vehicle.name, None)
            elif self._exploring.get(vehicle.name):
                self._stopped[vehicle.name] = Milestone(now_s, "mapping_stopped", vehicle.name)
            self._exploring[vehicle.name] = exploring
            for objective in vehicle.finished:
                if objective.name == "Exploring" and objective not in self._finished:
                    self._finished.add(objective)
                    self._stopped.pop(vehicle.name, None)
                    self.milestones.append(Milestone(now_s, "mapping_done", vehicle.name))
