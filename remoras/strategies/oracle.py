"""Oracle: instant shared knowledge and true speeds, as an upper bound.

The leader replans on every change by the shared allocator; vehicles that wait for others recruit them by auction. A
strategy's gap to it is the loss by missing knowledge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.fleet.instant_sharing import InstantSharing
from remoras.strategies.factors import helped_by
from remoras.strategies.plan_and_dispatch import PlanAndDispatch
from remoras.strategy import Declaration

LEADER = PlanAndDispatch(margin=0.0, join_s=10.0, acknowledge_rounds=1_000_000, help="auction")


@dataclass(frozen=True, slots=True)
class Oracle:
    """Perfect and instant knowledge; see the module docstring."""

    name: ClassVar[str] = "oracle"
    declaration: ClassVar[Declaration] = helped_by(
        LEADER.help,
        Declaration(
            "a bound: no vehicle can know more, or know it earlier", {}, communicates=False, sharing=InstantSharing
        ),
    )
    form = staticmethod(LEADER.form)
    adapt = staticmethod(LEADER.adapt)
    negotiator = staticmethod(LEADER.negotiator)


STRATEGY = Oracle()
