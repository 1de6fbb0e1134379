"""Oracle: instant shared knowledge and true speeds, as an upper bound.

An observation enters every world model at once. The leader plans with the true speeds and replans on every change by
the shared allocator. A strategy's gap to the oracle is its loss by missing knowledge.
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
    """Perfect and instant knowledge; see the module docstring."""

    name: ClassVar[str] = "oracle"
    declaration: ClassVar[Declaration] = Declaration(
        "a bound: nobody can know more, or know it earlier", {}, communicates=False, sharing=InstantSharing
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Assign common roles to all members and every open job to one of them."""
        return common_roles(work) + all_jobs(work, HELP_S)

    def negotiator(self, me: str, group: Group) -> Dispatcher:
        """Return the dispatcher of one member."""
        return Dispatcher(me, group, Dispatching(ALL, MARGIN, HELP_S, NEVER))


STRATEGY = Oracle()
