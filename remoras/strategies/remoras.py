"""REMORAS strategy: jobs allocated by the group leader, then satisfaction and altruism.

The leader allocates all open jobs at mission planning, and again after a departure or a finished prerequisite. The
influence signal of an idle member that is able to work requests work. Then the leader, as optimiser of organisational
performances, assigns vacant jobs, moves unbegun ones if the makespan falls by ``margin``, or sends the member to help.

Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV and VII: optimiser, roles, signals; Simonin, Ferber 2000:
requests and answers. The optimiser's algorithm is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.factors import CommonPlan, Help, Repairs
from remoras.strategies.head_led import TOLD, HeadLed
from remoras.strategy import Declaration


@dataclass(frozen=True, slots=True)
class Remoras(HeadLed):
    """Roles allocated by the leader of each group; see the module docstring."""

    common_plan: CommonPlan = "none"
    repairs: Repairs = "calls"
    help: Help = "calls"

    name: ClassVar[str] = "remoras"
    planned: ClassVar[Declaration] = Declaration("Carlesi, Michel, Jouvencel, Ferber 2011", TOLD)


STRATEGY = Remoras()
