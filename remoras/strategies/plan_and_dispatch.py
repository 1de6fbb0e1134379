"""Plan before the dive, dispatch at sea.

Before the dive every member gets the jobs that ``fixed-partition`` would give it. At sea the head moves a job that
nobody has begun where the whole then ends earlier by ``margin``, where its holder is absent or takes no jobs, and where
it has not been acknowledged for ``acknowledge_rounds``. As long as all goes as planned, nobody says a word about who
does what; without the head, the plan stands.

Source: ours, of two usual parts: a plan agreed before the dive, and leader-follower assignment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.head_led import HeadLed


@dataclass(frozen=True, slots=True)
class PlanAndDispatch(HeadLed):
    """A plan, and a leader that mends it; see the module's text."""

    name: ClassVar[str] = "plan-and-dispatch"
    source: ClassVar[str] = "a plan agreed before the dive, mended by leader-follower assignment"


STRATEGY = PlanAndDispatch()
