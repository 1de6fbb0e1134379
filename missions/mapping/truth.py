"""Truth of the mapping and rendezvous mission: watches a run from outside and notes its milestones.

A group that was given its mission from the start supervises the others: it counts as gathered only when they have.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from missions.mapping.survey import Point
from remoras.activities import Objective
from remoras.mission import Milestone
from remoras.organisation import Group


class MappingTruth:
    """Watches the run: when consultation ends, who finishes or gives up, which group is together."""

    def __init__(self, groups: Iterable[Group], rally_points_m: Mapping[str, Point], radius_m: float) -> None:
        self.milestones: list[Milestone] = []
        self._rally_points_m = rally_points_m
        self._radius_m = radius_m
        self._consulted = False
        self._last_decision: dict[str, Any] = {}
        self._exploring: dict[str, bool] = {}
        self._stopped: dict[str, Milestone] = {}
        self._finished: set[Objective] = set()
        together_first = sorted(groups, key=lambda group: group.mission is not None)
        self._apart = [group for group in together_first if group.rally_point is not None]

    def observe(self, fleet: Any, now_s: float) -> bool:
        if not self._consulted:
            if not self._is_consulted(fleet):
                return False
            self._consulted = True
            self.milestones.append(Milestone(now_s, "consultation_done"))
        self._watch_mapping(fleet, now_s)
        for group in list(self._apart):
            waits_for_others = group.mission is not None and self._apart[0].mission is None
            if not waits_for_others and self._is_together(fleet, group):
                self._apart.remove(group)
                self.milestones.append(Milestone(now_s, "gathered", group=group.name))
        if self._apart:
            return False
        self.milestones.append(Milestone(now_s, "mission_complete"))
        return True

    def close(self, fleet: Any, now_s: float) -> str:
        self.milestones += self._stopped.values()
        self.milestones.sort(key=lambda milestone: milestone.time_s)
        if not self._consulted:
            return f"consultation had not ended after {now_s:.0f} s"
        if self._apart:
            names = ", ".join(
                f"{group.name} (without {' and '.join(lacking)})"
                if (lacking := self._lacking(fleet, group))
                else group.name
                for group in self._apart
            )
            exhausted = [v.name for v in fleet.vehicles if not v.is_alive]
            why = f"; battery exhausted: {', '.join(exhausted)}" if exhausted else ""
            return f"not together after {now_s:.0f} s: {names}{why}"
        return ""

    @staticmethod
    def _is_consulted(fleet: Any) -> bool:
        """Has every mission been planned, and does everything assigned count where it was meant to?"""
        by_name = {vehicle.name: vehicle for vehicle in fleet.vehicles}
        for vehicle in fleet.vehicles:
            social = vehicle.social
            for group in social.organisation.groups:
                if social.leads(group) and group not in social.planned:
                    return False
            for a in social.issued:
                if not by_name[a.vehicle].social.organisation.plays(a.vehicle, a.group, a.role):
                    return False
            for objective in social.issued_objectives:
                for holder in social.organisation.members(objective.group, objective.role):
                    if objective not in by_name[holder].social.objectives_of(holder):
                        return False
        return True

    def _watch_mapping(self, fleet: Any, now_s: float) -> None:
        for vehicle in fleet.vehicles:
            decision = vehicle.executive.decision
            if decision is self._last_decision.get(vehicle.name):
                continue
            self._last_decision[vehicle.name] = decision
            exploring = any(vehicle.executive.sets[index].name == "ZigzagExploring" for index in decision.chosen)
            if exploring:
                self._stopped.pop(vehicle.name, None)
            elif self._exploring.get(vehicle.name):
                self._stopped[vehicle.name] = Milestone(now_s, "mapping_stopped", vehicle.name)
            self._exploring[vehicle.name] = exploring
            for objective in vehicle.social.finished:
                if objective.name == "Exploring" and objective not in self._finished:
                    self._finished.add(objective)
                    self._stopped.pop(vehicle.name, None)
                    self.milestones.append(Milestone(now_s, "mapping_done", vehicle.name))

    def _is_together(self, fleet: Any, group: Group) -> bool:
        """Are all members at the rally point, with nothing to be given out, and all founding roles played as needed?"""
        x_m, y_m = self._rally_points_m[group.rally_point or ""]
        for vehicle in fleet.vehicles:
            social, motion = vehicle.social, vehicle.functional.motion
            if social.organisation.is_member(vehicle.name, group.name):
                if math.hypot(motion.x_m - x_m, motion.y_m - y_m) > self._radius_m:
                    return False
                if social.leads(group.name) and social.gives_out(group.name):
                    return False
        return not self._lacking(fleet, group)

    @staticmethod
    def _lacking(fleet: Any, group: Group) -> list[str]:
        """Founding roles that too few vehicles still play, as each vehicle sees itself."""
        return [
            role.name
            for role in group.roles
            if role.founding
            and sum(v.social.organisation.plays(v.name, group.name, role.name) for v in fleet.vehicles if v.is_alive)
            < role.minimum
        ]
