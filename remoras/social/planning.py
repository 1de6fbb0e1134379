"""Planning of missions: facts that the planner reads, plans, and their renewal.

A plan is carried out as the tree that it is (``remoras.htn.execution``): its steps allocate roles, give missions and
assign objectives, and a step that assigns one runs until its effects hold. When a role falls vacant for which a step is
running, that step has failed, and its branch is planned anew. When a fact changes that the plan rests on, or somebody
comes or leaves whom no running step needs, the whole mission is. What was proposed or counts already is not said twice.

Pursuit: the activities by which a vehicle pursues the objectives of its roles.

An objective that the mission's activity domain plans is pursued by an execution of that plan; what its running steps
are as activities, the mission says. Where a step's behaviour has failed, its branch is planned anew, if there is
another way.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from remoras.activities import ActivitySet, Objective
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import AUVDatabase, VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, Execution, FactsLike, NoPlan, Plan, Task, plan
from remoras.mission import (
    ALLOCATE_ROLES,
    ASSIGN_OBJECTIVE,
    DISSOLVE_GROUP,
    FORM_GROUP,
    GIVE_MISSION,
    PURSUE,
    SocialPart,
)
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.plugins import answer
from remoras.social.conclusions import Gatherings
from remoras.social.orders import Orders
from remoras.social.view import View
from remoras.strategy import Strategy
from remoras.work import Point, Work, precedence


@dataclass(frozen=True, slots=True)
class OwnFacts:
    """Beliefs of one vehicle, and what its social layer knows beside them; see ``SocialPart.social_domain``.

    Attributes:
        beliefs: of the vehicle.
        database: static data of all vehicles.
        present: who plays what and is there.
        view: missions that groups were given at sea, and formations of groups.
        gatherings: which meetings count; is_cut_off: whether the vehicle hears nobody.
        planner: of the missions that the vehicle plans.
        objectives: of roles, by group, role and name.
    """

    beliefs: Beliefs
    database: AUVDatabase
    present: Organisation
    view: View
    gatherings: Gatherings
    is_cut_off: bool
    planner: MissionPlanner
    objectives: Mapping[tuple[str, str, str], Objective]

    def get(self, key: Key, default: Any = None, /) -> Any:
        """The value of a fact, or ``default`` if it is not known."""
        kind, about = key
        match kind:
            case "members":
                return self.present.members(*about.split("."))
            case "lost":
                return self.planner.lost.get(about, default)
            case "allocated":
                return about in self.planner.allocated or default
            case "objective":
                group, role, name = about.split(".")
                objective = self.objectives.get((group, role, name))
                return default if objective is None else objective.argument
            case "hasMission":
                return missions_of(self.present.groups.values(), self.view.missions).get(about, (default,))[-1]
            case "given":
                group, _, mission = about.partition(".")
                missions = missions_of(self.present.groups.values(), self.view.missions)
                return mission in missions.get(group, ()) or default
            case "formed":
                return about in self.present.groups
            case "formation":
                return self.view.formation(about) or default
            case "data":
                return self.database[about]
            case "instances":
                return self.beliefs.instances(about)
            case "isA":
                return self.beliefs.is_a(*about.rsplit(".", 1)) or default
        if self.gatherings.is_undone(key, self.is_cut_off):
            return default
        return self.beliefs.get(key, default)


@dataclass(frozen=True, slots=True)
class Deliberation:
    """What came of planning.

    Attributes:
        facts: that it decided on.
        impossible: missions for which there is no plan.
        parts: the same facts by the vehicles that they concern, see ``remoras.social.orders``.
    """

    facts: list[Fact]
    impossible: list[NoPlan]
    parts: list[list[Fact]] = field(default_factory=list)


def missions_of(groups: Iterable[Group], at_sea: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    """What each group is to do, by its name, as far as it is known: one mission or several, side by side.

    Args:
        groups: with the missions that some have from the start.
        at_sea: missions that groups were given since, by their names.
    """
    missions_by_group: dict[str, tuple[str, ...]] = {}
    for group in groups:
        if missions := dict.fromkeys((*([group.mission] if group.mission else ()), *at_sea.get(group.name, ()))):
            missions_by_group[group.name] = tuple(missions)
    return missions_by_group


class MissionPlanner:
    """Plans the missions of the groups that one vehicle leads, and lets the strategy allocate roles for them.

    Args:
        me: own name.
        domain: HTN of the mission, from missions of groups to elementary tasks.
        beliefs: of the vehicle.
        strategy: allocates roles.
        planned: plans of the groups whose missions were planned before, all of whose steps have been said.
        at_sea: groups that are formed at sea, by name.

    Attributes:
        due: groups whose missions are to be planned.
        executions: the plans of the groups, as far as they are carried out.
        allocated: groups whose roles the strategy has allocated since their missions were last planned anew.
        lost: who has left a role or fallen silent in it, as often as that happened, by ``Group.Role``.
        orders: what it has said by the steps of its plans.
    """

    def __init__(
        self,
        me: str,
        domain: Domain,
        beliefs: Beliefs,
        strategy: Strategy,
        planned: Mapping[str, Plan],
        at_sea: Mapping[str, Group] = MappingProxyType({}),
    ) -> None:
        self._domain = domain
        self.executions = {group: Execution(domain, plan) for group, plan in planned.items()}
        self.allocated = set(planned)
        self.lost: dict[str, tuple[str, ...]] = {}
        self._impossible: dict[str, NoPlan] = {}
        self.due: set[str] = set()
        self._anew: set[str] = set()  # of those due, whose whole mission is planned
        self._vacant: dict[str, set[tuple[str, str]]] = {}  # (group, role) that all have left, where somebody has left
        self.orders = Orders(me, beliefs, strategy, at_sea)
        self._taken_over: set[str] = set()  # groups that another vehicle led when their missions were planned last

    def resume(self, known: FactsLike) -> None:
        """Begin with the plans that were made before, whose steps need not be said.

        Args:
            known: facts.
        """
        for execution in self.executions.values():
            for _ in execution.advance(known):
                pass

    # What is due ---------------------------------------------------------------------------------

    @property
    def rests_on(self) -> Iterator[Any]:
        """Keys of all facts that its plans rest on or wait for."""
        for execution in self.executions.values():
            yield from execution.rests_on | execution.awaited
        for no_plan in self._impossible.values():
            yield from no_plan.rests_on

    def has_planned(self, group: str) -> bool:
        """True once the mission of ``group`` has been planned."""
        return group in self.executions or group in self._impossible

    def take_on(self, groups: Iterable[str]) -> None:
        """Missions of these groups are due unless they have been planned."""
        for group in groups:
            if not self.has_planned(group):
                self._plan_anew(group)

    def reconsider(self, keys: Collection[Key], led: Iterable[str], facts: FactsLike) -> None:
        """Facts have changed: steps may have ended, and plans may have to be made anew.

        Args:
            keys: of the facts.
            led: groups that this vehicle leads.
            facts: that it knows now.
        """
        for group in led:
            execution = self.executions.get(group)
            if execution is not None and not execution.awaited.isdisjoint(keys):
                self._settle(group, execution, facts)
            planned = self._impossible.get(group) or execution
            if ("hasMission", group) in keys or (planned is not None and not planned.rests_on.isdisjoint(keys)):
                self._plan_anew(group)

    def _settle(self, group: str, execution: Execution, facts: FactsLike) -> None:
        """End the steps whose effects hold; if others have waited for that, the mission is due."""
        if execution.settle(facts) and execution.is_waiting:
            self.due.add(group)

    def _plan_anew(self, group: str) -> None:
        self.due.add(group)
        self._anew.add(group)

    def lead(self, groups: Collection[str], taken_over: Collection[str]) -> None:
        """Missions of these groups are this vehicle's to plan; of those taken over they are due.

        Args:
            groups: that it leads now.
            taken_over: those of them that it did not lead before.
        """
        self.due.intersection_update(groups)
        self._taken_over = self._taken_over.intersection(groups).union(taken_over)
        for group in taken_over:
            self._plan_anew(group)

    def plan_again(self, groups: Iterable[str]) -> None:
        """Members have come back or are free again: missions of these groups are due if they have been planned here."""
        for group in groups:
            if self.has_planned(group):
                self._plan_anew(group)

    def lose(self, left: Iterable[RoleAssignment], present: Organisation) -> None:
        """Vehicles have left roles, or fallen silent in them: if nobody plays one now, its running steps have failed.

        Args:
            left: roles and vehicles, of groups that this vehicle leads.
            present: who plays what now.
        """
        for assignment in left:
            if self.has_planned(assignment.group):
                path = f"{assignment.group}.{assignment.role}"
                self.lost[path] = (*self.lost.get(path, ()), assignment.vehicle)
                vacant = self._vacant.setdefault(assignment.group, set())
                if not present.members(assignment.group, assignment.role):
                    vacant.add((assignment.group, assignment.role))
                self.due.add(assignment.group)

    def forget(self, group: str) -> None:
        """A group was formed or dissolved at sea: its plan is over, and what was said of it before."""
        if group in self.executions:
            self.executions[group].abandon()
        self._impossible.pop(group, None)
        self._vacant.pop(group, None)
        self.allocated.discard(group)
        self.due.discard(group)
        self._anew.discard(group)
        self.lost = {path: who for path, who in self.lost.items() if path.split(".")[0] != group}
        self.orders.forget(group)

    def end_round(self, left: Iterable[RoleAssignment], facts: FactsLike) -> None:
        """What was proposed in this round has been said, and counts unless somebody has refused it.

        Args:
            left: roles that vehicles have left: they are given out no longer.
            facts: that the vehicle knows now.
        """
        self.orders.end_round(left)
        for group, execution in self.executions.items():
            self._settle(group, execution, facts)

    # Planning ------------------------------------------------------------------------------------

    def plan(
        self,
        known: FactsLike,
        missions: Mapping[str, Sequence[str]],
        work: Mapping[str, Work],
        objectives: Collection[Objective],
    ) -> Deliberation:
        """Plan the missions that are due, or only the branches of them that have failed, and carry the plans on.

        Args:
            known: facts that the plans rest on, and that tests and effects are asked of.
            missions: of the groups, by name.
            work: of the groups, by name.
            objectives: that count already.
        """
        orders = self.orders
        handlers: dict[str, Callable[..., list[Fact]]] = {
            ALLOCATE_ROLES: lambda of, *lost: self._allocate(work[of]),
            GIVE_MISSION: lambda of, mission: orders.give_mission(of, mission, missions),
            FORM_GROUP: lambda of: orders.form(of, work, known.get(("formation", of), 0) + 1),
            DISSOLVE_GROUP: lambda of: orders.dissolve(of, known.get(("formation", of), 0)),
            ASSIGN_OBJECTIVE: lambda *args: orders.give(Objective(*args), objectives, args[0] in self._taken_over),
        }
        facts: list[Fact] = []
        impossible: list[NoPlan] = []
        for group in sorted(self.due):
            tasks, vacant = (
                [Task(objective, (group,)) for objective in missions.get(group, ())],
                self._vacant.pop(group, None),
            )
            if not tasks:
                continue
            if group in self._anew or (vacant is not None and not self._mend(group, vacant, known)):
                impossible += self._plan_whole(work[group], tasks, known)
            if group not in self._impossible:
                execution = self.executions[group]
                for step in execution.advance(known):
                    facts += handlers[self._domain.operators[step.task.name].handled_by](*step.task.args)
                if execution.has_failed:
                    self._impossible[group] = NoPlan(tasks[0], execution.rests_on)
            if group in self._impossible:
                impossible.append(self._impossible[group])
            self._taken_over.discard(group)
        self.due.clear()
        self._anew.clear()
        return Deliberation(facts, impossible)

    def _plan_whole(self, work: Work, tasks: Sequence[Task], known: FactsLike) -> list[NoPlan]:
        """Plan the missions of a group anew; what is done of them stays done.

        Returns:
            Those of several for which there is no plan: the others are carried out without them.
        """
        group, lacking = work.group.name, list[NoPlan]()
        self.allocated.discard(group)
        self._impossible.pop(group, None)
        execution, planned = self.executions.get(group), plan(self._domain, known, tasks)
        if isinstance(planned, NoPlan) and len(tasks) > 1:
            alone = {task: plan(self._domain, known, task) for task in tasks}
            lacking = [failure for failure in alone.values() if isinstance(failure, NoPlan)]
            possible = [task for task, by_itself in alone.items() if isinstance(by_itself, Plan)]
            planned = plan(self._domain, known, possible) if possible and lacking else planned
        rests_on = planned.rests_on.union(precedence(work.group, work.jobs), *(failure.rests_on for failure in lacking))
        planned = replace(planned, rests_on=rests_on)
        if isinstance(planned, NoPlan):
            self._impossible[group] = planned
            return []
        if execution is None:
            self.executions[group] = Execution(self._domain, planned)
        else:
            execution.settle(known)
            execution.renew(planned)
        return lacking

    def _mend(self, group: str, vacant: Collection[tuple[str, str]], known: FactsLike) -> bool:
        """Roles have fallen vacant: plan the branches anew in which a step was running for one of them.

        Returns:
            True if there were some, and each has another way.
        """
        execution = self.executions.get(group)
        mended = False
        while execution is not None:
            failed = [step.place for step in execution.running if step.task.args[:2] in vacant]
            if not failed:
                break
            self.allocated.discard(group)
            if not execution.fail(failed[0], known):
                return False
            mended = True
        return mended

    def _allocate(self, work: Work) -> list[Fact]:
        self.allocated.add(work.group.name)
        return self.orders.allocate(work)


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
