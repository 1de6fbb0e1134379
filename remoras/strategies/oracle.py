"""Oracle: instant shared knowledge and true speeds, as an upper bound.

The leader replans on every change by the shared allocator. A strategy's gap to it is the loss by missing knowledge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.fleet.instant_sharing import InstantSharing
from remoras.organisation import Group, RoleAssignment
from remoras.strategies.initial_roles import founded
from remoras.strategies.plan_and_dispatch import PlanAndDispatch
from remoras.strategy import Declaration, Negotiator
from remoras.work import Work

LEADER = PlanAndDispatch(margin=0.0, join_s=10.0, acknowledge_rounds=1_000_000)


@dataclass(frozen=True, slots=True)
class Oracle:
    """Perfect and instant knowledge; see the module docstring."""

    name: ClassVar[str] = "oracle"
    declaration: ClassVar[Declaration] = Declaration(
        "a bound: no vehicle can know more, or know it earlier", {}, communicates=False, sharing=InstantSharing
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Assign common roles to all members and every open job to one of them."""
        return LEADER.adapt(work)

    def negotiator(self, me: str, group: Group) -> Negotiator:
        """Return the dispatcher of one member."""
        return LEADER.negotiator(me, group)


STRATEGY = Oracle()
