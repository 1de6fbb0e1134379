"""The REMORAS strategy: jobs allocated by the head of the group, then satisfaction and altruism.

The head allocates all open jobs when it plans the mission, and again when a member leaves or a job is done that others
need. What the vehicles make of it is moved by the influence signals that each sends for every role it plays.
Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV and VII; costs and optimisation are ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.organisation import Group, RoleAssignment
from remoras.strategies.allocation import all_jobs
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import INFLUENCE_SIGNAL, OBJECTIVE, Declaration
from remoras.work import Work


@dataclass(frozen=True, slots=True)
class Remoras:
    """Roles allocated by the head of each group; see the module's text."""

    name: ClassVar[str] = "remoras"
    declaration: ClassVar[Declaration] = Declaration(
        source="Carlesi, Michel, Jouvencel, Ferber 2011",
        messages={
            "hasMission": "a head gives another group its mission",
            "playsRole": "a head gives a member a role",
            OBJECTIVE: "a head gives a role an objective",
            "leftRole": "a vehicle leaves a role",
            INFLUENCE_SIGNAL: "one signed byte for every role that the sender plays, in every slot",
        },
        planned_before=False,
        influences=True,
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Common roles for all, and every open job for somebody."""
        return common_roles(work) + all_jobs(work)

    def negotiator(self, me: str, group: Group) -> None:
        """Nothing is left to divide during the mission."""
        return


STRATEGY = Remoras()
