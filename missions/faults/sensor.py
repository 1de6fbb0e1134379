"""``sensor``: one or all sensors of a vehicle yield nothing, but stay switched on."""

from __future__ import annotations

from missions.scenarios.faults import FaultOfSensors
from remoras.condition import Condition
from remoras.database import VehicleData


class DeadSensor(FaultOfSensors):
    """One ``[[fault]]`` of kind ``sensor``."""

    NUMBER = 4
    TEXT = "its sensor observes nothing"
    DISABLES = True

    def leaves(self, data: VehicleData) -> Condition:
        return Condition(dead_sensors=frozenset(self.of(data)))

    def detail(self, data: VehicleData, how_long: str) -> str:
        return f"{', '.join(self.of(data))}, {how_long}"


KIND = DeadSensor
