"""Tasks of the mapping and rendezvous mission: its two HTN domains. See ``missions.mapping.mission``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from missions.mapping.sensors import swath_m
from missions.mapping.unfinished import is_to_be_inspected
from missions.meeting.meeting import ALLOCATED, ASSIGNED, Meeting
from remoras.activities import Objective
from remoras.database import VehicleData
from remoras.htn import Domain, FactsLike, Method, Operator, Task
from remoras.organisation import Group


class Context:
    """What the activity domain's methods know of the vehicle that plans."""

    def __init__(self, objective: Objective, data: VehicleData) -> None:
        self.objective = objective
        self.data = data


def supervision_methods(groups: Sequence[Group], meeting: Meeting) -> list[Method]:
    """Supervision: the other groups get their missions, then the own group meets."""

    def delegate(facts: FactsLike, group: str) -> list[Task]:
        own = next(g for g in groups if g.name == group)
        others = [g for g in groups if g.name != group]
        return [*(Task("GiveMission", (g.name, "AreaMapping")) for g in others), *meeting.tasks(own)]

    return [Method("delegate the mapping", delegate, uses=("GiveMission", *ASSIGNED))]


def mapping_methods(groups: Sequence[Group], meeting: Meeting, finds: Collection[str] = ()) -> list[Method]:
    """AreaMapping: roles are allocated, every area is explored and every find inspected, then the group meets.

    Args:
        groups: with their roles; meeting: of the groups.
        finds: names of what may be found; a plan rests on what has been.
    """
    by_name = {group.name: group for group in groups}

    def unfinished(facts: FactsLike, group: Group) -> list[tuple[str, str]]:
        return [
            (role.name, role.job)
            for role in group.roles
            if role.job is not None and role.job not in finds and facts.get(("areaDone", role.job)) is None
        ]

    def found(facts: FactsLike, group: Group) -> list[str]:
        return [
            role.job for role in group.roles if role.job and role.job in finds and is_to_be_inspected(facts, role.job)
        ]

    def has_work(facts: FactsLike, group: str) -> bool:
        to_do = unfinished(facts, by_name[group]), found(facts, by_name[group])  # a plan rests on all of them
        return any(to_do)

    def together(facts: FactsLike, group: str) -> bool:
        return facts.get(("gatheredAt", group)) is not None

    def explore(facts: FactsLike, group: str) -> list[Task]:
        tasks = [Task("AllocateRoles", (group,))]
        for name, area in unfinished(facts, by_name[group]):
            tasks.append(Task("AssignObjective", (group, name, "Positioning", area)))
            tasks.append(Task("AssignObjective", (group, name, "Exploring", area)))
        for role in by_name[group].roles:
            if not role.founding and role.job is None:
                tasks.append(Task("AssignObjective", (group, role.name, "Mapping", group)))
        return [*tasks, *meeting.tasks(by_name[group])]

    return [
        Method("stay together", lambda facts, group: [], together, ()),
        Method("explore, then meet", explore, has_work, ALLOCATED),
        Method("meet", lambda facts, group: meeting.tasks(by_name[group]), uses=ASSIGNED),
    ]


def activity_domain(activity_names: Iterable[str]) -> Domain:
    """Objectives into activities; every method sees the facts, its vehicle's data and where it is."""

    def always(facts: FactsLike, context: Context) -> bool:
        return True

    def method(name: str, *activities: str, when: Callable[[FactsLike, Context], bool] = always) -> Method:
        return Method(name, lambda facts, *args: [Task(one, args) for one in activities], when, activities)

    def is_open(facts: FactsLike, context: Context) -> bool:
        objective = context.objective
        return (
            facts.get(("gatheredAt", objective.group)) is None and facts.get(("areaDone", objective.argument)) is None
        )

    def apart(facts: FactsLike, context: Context) -> bool:
        return facts.get(("gatheredAt", context.objective.group)) is None

    def has_sensor(facts: FactsLike, context: Context) -> bool:
        return swath_m(context.data) > 0.0

    methods: dict[str, list[Method]] = {
        "PursueExploring": [
            method("zigzag", "ZigzagExploring",
                   when=lambda facts, context: has_sensor(facts, context) and is_open(facts, context)),
            method("nothing left to explore"),
        ],
        "PursueMapping": [
            method("map what is explored", "Mapping",
                   when=lambda facts, context: has_sensor(facts, context) and apart(facts, context)),
            method("nothing left to map"),
        ],
        "PursueInspecting": [
            method("closer pass", "Inspecting",
                   when=lambda facts, context: has_sensor(facts, context) and apart(facts, context)
                   and is_to_be_inspected(facts, context.objective.argument)),
            method("nothing to inspect"),
        ],
        "PursuePositioning": [method("take place", "Positioning")],
    }  # fmt: skip
    return Domain.of([Operator(name) for name in activity_names], methods)
