"""``mute``: transmitter failure; all other functions of the vehicle continue."""

from __future__ import annotations

from missions.scenarios.faults import DeclaredFault
from remoras.condition import Condition


class Mute(DeclaredFault):
    """One ``[[fault]]`` of kind ``mute``."""

    NUMBER = 1
    CONDITION = Condition(is_mute=True)
    TEXT = "its transmissions reach no peer"
    DISABLES = True


KIND = Mute
