"""Pursuit: the activities by which a vehicle pursues the objectives of its roles.

An objective that the mission's activity domain plans is pursued by an execution of that plan; what its running steps
are as activities, the mission says. Where a step's behaviour has failed, its branch is planned anew, if there is
another way.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import Any

from remoras.activities import ActivitySet, Objective
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, Execution, FactsLike, NoPlan, Plan, Task, plan
from remoras.mission import PURSUE, SocialPart
from remoras.plugins import answer
from remoras.work import Point

Means = tuple[tuple[ActivitySet, ...], frozenset[Key]]
"""Activities by which an objective is pursued, and the facts that this choice rests on."""


class Pursuit:
    """Activities of one vehicle, kept as long as the facts that they rest on.

    Args:
        data: of the vehicle.
        mission: turns objectives into activities; mission_name: what messages call it.
        leaves: True if the vehicle says what it has no way for, and leaves it; else that is a fault of the mission.

    Attributes:
        executions: plans of the objectives that it has had, as far as they are carried out.
        hopeless: objectives for which it has no way now.
        rests_on: keys of all facts that the activities rest on.
    """

    def __init__(self, data: VehicleData, mission: SocialPart, mission_name: str, leaves: bool = False) -> None:
        self._data = data
        self._leaves = leaves
        self.hopeless: set[Objective] = set()
        self._mission = mission
        self._mission_name = mission_name
        self._domain = mission.activity_domain
        self._means: dict[Objective, Means] = {}
        self._mended: set[Objective] = set()
        self.rests_on: frozenset[Key] = frozenset()
        self.executions: dict[Objective, Execution] = {}

    def let_go(self, keys: Collection[Key]) -> bool:
        """Let go of activities that rest on any of the facts ``keys``; True if there were some."""
        if self.rests_on.isdisjoint(keys):
            return False
        stale = [objective for objective, (_, rests_on) in self._means.items() if not rests_on.isdisjoint(keys)]
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
        for objective in self._means.keys() - set(ordered):
            if objective in self.executions:
                self.executions[objective].abandon()
        self._means = {
            objective: self._means.get(objective) or self._means_to(objective, facts, position_m)
            for objective in ordered
        }
        self.rests_on = frozenset().union(*(rests_on for _, rests_on in self._means.values()))
        self.hopeless.intersection_update(self._means)
        return tuple(activity_set for sets, _ in self._means.values() for activity_set in sets)

    def fail(self, objective: Objective, activities: Collection[str], facts: FactsLike) -> bool:
        """The step for one of these activities has failed. True if the objective is pursued in another way now.

        Args:
            objective: whose step it is.
            activities: names.
            facts: what is known.
        """
        execution = self.executions.get(objective)
        failed = [step.place for step in execution.running if step.task.name in activities] if execution else []
        if execution is None or not failed or not execution.fail(failed[0], facts):
            return False
        self._mended.add(objective)
        self._means.pop(objective, None)
        return True

    def _means_to(self, objective: Objective, facts: FactsLike, position_m: Point) -> Means:
        if self._domain is None or PURSUE + objective.name not in self._domain.methods:
            return self._answer(
                objective,
                "activity_sets",
                lambda: self._mission.activity_sets(objective, self._data, facts, position_m),
            )
        execution = self._planned(self._domain, objective, facts)
        if isinstance(execution, NoPlan):
            return (), execution.rests_on
        beside: dict[int, list[Task]] = {}
        for step in execution.running:
            beside.setdefault(execution.branches[step.place].parent, []).append(step.task)
        sets, rests_on = self._answer(
            objective,
            "activities",
            lambda: self._mission.activities(list(beside.values()), objective, self._data, facts, position_m),
        )
        return sets, rests_on | execution.rests_on | execution.awaited

    def _planned(self, domain: Domain, objective: Objective, facts: FactsLike) -> Execution | NoPlan:
        """The plan for an objective, made anew unless a branch of it has just been, and carried on.

        Returns:
            It under way; or why there is no way, if the vehicle then leaves the objective.

        Raises:
            PlanningError: it cannot be pursued, even before anything has failed.
        """
        execution, task = self.executions.get(objective), Task(PURSUE + objective.name, (objective, self._data))
        if execution is None:
            planned = plan(domain, facts, task)
            if not isinstance(planned, Plan):
                if not self._leaves:
                    raise PlanningError(f"{self._data.name} has no way to pursue {objective}")
                self.hopeless.add(objective)
                return planned
            execution = self.executions[objective] = Execution(domain, planned)
        elif objective not in self._mended:
            execution.settle(facts)
            again = execution.plan_anew(facts, task)
            if isinstance(again, Plan):
                execution.renew(again)
            else:
                execution.abandon()
                if self._leaves:
                    self.hopeless.add(objective)
                    return again
        self.hopeless.discard(objective)
        self._mended.discard(objective)
        for _ in execution.advance(facts):
            pass  # the vehicle performs what its decision chooses of the running steps
        return execution

    def _answer(self, objective: Objective, hook: str, asked: Callable[[], Means]) -> Means:
        return answer(
            f"{self._mission_name}, objective {objective}",
            hook,
            "a tuple of ActivitySet, and a frozenset of the keys that it rests on",
            _are_means,
            asked,
        )


def _are_means(means: Any) -> bool:
    sets, rests_on = means
    return all(isinstance(activities, ActivitySet) for activities in sets) and isinstance(rests_on, frozenset)
