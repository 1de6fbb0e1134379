"""Ground truth of the mapping mission: true coverage, finished and abandoned surveys (``docs/model/mapping.md``)."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence

from missions.mapping.detections import FindsWatch
from missions.mapping.sensors import LIMIT_TOLERANCE, Cell, Seabed, SwathSettings
from missions.meeting.meeting import Meeting
from missions.meeting.truth import MeetingTruth
from remoras.activities import Objective
from remoras.mission import FleetView, Milestone, VehicleView
from remoras.organisation import Group
from remoras.recorder import TIME, Column, Recorder, Table
from remoras.sensor import NEVER_QUIET, QuietFrom
from remoras.truth import left

GOAL = Table("goal", (TIME, Column("goal_fraction", "float")))
"""Achieved share of the goal, at each change."""


class MappingTruth(MeetingTruth):
    """Referee of coverage, surveys and gathered groups; ``swaths_m`` by area and able vehicle."""

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
        self._no_news: dict[tuple[str, str], QuietFrom] = {}  # by vehicle and sonar
        self._all_covered: set[Cell] = set()
        self._n_uncovered = dict.fromkeys(swaths_m, 0)
        for area, _ in seabed.cells.values():
            self._n_uncovered[area] += 1
        self._patience_s = meeting.settings.patience_s
        names = [group.name for group in self._apart]
        self._meeting = {group: [other for other in names if group in self._meets_after[other]] for group in names}
        self._met_s: float | None = None
        self._now_s = 0.0
        self._done_fraction = self._goal_fraction = 0.0
        self._last_performed: dict[int, tuple[str, ...]] = {}
        self._exploring: dict[str, bool] = {}
        self._stopped: dict[str, Milestone] = {}
        self._finished: set[Objective] = set()

    # Coverage ------------------------------------------------------------------------------------

    @property
    def goal_fraction(self) -> float:
        """Achieved share of the goal, 0..1; without areas that of the rendezvous."""
        return self._goal_fraction if self._seabed.cells else super().goal_fraction

    @property
    def open_fraction(self) -> float:
        return 1.0 - self._done_fraction

    def reachable_fraction(self, fleet: FleetView) -> float:
        if not self._seabed.cells:
            return super().reachable_fraction(fleet)
        able = self._able(fleet)
        n_within: float = sum(n for area, n in self._n_uncovered.items() if able[area])
        if self._seabed.features:
            n_within += self._find_weight * self._finds.n_within_reach(able)
        n_done, n_open = self._done_and_open()
        return self._share_of_goal((n_done + n_within) / (n_done + n_open))

    def _able(self, fleet: FleetView) -> dict[str, bool]:
        mappers = {vehicle.name for vehicle, data in left(fleet) if data.sensor(SwathSettings) is not None}
        return {area: not mappers.isdisjoint(names) for area, names in self._swaths_m.items()}

    def out_of_reach(self, fleet: FleetView) -> Sequence[str]:
        able = self._able(fleet)
        areas = [area for area, n in self._n_uncovered.items() if n]
        return [area for area in areas if not able[area]] if any(able[area] for area in areas) else ()

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        self._now_s, self._fleet = now_s, fleet
        changed = False
        for vehicle in fleet.vehicles:
            if sensing := vehicle.sensing:
                changed |= self._look_under(vehicle, sensing, now_s)
        # The goal's share comes first, since the end of the mission depends on it.
        if changed:
            self._judge(now_s)
        is_complete = super().observe(fleet, now_s)
        if self._apart or self._is_awaited or self._is_open(fleet) or self._is_anybody_at_work(fleet):
            self._met_s = None
        elif self._met_s is None:
            self._met_s = now_s
        return is_complete

    def _is_open(self, fleet: FleetView) -> bool:
        """Return True while a leader waits, has reassigned work, or will resume work after a wait."""
        heads = ((v, group) for v in fleet.vehicles if v.is_alive for group in self._meeting if v.leads(group))
        for head, group in heads:
            # A leader without contact cannot learn whether other groups have gathered.
            awaited = [group, *(self._meeting[group] if head.communicates and head.is_in_contact else ())]
            if head.is_patient or not all(head.has_met(other) for other in awaited):
                return True
        return False

    def _is_anybody_at_work(self, fleet: FleetView) -> bool:
        return any(
            self._exploring.get(vehicle.name, False) or "Inspecting" in vehicle.performed
            for vehicle in fleet.vehicles
            if vehicle.is_alive or vehicle.will_return
        )

    def _look_under(self, vehicle: VehicleView, sensing: Sequence[str], now_s: float) -> bool:
        at_m, name, data, changed = vehicle.position_m, vehicle.name, vehicle.data, False
        sonars = [s for s in data.sensors if s.name in sensing and isinstance(s, SwathSettings)]
        for sonar in sonars:
            if self._no_news.get((name, sonar.name), NEVER_QUIET).holds(*at_m, now_s):
                continue
            reach_m, covered = sonar.swath_m / 2.0, self._covered[name]
            under = self._seabed.under(*at_m, reach_m)
            if covered.issuperset(under):
                next_m = self._seabed.nearest_m(*at_m, reach_m + self._seabed.cell_m, covered)
                self._no_news[name, sonar.name] = QuietFrom(next_m - reach_m, math.inf, *at_m)
                continue
            if vehicle.speed_mps <= data.speed_factor * sonar.speed_limit_mps * LIMIT_TOLERANCE:
                changed |= self._cover(name, under, now_s)
        if self._seabed.features and sonars and (n_new := self._finds.n_inspected_by(vehicle, now_s)):
            self.milestones += [Milestone(now_s, "inspected", name)] * n_new
            changed = True
        return changed

    def _cover(self, name: str, cells: Sequence[Cell], now_s: float) -> bool:
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

    def is_worked_off(self, group: Group) -> bool:
        """Return True unless remaining vehicles know an uninspected feature of the group's areas."""
        there = {vehicle.name for vehicle in self._fleet.vehicles if vehicle.is_alive or vehicle.will_return}
        return not (self._finds.has_open(there) and any(role.job in self._swaths_m for role in group.roles))

    def _share_of_goal(self, share: float) -> float:
        # Rounding must not keep a complete goal below 1.
        return min(1.0, share / self._goal + 1e-9)

    def _done_and_open(self) -> tuple[float, float]:
        n_done: float = len(self._all_covered)
        n_open: float = len(self._seabed.cells) - len(self._all_covered)
        if self._seabed.features:
            n_done += self._find_weight * self._finds.n_inspected
            n_open += self._find_weight * (len(self._seabed.features) - self._finds.n_inspected)
        return n_done, n_open

    def _judge(self, now_s: float) -> None:
        n_done, n_open = self._done_and_open()
        self._done_fraction = n_done / (n_done + n_open)
        fraction = self._share_of_goal(self._done_fraction)
        if fraction != self._goal_fraction:
            self._goal_fraction = fraction
            self._progress.append((now_s, fraction))

    # End of the mission --------------------------------------------------------------------------

    @property
    def is_over(self) -> bool:
        """True if, within the patience after an incomplete rendezvous, no vehicle works or returns."""
        return super().is_over or (self._met_s is not None and self._now_s - self._met_s > self._patience_s)

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Add abandoned surveys; return the reason of failure: missing vehicles, share of work done."""
        self.milestones += self._stopped.values()
        reason = super().close(fleet, now_s)
        if not self._seabed.cells or self.goal_fraction >= 1.0:
            return reason
        stopped = [f"{stone.vehicle} left its survey at {stone.time_s:.0f} s" for stone in self._stopped.values()]
        if not reason:
            reason = f"together after {now_s:.0f} s: {self.share}"
        elif self.share not in reason:
            reason += f"; {self.share}"
        return "; ".join([reason, *stopped])

    @property
    def share(self) -> str:
        """Share of the goal and of the work, as text."""
        if not self._seabed.cells:
            return super().share
        done = f"{100.0 * self._done_fraction:.0f} % of the work is done, {100.0 * self._goal:g} % is due"
        return f"{super().share} ({done})"

    def watch(self, fleet: FleetView, now_s: float) -> None:
        for number, vehicle in enumerate(fleet.vehicles):
            performed = vehicle.performed
            # A decision replaces the tuple, so comparing identities is enough.
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
