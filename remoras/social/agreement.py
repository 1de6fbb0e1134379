"""What a fleet agrees on before the mission, while its vehicles can still talk: the organisation, and with some
strategies also the missions of all groups and what they mean for every role.

Planning before the mission is planning at sea without messages: the same HTN domain, on the beliefs of a
vehicle that has observed nothing yet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from remoras.activities import Objective
from remoras.beliefs import Key
from remoras.database import AUVDatabase
from remoras.errors import PlanningError
from remoras.htn import NoPlan, Task, plan
from remoras.mission import Mission
from remoras.organisation import Group, Organisation
from remoras.strategy import Evidence, Strategy


@dataclass(frozen=True, slots=True)
class Agreement:
    """What every vehicle knows at the start.

    Attributes:
        organisation: groups with the missions they have, and who plays which role.
        objectives: of roles.
        rests_on: for each group whose mission is planned, the facts that its plan rests on.
    """

    organisation: Organisation
    objectives: tuple[Objective, ...]
    rests_on: Mapping[str, frozenset[Key]] = field(default_factory=dict)


def agree(strategy: Strategy, mission: Mission, database: AUVDatabase, groups: Sequence[Group]) -> Agreement:
    """The agreement that ``strategy`` starts from.

    Raises:
        PlanningError: there is no plan for a mission that is to be planned before.
    """
    organisation = strategy.form(database, groups)
    objectives = list(mission.founding_objectives())
    if not strategy.declaration.planned_before:
        return Agreement(organisation, tuple(objectives))
    missions = {group.name: group.mission for group in groups if group.mission is not None}
    rests_on: dict[str, frozenset[Key]] = {}
    starts = {name: data.start_m for name, data in database.items()}
    evidence = Evidence(database, starts, mission.corners_m, frozenset())
    nothing: dict[Key, object] = {}
    while due := [name for name in missions if name not in rests_on]:
        for name in due:
            found = plan(mission.social_domain, nothing, Task(missions[name], (name,)))
            if isinstance(found, NoPlan):
                raise PlanningError(f"there is no plan for mission {missions[name]} of {name}: {found.task}")
            rests_on[name] = found.rests_on
            for task in found.tasks:
                if task.name == "GiveMission":
                    missions[task.args[0]] = task.args[1]
                elif task.name == "AssignObjective":
                    objectives.append(Objective(*task.args))
                else:
                    for one in strategy.adapt(organisation.groups[name], organisation, evidence):
                        organisation, _ = organisation.assign(one.vehicle, one.group, one.role)
    given = {group.name: replace(group, mission=missions.get(group.name)) for group in groups}
    return Agreement(replace(organisation, groups=given), tuple(objectives), rests_on)
