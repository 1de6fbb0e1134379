"""The REMORAS strategy: jobs allocated by the head of the group, then satisfaction and altruism.

The head allocates all open jobs when it plans the mission, and again when a member leaves or a job is done that others
need. What the vehicles make of it is moved by the influence signals that each sends for every role it plays. A member
that is able to work and has none is dissatisfied, and its signals call for work: then the head, as the optimiser of
organisational performances, allocates what is vacant, moves jobs that nobody has begun where the whole ends earlier by
``margin``, or else lets the member help at another's job.

Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV and VII: the optimiser, roles, signals; Simonin, Ferber
2000: calls and answers. What the optimiser computes is ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.factors import CommonPlan, Repairs
from remoras.strategies.head_led import HeadLed


@dataclass(frozen=True, slots=True)
class Remoras(HeadLed):
    """Roles allocated by the head of each group; see the module's text."""

    common_plan: CommonPlan = "none"
    repairs: Repairs = "calls"

    name: ClassVar[str] = "remoras"
    source: ClassVar[str] = "Carlesi, Michel, Jouvencel, Ferber 2011"


STRATEGY = Remoras()
