"""``deaf``: receiver failure; all other functions of the vehicle continue."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.scenarios.faults import DeclaredFault
from remoras.condition import Condition

if TYPE_CHECKING:
    from remoras.database import VehicleData


class Deaf(DeclaredFault):
    """One ``[[fault]]`` of kind ``deaf``."""

    NUMBER = 2
    TEXT = "it receives nothing"
    DISABLES = True

    def leaves(self, data: VehicleData) -> Condition:
        """Condition without reception."""
        return Condition(is_deaf=True)


KIND = Deaf
