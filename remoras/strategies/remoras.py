"""The REMORAS strategy: jobs allocated by the head of the group, then satisfaction and altruism.

The head allocates all open jobs when it plans the mission, and again when a member leaves or a job is done that others
need. What the vehicles make of it is moved by the influence signals that each sends for every role it plays. A member
that is able to work and has none is dissatisfied, and its signals call for work: then the head, as the optimiser of
organisational performances, allocates what is vacant, moves jobs that nobody has begun where the whole ends earlier by
``margin``, or else lets the member help at another's job.

Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV and VII: the optimiser, roles, signals; Simonin, Ferber
2000: calls and answers. What the optimiser computes is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from remoras.organisation import Group, RoleAssignment
from remoras.strategies.allocation import all_jobs
from remoras.strategies.dispatch import ACKNOWLEDGE, ALL, HELP, MARGIN, Dispatcher, Dispatching
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import INFLUENCE_SIGNAL, JOB_DONE, OBJECTIVE, Declaration
from remoras.work import Work

MESSAGES = {
    "hasMission": "a head gives another group its mission",
    "playsRole": "a head gives a member a role",
    OBJECTIVE: "a head gives a role an objective",
    "leftRole": "a vehicle leaves a role, or its head takes it back",
    JOB_DONE: "a vehicle has done a job",
    INFLUENCE_SIGNAL: "one signed byte for every role that the sender plays, in every slot",
}
SOURCE = "Carlesi, Michel, Jouvencel, Ferber 2011"


@dataclass(frozen=True, slots=True)
class Remoras:
    """Roles allocated by the head of each group; see the module's text."""

    margin: Annotated[float, MARGIN] = 0.05
    help_s: Annotated[float, HELP] = 60.0
    acknowledge_rounds: Annotated[int, ACKNOWLEDGE] = 400

    name: ClassVar[str] = "remoras"
    declaration: ClassVar[Declaration] = Declaration(
        source=SOURCE, messages=MESSAGES, planned_before=False, influences=True
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Every open job for somebody, and common roles for those who work: at sea each role takes time to tell.

        Others get them with a job, or all before the dive.
        """
        given = all_jobs(work, self.help_s)
        if self.declaration.planned_before or not work.roles:
            return common_roles(work) + given
        return given + common_roles(work, {assignment.vehicle for assignment in given})

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        """The optimiser of the head, for each member."""
        return Dispatcher(
            me,
            group,
            Dispatching(ALL, self.margin, self.help_s, self.acknowledge_rounds, on_call=True, keeps_group=False),
        )


STRATEGY = Remoras()
