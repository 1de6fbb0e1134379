"""Operators of the leader's HTN planner, for missions whose groups work and then meet.

=================  ==========================  =======================================  ==============================
task               test                        effects                                  expected
=================  ==========================  =======================================  ==============================
GiveMission        the group exists            the group has the mission                immediate
AllocateRoles      the group exists            its roles are allocated                  immediate
FormGroup          the group does not exist    it exists                                immediate
DissolveGroup      the group exists            it does not exist                        immediate
AssignObjective    roles are allocated, or     the objective is valid; also, a job is   travel and work of the role's
                   this one initially          done, or a rally point: the group has    holder at survey speed; or
                                               met                                      travel at transit speed
=================  ==========================  =======================================  ==============================

If a role loses its holder before its objectives are reached, the roles are allocated again. The rest of the mission is
not replanned.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from typing import Any

from exchange.arithmetic import distance
from remoras.database import VehicleData
from remoras.htn import ANY, Expected, FactsLike, Method, Operator, Task
from remoras.mission import ALLOCATE_ROLES, ASSIGN_OBJECTIVE, DISSOLVE_GROUP, FORM_GROUP, GIVE_MISSION
from remoras.organisation import Group
from remoras.work import Job, Outlook, Point

ASSIGNED = (ASSIGN_OBJECTIVE,)
"""Tasks that assign objectives to a role."""
ALLOCATED = (ALLOCATE_ROLES, *ASSIGNED)
"""Tasks that reassign them after the role is released."""


def entrusted(orders: Callable[[str, str], list[Task]]) -> list[Method]:
    """Methods of a task (group, role, ...) that assign objectives by the tasks of ``orders``."""

    def is_left(facts: FactsLike, group: str, role: str, *of: str) -> bool:
        return bool(facts.get(("lost", f"{group}.{role}")))

    def to_another(facts: FactsLike, group: str, role: str, *of: str) -> list[Task]:
        return [Task(ALLOCATE_ROLES, (group, *facts.get(("lost", f"{group}.{role}")))), *orders(group, role)]

    return [
        Method("to who plays it", lambda facts, group, role, *of: orders(group, role), uses=ASSIGNED),
        Method("to another", to_another, is_left, ALLOCATED),
    ]


def operators(
    groups: Mapping[str, Group],
    jobs: Mapping[str, Job],
    working: Collection[str],
    rally_points_m: Mapping[str, Point],
    rendez_vous: str,
) -> list[Operator]:
    """Return the operators of a group's mission; ``working`` are the objectives that do a job."""
    founding = {(group.name, role.name) for group in groups.values() for role in group.roles if role.founding}

    def exists(facts: FactsLike, group: str, *args: str) -> bool:
        return group in groups and (groups[group].formed_by is None or bool(facts.get(("formed", group))))

    def is_to_come(facts: FactsLike, group: str) -> bool:
        return group in groups and not exists(facts, group)

    def has_role(facts: FactsLike, group: str, role: str, *args: str) -> bool:
        return (group, role) in founding or facts.get(("allocated", group)) is not None

    def assigned(facts: FactsLike, group: str, role: str, objective: str, argument: str) -> Mapping[Hashable, Any]:
        counts: dict[Hashable, Any] = {("objective", f"{group}.{role}.{objective}"): argument}
        if objective in working:
            return {**counts, jobs[argument].done: ANY}
        return {**counts, ("gatheredAt", group): argument} if objective == rendez_vous else counts

    def expected(facts: FactsLike, group: str, role: str, objective: str, argument: str) -> Expected | None:
        if objective not in working and objective != rendez_vous:
            return Expected()
        holders = facts.get(("members", f"{group}.{role}"))
        if not holders:
            return None
        data: VehicleData = facts.get(("data", holders[0]))
        at_m: Point = facts.get(("position", holders[0])) or data.start_m
        if objective == rendez_vous:
            time_s = distance(at_m, rally_points_m[argument]) / data.transit_speed_mps
            return Expected(time_s, time_s * data.power_w(data.transit_speed_mps))
        return expected_of(jobs[argument], data, at_m)

    forming = (
        Operator(FORM_GROUP, is_to_come, lambda facts, group: {("formed", group): True}),
        Operator(DISSOLVE_GROUP, exists, lambda facts, group: {("formed", group): False}),
    )
    return [
        Operator(GIVE_MISSION, exists, lambda facts, group, mission: {("given", f"{group}.{mission}"): True}),
        Operator(ALLOCATE_ROLES, exists, lambda facts, group, *lost: {("allocated", group): True}),
        Operator(ASSIGN_OBJECTIVE, has_role, assigned, expected=expected),
        *(forming if any(group.formed_by is not None for group in groups.values()) else ()),
    ]


def expected_of(job: Job, data: VehicleData, at_m: Point) -> Expected | None:
    """Expected time (s) and energy (J) of a job at survey speed; None if unable to do it."""
    after = job.after(Outlook(0.0, at_m), data)
    return None if after is None else Expected(after.free_s, after.free_s * data.power_w(data.survey_speed_mps))
