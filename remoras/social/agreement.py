"""Agreement of a fleet before the mission: organisation and, with some strategies, plans."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from remoras.activities import Objective
from remoras.beliefs import NOTHING_KNOWN, Key
from remoras.database import AUVDatabase
from remoras.errors import PlanningError
from remoras.group_hierarchy import meets_after, supervisors_of
from remoras.htn import NoPlan, Plan, Task, plan
from remoras.mission_parts import ALLOCATE_ROLES, ASSIGN_OBJECTIVE, GIVE_MISSION, SocialPart
from remoras.organisation import Group, Organisation
from remoras.social.workload import scarce_energy_j
from remoras.strategy import Strategy, adapt_roles, form_groups
from remoras.work import Work, jobs_left, precedence


@dataclass(frozen=True, slots=True)
class Agreement:
    """Common knowledge of all vehicles at the start; steps of ``plans`` have been carried out."""

    organisation: Organisation
    objectives: tuple[Objective, ...]
    plans: Mapping[str, Plan] = field(default_factory=dict)
    meets_after: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    supervisors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    at_sea: Mapping[str, Group] = field(default_factory=dict)

    @property
    def groups(self) -> tuple[Group, ...]:
        """All declared groups, including those formed at run time."""
        return (*self.organisation.groups.values(), *self.at_sea.values())


def agree(
    strategy: Strategy,
    mission: SocialPart,
    database: AUVDatabase,
    groups: Sequence[Group],
    until_s: float = math.inf,
) -> Agreement:
    """Form groups, allocate roles and, where the strategy asks for it, plan all missions.

    Vehicles short of energy until ``until_s`` get less work. Raises PlanningError if a mission to be planned before has
    no plan or a group would get two missions, PluginError if the strategy raises or returns a wrong type.
    """
    at_sea = {group.name: group for group in groups if group.formed_by is not None}
    groups = [group for group in groups if group.formed_by is None]
    organisation = form_groups(strategy, database, groups)
    objectives = list(mission.founding_objectives())
    before, supervisors = meets_after(groups), supervisors_of(groups)
    if not strategy.declaration.planned_before:
        return Agreement(organisation, tuple(objectives), {}, before, supervisors, at_sea)
    missions = {group.name: group.mission for group in groups if group.mission is not None}
    plans: dict[str, Plan] = {}
    energy_j = scarce_energy_j(database.values(), {}, 0.0, until_s)
    starts = {name: data.start_m for name, data in database.items()}
    nothing: dict[Key, object] = {}
    # The mission of a group may give missions to others, which are planned next.
    while due := [name for name in missions if name not in plans]:
        for name in due:
            planned = plan(mission.social_domain, nothing, Task(missions[name], (name,)))
            if isinstance(planned, NoPlan):
                raise PlanningError(f"there is no plan for mission {missions[name]} of {name}: {planned.task}")
            opens = precedence(organisation.groups[name], mission.jobs)
            plans[name] = replace(planned, rests_on=planned.rests_on | opens)
            for task in planned.tasks:
                if task.name == GIVE_MISSION:
                    if missions.setdefault(*task.args) != task.args[1]:
                        has = missions[task.args[0]]
                        raise PlanningError(f"{task}: the group has mission {has}; allowed: one at the start")
                elif task.name == ASSIGN_OBJECTIVE:
                    objectives.append(Objective(*task.args))
                elif task.name == ALLOCATE_ROLES:
                    jobs, done = jobs_left(mission.jobs, NOTHING_KNOWN)
                    group = organisation.groups[name]
                    work = Work(group, organisation, database, jobs, done, starts, energy_j=energy_j)
                    for role in adapt_roles(strategy, work):
                        organisation, _ = organisation.assign(role.vehicle, role.group, role.role)
    with_missions = {group.name: replace(group, mission=missions.get(group.name)) for group in groups}
    return Agreement(replace(organisation, groups=with_missions), tuple(objectives), plans, before, supervisors, at_sea)
