"""``drains``: a vehicle loses power in addition to its consumption."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import Field

from missions.scenarios.faults import DeclaredFault
from remoras.condition import Condition
from remoras.database import VehicleData
from remoras.table import Positive


class Drains(DeclaredFault):
    """One ``[[fault]]`` of kind ``drains``."""

    NUMBER = 8
    TEXT = "it loses drain_w in addition to its consumption"
    REQUIRED: ClassVar[Mapping[str, str]] = {"drain_w": "missing: the power that the vehicle loses, above 0 W"}

    drain_w: Positive | None = Field(None, description="lost power, W")

    def detail(self, data: VehicleData, how_long: str) -> str:
        return f"{self.drain_w:g} W, {how_long}"

    def leaves(self, data: VehicleData) -> Condition:
        return Condition(drain_w=self.drain_w or 0.0)


KIND = Drains
