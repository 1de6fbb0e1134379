"""``deaf``: receiver failure; all other functions of the vehicle continue."""

from __future__ import annotations

from missions.scenarios.faults import DeclaredFault
from remoras.condition import Condition


class Deaf(DeclaredFault):
    """One ``[[fault]]`` of kind ``deaf``."""

    NUMBER = 2
    CONDITION = Condition(is_deaf=True)
    TEXT = "it receives nothing"
    DISABLES = True


KIND = Deaf
