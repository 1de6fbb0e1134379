"""Tasks of the mapping and rendezvous mission: its two HTN domains. See ``missions.mapping.mission``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from typing import Any

from missions.mapping.finds import INSPECTING
from missions.mapping.sensors import swath_m
from missions.mapping.unfinished import is_to_be_inspected
from missions.meeting.meeting import MEET, Meeting
from missions.meeting.orders import entrusted, expected_of
from remoras.activities import Objective
from remoras.database import VehicleData
from remoras.htn import ANY, Domain, Expected, FactsLike, Method, Operator, Task
from remoras.mission import ALLOCATE_ROLES, ASSIGN_OBJECTIVE, DISSOLVE_GROUP, FORM_GROUP, GIVE_MISSION, PURSUE
from remoras.nesting import supervised_by
from remoras.organisation import Group
from remoras.work import Job

MISSIONS = SUPERVISION, AREA_MAPPING = "Supervision", "AreaMapping"
INSPECTION = "Inspection"
"""Mission of a group that is formed at sea; a scenario gives it to none."""
EXPLORE = "Explore"
"""Task of a group, one of its roles and the role's area."""
HAVE_INSPECTED = "HaveInspected"
"""Task of a group that is formed at sea: to be there as long as there is something to inspect."""


def social_domain(
    groups: Mapping[str, Group],
    meeting: Meeting,
    jobs: Mapping[str, Job],
    finds: Collection[str],
) -> Domain:
    """Missions of groups into orders.

    Args:
        groups: by name; meeting: of the groups.
        jobs: by name.
        finds: names of those of them that may be found.
    """

    def orders(group: str, role: str) -> list[Task]:
        of = groups[group].role(role)
        area = None if of is None else of.job
        names = () if area is None else ("Positioning", "Exploring")
        return [Task(ASSIGN_OBJECTIVE, (group, role, name, area)) for name in names]

    methods = {SUPERVISION: supervision_methods(groups), AREA_MAPPING: mapping_methods(groups, finds)}
    if any(group.formed_by is not None for group in groups.values()):
        methods |= {INSPECTION: inspection_methods(groups, finds), HAVE_INSPECTED: forming_methods(groups, finds)}
    return Domain.of(
        meeting.operators(jobs, "Exploring"),
        {**methods, EXPLORE: entrusted(orders), **meeting.methods()},
    )


def supervision_methods(groups: Mapping[str, Group]) -> list[Method]:
    """Supervision: the groups that are supervised get their missions, then the own group meets.

    Groups that supervise others get supervision too, the rest mapping.

    Args:
        groups: by name.
    """
    supervised = supervised_by(group for group in groups.values() if group.formed_by is None)

    def delegate(facts: FactsLike, group: str) -> list[Task]:
        return [
            *(
                Task(GIVE_MISSION, (name, SUPERVISION if supervised[name] else AREA_MAPPING))
                for name in supervised[group]
            ),
            Task(MEET, (group,)),
        ]

    return [Method("delegate the mapping", delegate, uses=(GIVE_MISSION, MEET))]


def mapping_methods(by_name: Mapping[str, Group], finds: Collection[str]) -> list[Method]:
    """AreaMapping: roles are allocated, every area is explored and every find inspected, then the group meets.

    Args:
        by_name: groups with their roles.
        finds: names of what may be found; a plan rests on what has been.
    """

    def unfinished(facts: FactsLike, group: Group) -> list[tuple[str, str]]:
        return [
            (role.name, role.job)
            for role in group.roles
            if role.job is not None and role.job not in finds and facts.get(("areaDone", role.job)) is None
        ]

    def has_work(facts: FactsLike, group: str) -> bool:
        to_do = unfinished(facts, by_name[group]), waiting(facts, by_name[group], finds)  # a plan rests on all of them
        return any(to_do)

    def inspected(group: str) -> list[Task]:
        return [Task(HAVE_INSPECTED, (formed.name,)) for formed in by_name.values() if formed.formed_by == group]

    def together(facts: FactsLike, group: str) -> bool:
        return facts.get(("gatheredAt", group)) is not None

    def explore(facts: FactsLike, group: str) -> list[Task]:
        explored = [Task(EXPLORE, (group, name, area)) for name, area in unfinished(facts, by_name[group])]
        mapped = [
            Task(ASSIGN_OBJECTIVE, (group, role.name, "Mapping", group))
            for role in by_name[group].roles
            if not role.founding and role.job is None
        ]
        return [Task(ALLOCATE_ROLES, (group,)), *explored, *mapped, *inspected(group), Task(MEET, (group,))]

    forming = (HAVE_INSPECTED,) if any(group.formed_by is not None for group in by_name.values()) else ()
    return [
        Method("stay together", lambda facts, group: inspected(group), together, forming),
        Method("explore, then meet", explore, has_work, (ALLOCATE_ROLES, EXPLORE, ASSIGN_OBJECTIVE, MEET, *forming)),
        Method("meet", lambda facts, group: [*inspected(group), Task(MEET, (group,))], uses=(MEET, *forming)),
    ]


def waiting(facts: FactsLike, group: Group, finds: Collection[str]) -> list[str]:
    """What is found and not inspected of that which roles of a group inspect."""
    return [role.job for role in group.roles if role.job and role.job in finds and is_to_be_inspected(facts, role.job)]


def inspection_methods(by_name: Mapping[str, Group], finds: Collection[str]) -> list[Method]:
    """Inspection: members are recruited, and roles allocated among them, whenever something is found or inspected.

    Args:
        by_name: groups with their roles.
        finds: names of what may be found.
    """

    def has_work(facts: FactsLike, group: str) -> bool:
        return bool(waiting(facts, by_name[group], finds))

    return [
        Method("inspect", lambda facts, group: [Task(ALLOCATE_ROLES, (group,))], has_work, (ALLOCATE_ROLES,)),
        Method("all is inspected", lambda facts, group: [], uses=()),
    ]


def forming_methods(by_name: Mapping[str, Group], finds: Collection[str]) -> list[Method]:
    """HaveInspected: a group is formed once something is found, given its mission, and dissolved once all is inspected.

    Where nobody of it is there any more it is dissolved too, to be formed anew of others.

    Args:
        by_name: groups with their roles.
        finds: names of what may be found.
    """

    def is_there(facts: FactsLike, group: str) -> bool:
        return bool(facts.get(("formed", group)))

    def has_work(facts: FactsLike, group: str) -> bool:
        return bool(waiting(facts, by_name[group], finds))

    def is_needed(facts: FactsLike, group: str) -> bool:
        return not is_there(facts, group) and has_work(facts, group)

    def is_over(facts: FactsLike, group: str) -> bool:
        if not is_there(facts, group):
            return False
        paths = [by_name[group].path(role.name) for role in by_name[group].roles if role.founding]
        holders = [facts.get(("members", path)) for path in paths]  # a plan rests on all of them
        return not has_work(facts, group) or not any(holders)

    def mission(facts: FactsLike, group: str) -> list[Task]:
        return [Task(GIVE_MISSION, (group, INSPECTION))]

    return [
        Method("form a group", lambda facts, group: [Task(FORM_GROUP, (group,))], is_needed, (FORM_GROUP,)),
        Method("dissolve it", lambda facts, group: [Task(DISSOLVE_GROUP, (group,))], is_over, (DISSOLVE_GROUP,)),
        Method("let it inspect", mission, is_there, (GIVE_MISSION,)),
        Method("nothing to inspect", lambda facts, group: [], uses=()),
    ]


def activity_domain(jobs: Mapping[str, Job]) -> Domain:
    """Objectives into activities; every task has the objective and the data of its vehicle as arguments.

    ==================  ====================  ==========================  ============================
    elementary task     test                  effect                      expected
    ==================  ====================  ==========================  ============================
    ZigzagExploring     a mapping sensor      the area is explored        way and work, as of its job
    Inspecting          the find is known     it is inspected             way and work, as of its job
    Mapping             a mapping sensor      the group has met           nobody can tell
    Positioning         none                  none: it goes on            nobody can tell
    ==================  ====================  ==========================  ============================

    Args:
        jobs: of the mission, by name.
    """

    def has_sensor(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return swath_m(data) > 0.0

    def apart(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return has_sensor(facts, objective, data) and facts.get(("gatheredAt", objective.group)) is None

    def explorable(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return apart(facts, objective, data) and facts.get(("areaDone", objective.argument)) is None

    def inspectable(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return apart(facts, objective, data) and is_to_be_inspected(facts, objective.argument)

    def is_found(facts: FactsLike, objective: Objective, data: VehicleData) -> bool:
        return facts.get(("foundAt", objective.argument)) is not None

    def done(facts: FactsLike, objective: Objective, data: VehicleData) -> Mapping[Hashable, Any]:
        return {jobs[objective.argument].done: ANY}

    def met(facts: FactsLike, objective: Objective, data: VehicleData) -> Mapping[Hashable, Any]:
        return {("gatheredAt", objective.group): ANY}

    def job(facts: FactsLike, objective: Objective, data: VehicleData) -> Expected | None:
        return expected_of(jobs[objective.argument], data, facts.get(("position", data.name)) or data.start_m)

    def unknown(facts: FactsLike, objective: Objective, data: VehicleData) -> None:
        return None

    def either(name: str, activity: str, when: Callable[..., bool], otherwise: str) -> list[Method]:
        return [
            Method(name, lambda facts, *args: [Task(activity, args)], when, (activity,)),
            Method(otherwise, lambda facts, *args: [], lambda facts, *args: not when(facts, *args), ()),
        ]

    return Domain.of(
        [
            Operator("ZigzagExploring", has_sensor, done, expected=job),
            Operator("Inspecting", is_found, done, expected=job),
            Operator("Mapping", has_sensor, met, expected=unknown),
            Operator("Positioning", expected=unknown, lasts=True),
        ],
        {
            f"{PURSUE}Exploring": either("zigzag", "ZigzagExploring", explorable, "nothing left to explore"),
            f"{PURSUE}Mapping": either("map what is explored", "Mapping", apart, "nothing left to map"),
            f"{PURSUE}{INSPECTING}": either("closer pass", "Inspecting", inspectable, "nothing to inspect"),
            f"{PURSUE}Positioning": [
                Method("take place", lambda facts, *args: [Task("Positioning", args)], uses=("Positioning",))
            ],
        },
    )
