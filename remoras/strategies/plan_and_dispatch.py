"""Plan before the dive, dispatch at sea.

Before the dive every member gets the jobs that ``fixed-partition`` would give it. At sea the head moves a job that
nobody has begun where the whole then ends earlier by ``margin``, where its holder is absent or takes no jobs, and where
it has not been acknowledged for ``acknowledge_rounds``. As long as all goes as planned, nobody says a word about who
does what; without the head, the plan stands.

Source: ours, of two usual parts: a plan agreed before the dive, and leader-follower assignment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from remoras.organisation import Group, RoleAssignment
from remoras.strategies.allocation import all_jobs
from remoras.strategies.dispatch import ACKNOWLEDGE, ALL, HELP, MARGIN, Dispatcher, Dispatching
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration
from remoras.work import Work


@dataclass(frozen=True, slots=True)
class PlanAndDispatch:
    """A plan, and a leader that mends it; see the module's text."""

    margin: Annotated[float, MARGIN] = 0.05
    help_s: Annotated[float, HELP] = 60.0
    acknowledge_rounds: Annotated[int, ACKNOWLEDGE] = 400

    name: ClassVar[str] = "plan-and-dispatch"
    declaration: ClassVar[Declaration] = Declaration(
        source="a plan agreed before the dive, mended by leader-follower assignment",
        messages={
            "playsRole": "the head gives a member a job that was another's, or that nobody had",
            "leftRole": "the head takes a job back",
            JOB_DONE: "a vehicle has done a job",
        },
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Common roles for all, and every open job for somebody."""
        return common_roles(work) + all_jobs(work, self.help_s)

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        """The head's part, for each member."""
        return Dispatcher(me, group, Dispatching(ALL, self.margin, self.help_s, self.acknowledge_rounds))


STRATEGY = PlanAndDispatch()
