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

from remoras.strategies.dispatch import NEXT_JOBS, QUEUE
from remoras.strategies.factors import Announces, CommonPlan
from remoras.strategies.head_led import HeadLed


@dataclass(frozen=True, slots=True)
class Central(HeadLed):
    """A leader that assigns and is told; see the module's text."""

    queue: Annotated[int, QUEUE] = NEXT_JOBS
    common_plan: CommonPlan = "missions"
    announces: Announces = "next-jobs"

    name: ClassVar[str] = "central"
    source: ClassVar[str] = "leader-follower assignment, as in most fleets today"


STRATEGY = Central()
