"""The REMORAS strategy: areas allocated by the head of the group, then satisfaction and altruism.

The head allocates all areas when it plans the mission, and the areas of a member that leaves. What the vehicles make
of it is moved by the influence signals that every one sends for every role it plays.
Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV and VII; costs and optimisation are ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategies.allocation import Outlook, at_work, balanced, nearest_first, open_roles, shared_out, surveyors
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import Declaration, Evidence


def all_areas(group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
    """Every role that nobody plays, given to members; areas in addition to what each has still to do."""
    members = surveyors(group, organisation, evidence.database)
    vacant = [r for r in open_roles(group, evidence) if not organisation.members(group.name, r.name)]
    outlooks = {
        data.name: nearest_first(
            Outlook(0.0, evidence.position_m(data.name)),
            data,
            [evidence.corners_m[r.area or ""] for r in at_work(data.name, group, organisation, evidence)],
        )
        for data in members
    }
    areas = shared_out(group, vacant, members, outlooks, evidence, len(vacant))
    areas = balanced(group, areas, members, outlooks, evidence)
    return common_roles(group, organisation, evidence) + areas


@dataclass(frozen=True, slots=True)
class Remoras:
    """Roles allocated by the head of each group; see the module's text."""

    name: ClassVar[str] = "remoras"
    declaration: ClassVar[Declaration] = Declaration(
        source="Carlesi, Michel, Jouvencel, Ferber 2011",
        messages={
            "hasMission": "a head gives another group its mission",
            "playsRole": "a head gives a member a role",
            "objectiveExploring": "a head gives a role an objective (and so for the other objectives)",
            "leftRole": "a vehicle leaves a role",
            "influence signal": "one signed byte for every role that the sender plays, in every slot",
        },
        planned_before=False,
        influences=True,
    )

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        return founded(database, groups)

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        return all_areas(group, organisation, evidence)

    def negotiator(self, me: str, group: Group) -> None:
        return None


STRATEGY = Remoras()
