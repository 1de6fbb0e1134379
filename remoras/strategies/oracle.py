"""The oracle: every vehicle knows at once what any vehicle knows, and how fast each really is.

Nobody sends a packet: what a vehicle finds out is in every world model in the same instant. The head plans before the
dive with the real speeds, and anew whenever something has changed, by the allocator that all strategies share. What a
strategy lacks to the oracle is what it loses by not knowing; what the oracle lacks to a better plan, all lack.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.bound import InstantSharing
from remoras.organisation import Group, RoleAssignment
from remoras.strategies.allocation import all_jobs
from remoras.strategies.dispatch import Dispatcher, Dispatching
from remoras.strategies.factors import ALL
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import Declaration
from remoras.work import Work

MARGIN, HELP_S = 0.0, 10.0
NEVER = 1_000_000


@dataclass(frozen=True, slots=True)
class Oracle:
    """Perfect knowledge at once; see the module's text."""

    name: ClassVar[str] = "oracle"
    declaration: ClassVar[Declaration] = Declaration(
        "a bound: nobody can know more, or know it earlier", {}, communicates=False, sharing=InstantSharing
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Common roles for all, and every open job for somebody."""
        return common_roles(work) + all_jobs(work, HELP_S)

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        """The head's part, for each member."""
        return Dispatcher(me, group, Dispatching(ALL, MARGIN, HELP_S, NEVER))


STRATEGY = Oracle()
