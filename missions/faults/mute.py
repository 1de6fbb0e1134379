"""``mute``: transmitter failure; all other functions of the vehicle continue."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.scenarios.faults import DeclaredFault
from remoras.condition import Condition

if TYPE_CHECKING:
    from remoras.database import VehicleData


class Mute(DeclaredFault):
    """One ``[[fault]]`` of kind ``mute``."""

    NUMBER = 1
    TEXT = "its transmissions reach no peer"
    DISABLES = True

    def leaves(self, data: VehicleData) -> Condition:
        """Condition without transmission."""
        return Condition(is_mute=True)


KIND = Mute
