"""Central assignment: the head gives members their next jobs, as they finish.

A member holds at most ``queue`` jobs: the first of the plan that the head makes of all open ones, anew whenever
something has changed. A job that a member has not begun goes to another one if the whole then ends earlier by
``margin``. Assignments and results are facts: they are acknowledged, and repeated until they are. A job that a member
has not acknowledged for ``acknowledge_rounds`` goes to another one. If the head falls silent, members finish what they
hold and wait for another head.

Source: leader-follower assignment, as in most fleets today. Plan and margin are ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from remoras.organisation import Group
from remoras.strategies.dispatch import ACKNOWLEDGE, HELP, MARGIN, QUEUE, Dispatcher, Dispatching
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration


@dataclass(frozen=True, slots=True)
class Central:
    """A leader that assigns and is told; see the module's text."""

    queue: Annotated[int, QUEUE] = 2
    margin: Annotated[float, MARGIN] = 0.05
    help_s: Annotated[float, HELP] = 60.0
    acknowledge_rounds: Annotated[int, ACKNOWLEDGE] = 400

    name: ClassVar[str] = "central"
    declaration: ClassVar[Declaration] = Declaration(
        source="leader-follower assignment, as in most fleets today",
        messages={
            "playsRole": "the head gives a member a job",
            "leftRole": "the head takes a job back",
            JOB_DONE: "a vehicle has done a job",
        },
    )
    form = staticmethod(founded)
    adapt = staticmethod(common_roles)

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        """The head's part, for each member."""
        return Dispatcher(me, group, Dispatching(self.queue, self.margin, self.help_s, self.acknowledge_rounds))


STRATEGY = Central()
