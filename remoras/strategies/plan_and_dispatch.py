"""Plan before the dive, repair by the leader at run time.

The leader moves an unbegun job if the makespan then falls by ``margin``, if its holder is absent or takes no jobs, or
after ``acknowledge_rounds`` without acknowledgement. Without deviations no assignment is sent; without a leader the
plan stands. Source: ours, of two usual parts: a plan agreed before the dive, and leader-follower assignment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.head_led import TOLD, HeadLed
from remoras.strategy import Declaration


@dataclass(frozen=True, slots=True)
class PlanAndDispatch(HeadLed):
    """Initial plan, repaired by the leader; see the module docstring."""

    name: ClassVar[str] = "plan-and-dispatch"
    planned: ClassVar[Declaration] = Declaration(
        "a plan agreed before the dive, mended by leader-follower assignment", TOLD
    )


STRATEGY = PlanAndDispatch()
