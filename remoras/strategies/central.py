"""Central assignment: the group leader assigns members their next jobs as they finish.

A member holds at most ``queue`` jobs, the first ones of the leader's plan, which is revised on every change. A job not
yet begun moves if the makespan then falls by ``margin``. Assignments and results are acknowledged facts; a job not
acknowledged for ``acknowledge_rounds`` goes to another member. If the leader falls silent, members finish their jobs
and wait for a new leader. Source: leader-follower assignment, as in most fleets today; plan and margin are ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from remoras.strategies.factors import Announces, CommonPlan
from remoras.strategies.head_led import NEXT_JOBS, TOLD, HeadLed
from remoras.strategies.negotiator import QUEUE
from remoras.strategy import Declaration


@dataclass(frozen=True, slots=True)
class Central(HeadLed):
    """Central assignment by the group leader; see the module docstring."""

    queue: Annotated[int, QUEUE] = NEXT_JOBS
    common_plan: CommonPlan = "missions"
    announces: Announces = "next-jobs"

    name: ClassVar[str] = "central"
    planned: ClassVar[Declaration] = Declaration("leader-follower assignment, as in most fleets today", TOLD)


STRATEGY = Central()
