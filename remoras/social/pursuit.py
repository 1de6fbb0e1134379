"""Pursuit: the activities by which a vehicle pursues the objectives of its roles."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

from remoras.activities import ActivitySet, Objective
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.htn import FactsLike
from remoras.mission import SocialPart
from remoras.plugins import answer
from remoras.work import Point

Means = tuple[tuple[ActivitySet, ...], frozenset[Key]]
"""Activities by which an objective is pursued, and the facts that this choice rests on."""


class Pursuit:
    """Activities of one vehicle, kept as long as the facts that they rest on.

    Args:
        data: of the vehicle.
        mission: turns objectives into activities; mission_name: what messages call it.
    """

    def __init__(self, data: VehicleData, mission: SocialPart, mission_name: str) -> None:
        self._data = data
        self._mission = mission
        self._mission_name = mission_name
        self._means: dict[Objective, Means] = {}
        self._rests_on: frozenset[Key] = frozenset()  # what any of these rests on

    def let_go(self, keys: Collection[Key]) -> bool:
        """Let go of activities that rest on any of the facts ``keys``; True if there were some."""
        if self._rests_on.isdisjoint(keys):
            return False
        stale = [one for one, (_, rests_on) in self._means.items() if not rests_on.isdisjoint(keys)]
        for objective in stale:
            del self._means[objective]
        return bool(stale)

    def sets(self, objectives: Iterable[Objective], facts: FactsLike, position_m: Point) -> tuple[ActivitySet, ...]:
        """Activities for these objectives; those under way are kept as they are.

        Args:
            objectives: of the vehicle's roles.
            facts: what is known.
            position_m: where the vehicle is.
        """
        ordered = sorted(objectives, key=lambda o: (o.group, o.role, o.name, o.argument))
        self._means = {one: self._means.get(one) or self._means_to(one, facts, position_m) for one in ordered}
        self._rests_on = frozenset().union(*(rests_on for _, rests_on in self._means.values()))
        return tuple(activity_set for sets, _ in self._means.values() for activity_set in sets)

    def _means_to(self, objective: Objective, facts: FactsLike, position_m: Point) -> Means:
        return answer(
            f"{self._mission_name}, objective {objective}",
            "activity_sets",
            "a tuple of ActivitySet, and a frozenset of the keys that it rests on",
            _are_means,
            lambda: self._mission.activity_sets(objective, self._data, facts, position_m),
        )


def _are_means(found: Any) -> bool:
    sets, rests_on = found
    return all(isinstance(one, ActivitySet) for one in sets) and isinstance(rests_on, frozenset)
