"""Planning of missions, orders to their groups, and pursuit of objectives.

A plan is executed as a tree (``remoras.htn.execution``). Its steps allocate roles, give missions and assign objectives;
the latter run until their effects hold. If the role of a running step becomes vacant, the step fails and its branch is
replanned. If a fact changes on which the plan depends, or members outside running steps come or leave, the whole
mission is replanned. Objectives in the mission's activity domain are pursued in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from remoras.activities import ActivitySet, Objective
from remoras.beliefs import Beliefs, Fact, Key
from remoras.database import VehicleData
from remoras.errors import PlanningError
from remoras.htn import Domain, Execution, FactsLike, NoPlan, Plan, Task, plan
from remoras.mission_parts import (
    ALLOCATE_ROLES,
    ASSIGN_OBJECTIVE,
    DISSOLVE_GROUP,
    FORM_GROUP,
    GIVE_MISSION,
    PURSUE,
    SocialPart,
)
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.organisation.leadership import PLAYS_ROLE, is_able_to_lead
from remoras.plugins import answer
from remoras.recorder import OBJECTIVES
from remoras.social.view import DISSOLVED, FORMATION, FORMED_UNDER
from remoras.strategy import Strategy, adapt_roles
from remoras.work import Outlook, Point, Work, precedence
from worldmodel import Change, PropertyValue


@dataclass(frozen=True, slots=True)
class Deliberation:
    """Result of planning: facts, missions without a plan, and ``parts`` of facts by receiver."""

    facts: list[Fact]
    impossible: list[NoPlan]
    parts: list[list[Fact]] = field(default_factory=list)


def missions_of(groups: Iterable[Group], at_sea: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    """Return the known missions of each group; ``at_sea`` are those given at run time."""
    missions_by_group: dict[str, tuple[str, ...]] = {}
    for group in groups:
        if missions := dict.fromkeys((*([group.mission] if group.mission else ()), *at_sea.get(group.name, ()))):
            missions_by_group[group.name] = tuple(missions)
    return missions_by_group


class MissionPlanner:
    """Planner of the missions of groups that one vehicle leads; the strategy allocates roles.

    ``due`` are groups with missions to plan, ``allocated`` those with roles allocated since the last full planning.
    ``lost``: vehicles that left a role or became absent in it, once per event, by ``Group.Role``.
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
        self._anew: set[str] = set()  # due groups whose whole mission is replanned
        self._vacant: dict[str, set[tuple[str, str]]] = {}  # vacant (group, role) of groups with a recent departure
        self.orders = Orders(me, beliefs, strategy, at_sea)
        self._taken_over: set[str] = set()  # groups last planned under another leader

    def resume(self, known: FactsLike) -> None:
        """Start with plans made before, without stating their steps."""
        for execution in self.executions.values():
            for _ in execution.advance(known):
                pass

    # Due missions --------------------------------------------------------------------------------

    @property
    def rests_on(self) -> Iterator[Any]:
        """Keys of all facts that its plans depend on or wait for."""
        for execution in self.executions.values():
            yield from execution.rests_on | execution.awaited
        for no_plan in self._impossible.values():
            yield from no_plan.rests_on

    def has_planned(self, group: str) -> bool:
        """Return whether the mission of ``group`` has been planned."""
        return group in self.executions or group in self._impossible

    def take_on(self, groups: Iterable[str]) -> None:
        """Mark missions of these groups as due unless planned."""
        for group in groups:
            if not self.has_planned(group):
                self._plan_anew(group)

    def reconsider(self, keys: Collection[Key], led: Iterable[str], facts: FactsLike) -> None:
        """Settle steps and mark missions as due after facts with these keys have changed."""
        for group in led:
            execution = self.executions.get(group)
            if execution is not None and not execution.awaited.isdisjoint(keys):
                self._settle(group, execution, facts)
            planned = self._impossible.get(group) or execution
            if ("hasMission", group) in keys or (planned is not None and not planned.rests_on.isdisjoint(keys)):
                self._plan_anew(group)

    def _settle(self, group: str, execution: Execution, facts: FactsLike) -> None:
        if execution.settle(facts) and execution.is_waiting:
            self.due.add(group)

    def _plan_anew(self, group: str) -> None:
        self.due.add(group)
        self._anew.add(group)

    def lead(self, groups: Collection[str], taken_over: Collection[str]) -> None:
        """Set the groups to plan; all missions of groups ``taken_over`` are due."""
        self.due.intersection_update(groups)
        self._taken_over = self._taken_over.intersection(groups).union(taken_over)
        for group in taken_over:
            self._plan_anew(group)

    def plan_again(self, groups: Iterable[str]) -> None:
        """Mark missions already planned here as due: members came back or became free."""
        for group in groups:
            if self.has_planned(group):
                self._plan_anew(group)

    def lose(self, left: Iterable[RoleAssignment], present: Organisation) -> None:
        """Record roles that vehicles left or became absent in; steps of vacant roles have failed."""
        for assignment in left:
            if self.has_planned(assignment.group):
                path = f"{assignment.group}.{assignment.role}"
                self.lost[path] = (*self.lost.get(path, ()), assignment.vehicle)
                vacant = self._vacant.setdefault(assignment.group, set())
                if not present.members(assignment.group, assignment.role):
                    vacant.add((assignment.group, assignment.role))
                self.due.add(assignment.group)

    def forget(self, group: str) -> None:
        """Drop plan and orders of a group that was formed or dissolved."""
        if group in self.executions:
            self.executions[group].abandon()
        self._impossible.pop(group, None)
        self._vacant.pop(group, None)
        self.allocated.discard(group)
        self.due.discard(group)
        self._anew.discard(group)
        self.lost = {path: holder for path, holder in self.lost.items() if path.split(".")[0] != group}
        self.orders.forget(group)

    def end_round(self, left: Iterable[RoleAssignment], facts: FactsLike) -> None:
        """Settle steps and forget proposals of this round, and orders for roles in ``left``."""
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
        """Plan missions that are due, or only their failed branches, and advance execution."""
        orders = self.orders
        handlers: dict[str, Callable[..., list[Fact]]] = {
            ALLOCATE_ROLES: lambda name, *lost: self._allocate(work[name]),
            GIVE_MISSION: lambda name, mission: orders.give_mission(name, mission, missions),
            FORM_GROUP: lambda name: orders.form(name, work, known.get(("formation", name), 0) + 1),
            DISSOLVE_GROUP: lambda name: orders.dissolve(name, known.get(("formation", name), 0)),
            ASSIGN_OBJECTIVE: lambda *args: orders.give(Objective(*args), objectives, args[0] in self._taken_over),
        }
        facts: list[Fact] = []
        impossible: list[NoPlan] = []
        for group in sorted(self.due):
            tasks = [Task(mission, (group,)) for mission in missions.get(group, ())]
            vacant = self._vacant.pop(group, None)
            if not tasks:
                continue
            if group in self._anew or (vacant is not None and not self._mend(group, vacant, known)):
                impossible += self._plan_whole(work[group], tasks, known)
            if group not in self._impossible:
                execution = self.executions[group]
                for step in execution.advance(known):
                    facts += handlers[step.task.name](*step.task.args)
                if execution.has_failed:
                    self._impossible[group] = NoPlan(tasks[0], execution.rests_on)
            if group in self._impossible:
                impossible.append(self._impossible[group])
            self._taken_over.discard(group)
        self.due.clear()
        self._anew.clear()
        return Deliberation(facts, impossible)

    def _plan_whole(self, work: Work, tasks: Sequence[Task], known: FactsLike) -> list[NoPlan]:
        group, lacking = work.group.name, list[NoPlan]()
        self.allocated.discard(group)
        self._impossible.pop(group, None)
        execution, planned = self.executions.get(group), plan(self._domain, known, tasks)
        # One mission without a plan must not prevent the others.
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


# Orders ------------------------------------------------------------------------------------------


def by_receiver(
    facts: Sequence[Fact],
    beliefs: Beliefs,
    role_named: Callable[[PropertyValue], tuple[str, str] | None],
    mission: SocialPart,
) -> list[list[Fact]]:
    """Split facts by receiver, single vehicles first, in the order in which these get roles."""
    named = [(fact, role_named(PropertyValue(*fact)) or ("", "")) for fact in facts]
    players: dict[str, list[str]] = {}  # by role
    parts: dict[str, list[Fact]] = {}
    for (subject, *_), (attribute, role) in named:
        if attribute == PLAYS_ROLE:
            players.setdefault(role, []).append(beliefs.name(subject))
            parts.setdefault(beliefs.name(subject), [])
    shared: list[Fact] = []
    together: list[Fact] = []
    for fact, (attribute, role) in named:
        if attribute == PLAYS_ROLE:
            parts[beliefs.name(fact[0])].append(fact)
        elif role not in players or not attribute.startswith(OBJECTIVES):
            shared.append(fact)
        elif _is_individual(mission, _objective(role, attribute, beliefs.name(fact[2]))):
            for name in players[role]:
                parts[name].append(fact)
        else:
            together.append(fact)
    return [part for part in (*parts.values(), shared, together) if part]


def _is_individual(mission: SocialPart, objective: Objective) -> bool:
    who, asked = f"mission {type(mission).__name__}", lambda: mission.is_individual(objective)
    return answer(who, "is_individual", "true or false", bool, asked)


def _objective(path: str, attribute: str, argument: str) -> Objective:
    group, role = path.split(".")
    return Objective(group, role, attribute.removeprefix(OBJECTIVES), argument)


def aims(
    facts: Iterable[tuple[str, str, object]],
    objectives: Iterable[Objective],
    founding: Collection[Objective],
    beliefs: Beliefs,
    mission: SocialPart,
) -> list[Fact]:
    """Return individual objectives of roles assigned in ``facts``, except ``founding`` ones."""
    roles = [value for _, attribute, value in facts if attribute == PLAYS_ROLE]
    if not roles:
        return []
    return [
        beliefs.fact(f"{objective.group}.{objective.role}", OBJECTIVES + objective.name, objective.argument)
        for objective in objectives
        if objective not in founding
        and f"{objective.group}.{objective.role}" in roles
        and _is_individual(mission, objective)
    ]


def nearness(work: Work, vehicle: str) -> tuple[float, int]:
    """Return completion time (s) of the first open job the vehicle could do, and its node."""
    data, here = work.database[vehicle], Outlook(work.now_s, work.position_m(vehicle))
    thens = [work.after(here, data, role) for role in work.open if work.affords(here, data, role)]
    return min((after.free_s for after in thens if after is not None), default=math.inf), data.node


def recruits(work: Work) -> list[RoleAssignment]:
    """Return the nearest members of the forming group for the minimum of each founding role."""
    group, organisation = work.group, work.organisation
    if group.formed_by is None:
        return []
    assignments: list[RoleAssignment] = []
    taken = set(work.members)
    for role in group.roles:
        if not role.founding or role.head or role.job is not None:
            continue
        free = set(organisation.members(group.formed_by)).difference(taken, work.unavailable)
        able = [name for name in free if work.database[name].can_play(group.name, role.name)]
        chosen = sorted(able, key=lambda name: nearness(work, name))[: max(0, role.minimum - len(work.holders(role)))]
        assignments += [work.assignment(role, name) for name in chosen]
        taken.update(chosen)
    return assignments


LAST_FORMATION = 255
"""Greatest formation number in the ontology."""


class Orders:
    """Orders of one leader; ``issued`` and ``issued_objectives`` are those it has given."""

    def __init__(self, me: str, beliefs: Beliefs, strategy: Strategy, at_sea: Mapping[str, Group]) -> None:
        self._me = me
        self._beliefs = beliefs
        self._strategy = strategy
        self._at_sea = at_sea
        self._proposed: dict[RoleAssignment | Objective | Fact, None] = {}  # stated in this round, not yet valid
        self._awaited: dict[RoleAssignment, str] = {}  # assigned jobs without acknowledgement
        self.issued: set[RoleAssignment] = set()
        self.issued_objectives: set[Objective] = set()

    def note(self, change: Change) -> None:
        """Take a statement about a job as acknowledgement of its assignment to the issuer."""
        if self._awaited:
            issuer = self._beliefs.name(change.block.origin)
            jobs = {self._beliefs.name(fact.subject) for fact in change.block.facts}
            acknowledged = [
                assignment for assignment, job in self._awaited.items() if assignment.vehicle == issuer and job in jobs
            ]
            for assignment in acknowledged:
                del self._awaited[assignment]

    def waits_for(self, peers: Collection[str], done: Collection[str]) -> bool:
        """Return whether a peer has not acknowledged an assigned job that is not done."""
        return any(assignment.vehicle in peers and job not in done for assignment, job in self._awaited.items())

    def end_round(self, left: Iterable[RoleAssignment]) -> None:
        """Forget proposals of this round, and orders for roles that vehicles have ``left``."""
        self._proposed.clear()
        for assignment in left:
            self.issued.discard(assignment)
            self._awaited.pop(assignment, None)

    def forget(self, group: str) -> None:
        """Forget all orders to a group that was formed or dissolved."""
        self.issued = {assignment for assignment in self.issued if assignment.group != group}
        self.issued_objectives = {objective for objective in self.issued_objectives if objective.group != group}
        self._awaited = {assignment: job for assignment, job in self._awaited.items() if assignment.group != group}

    # Steps ---------------------------------------------------------------------------------------

    def form(self, group: str, work: Mapping[str, Work], number: int) -> list[Fact]:
        """Form a group under the able member of its forming group that is nearest to the work."""
        group_to_form, former = self._at_sea[group], work[self._at_sea[group].formed_by or ""]
        able = [name for name in former.members if is_able_to_lead(former.database, name, group_to_form)]
        if number > LAST_FORMATION or not able:
            return []
        # The forming leader takes the lead only if no other vehicle can: it leads its own group.
        head = min(able, key=lambda name: (name == self._me, *nearness(replace(former, group=group_to_form), name)))
        return self._say(self._beliefs.fact(group, FORMED_UNDER, head), self._beliefs.fact(group, FORMATION, number))

    def dissolve(self, group: str, number: int) -> list[Fact]:
        """Dissolve the formation of a group with that number."""
        return self._say(self._beliefs.fact(group, DISSOLVED, number))

    def _say(self, *facts: Fact) -> list[Fact]:
        if facts[0] in self._proposed:
            return []
        self._proposed[facts[0]] = None
        return list(facts)

    def give_mission(self, group: str, mission: str, missions: Mapping[str, Collection[str]]) -> list[Fact]:
        """Add a mission to a group, unless known."""
        return [] if mission in missions.get(group, ()) else [self._beliefs.fact(group, "hasMission", mission)]

    def give(self, objective: Objective, objectives: Collection[Objective], again: bool = False) -> list[Fact]:
        """Give a role an objective, unless proposed or valid; ``again`` repeats a former leader's."""
        if objective in self._proposed or (objective in objectives and not again):
            return []
        self._proposed[objective] = None
        self.issued_objectives.add(objective)
        subject = f"{objective.group}.{objective.role}"
        return [self._beliefs.fact(subject, OBJECTIVES + objective.name, objective.argument)]

    def allocate(self, work: Work) -> list[Fact]:
        """Allocate roles by the strategy, given the proposals of this round; recruit members first."""
        expected = work.organisation
        for assignment in self._proposed:
            if isinstance(assignment, RoleAssignment):
                expected, _ = expected.assign(assignment.vehicle, assignment.group, assignment.role)
        recruited = recruits(replace(work, organisation=expected))
        for assignment in recruited:
            expected, _ = expected.assign(assignment.vehicle, assignment.group, assignment.role)
        allocated = adapt_roles(self._strategy, replace(work, organisation=expected))
        allowed = [
            *recruited,
            *(assignment for assignment in allocated if expected.is_member(assignment.vehicle, assignment.group)),
        ]
        self.issued.update(allowed)
        jobs = {role.name: role.job for role in work.group.roles}
        jobs_given = {assignment: job for assignment in allowed if (job := jobs.get(assignment.role))}
        self._awaited |= {assignment: job for assignment, job in jobs_given.items() if assignment.vehicle != self._me}
        self._proposed.update(dict.fromkeys(allowed))
        return [
            self._beliefs.fact(assignment.vehicle, "playsRole", f"{assignment.group}.{assignment.role}")
            for assignment in allowed
        ]


# Pursuit -----------------------------------------------------------------------------------------


Means = tuple[tuple[ActivitySet, ...], frozenset[Key]]
"""Activities for an objective, and the keys of facts that this choice depends on."""


class Pursuit:
    """Activities of one vehicle, cached by facts; ``hopeless`` objectives have no plan."""

    def __init__(self, data: VehicleData, mission: SocialPart, leaves: bool = False) -> None:
        self._data = data
        self._leaves = leaves
        self.hopeless: set[Objective] = set()
        self._mission = mission
        self._domain = mission.activity_domain
        self._means: dict[Objective, Means] = {}
        self._mended: set[Objective] = set()
        self.rests_on: frozenset[Key] = frozenset()
        self.executions: dict[Objective, Execution] = {}

    def let_go(self, keys: Collection[Key]) -> bool:
        """Drop activities that depend on any of these facts; return whether any did."""
        if self.rests_on.isdisjoint(keys):
            return False
        stale = [objective for objective, (_, rests_on) in self._means.items() if not rests_on.isdisjoint(keys)]
        for objective in stale:
            del self._means[objective]
        return bool(stale)

    def sets(self, objectives: Iterable[Objective], facts: FactsLike, position_m: Point) -> tuple[ActivitySet, ...]:
        """Return activities for these objectives; those under way stay as they are."""
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
        """Fail the step of these activities; return whether the objective has an alternative."""
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
        execution, task = self.executions.get(objective), Task(PURSUE + objective.name, (objective, self._data))
        if execution is None:
            planned = plan(domain, facts, task)
            if not isinstance(planned, Plan):
                if not self._leaves:
                    raise PlanningError(f"{self._data.name} has no way to pursue {objective}")
                self.hopeless.add(objective)
                return planned
            execution = self.executions[objective] = Execution(domain, planned)
        # A branch just replanned is the renewal; another plan would discard it.
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
            pass  # the executive layer selects among the running steps
        return execution

    def _answer(self, objective: Objective, hook: str, asked: Callable[[], Means]) -> Means:
        return answer(
            f"mission {type(self._mission).__name__}, objective {objective}",
            hook,
            "a tuple of ActivitySet, and a frozenset of the keys that it rests on",
            _are_means,
            asked,
        )


def _are_means(means: Any) -> bool:
    sets, rests_on = means
    return all(isinstance(activities, ActivitySet) for activities in sets) and isinstance(rests_on, frozenset)
