"""``slow``: the speeds of a vehicle are reduced by a factor."""

from __future__ import annotations

from pydantic import Field

from missions.scenarios.faults import DeclaredFault
from remoras.condition import Condition
from remoras.database import VehicleData

USUAL = 0.5


class Slow(DeclaredFault):
    """One ``[[fault]]`` of kind ``slow``."""

    NUMBER = 3
    TEXT = "its speeds are multiplied by factor"

    factor: float | None = Field(None, gt=0.0, lt=1.0, description=f"remaining share of its speeds, {USUAL} if absent")

    @property
    def speed_left(self) -> float:
        """Speed factor."""
        return USUAL if self.factor is None else self.factor

    def leaves(self, data: VehicleData) -> Condition:
        return Condition(speed_factor=self.speed_left)

    def detail(self, data: VehicleData, how_long: str) -> str:
        return f"by the factor {self.speed_left:g}, {how_long}"


KIND = Slow
