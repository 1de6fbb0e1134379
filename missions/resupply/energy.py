"""Energy that is passed on: batteries of drills, stores of chargers, and what a vehicle knows is left in its own.

The battery of a drill moves no vehicle: how far a vehicle gets is the affair of its own battery, as in every mission.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from remoras.database import VehicleData
from remoras.known import Known
from remoras.picture import Picture
from remoras.sensor import Observation, Pose, Sensor, SensorSettings
from remoras.work import Point

DRILL_CHARGE, STORE_CHARGE = "drillCharge", "storeCharge"
"""Attributes of a vehicle: how much of the battery of its drill, or of the store of its charger, is left."""
SAID_SHARE = 0.1
"""A vehicle notes what is left whenever it has changed by so much of all."""
LEAST_SHARE = 0.1
"""With less than this in the battery a drill is not set to work."""
FULL_UNTIL_S = 300.0
"""A vehicle that knows nothing of its own energy takes it for all there; later, having lost its memory, for none."""


class EquipmentSettings(SensorSettings):
    """What a drill and a charger have in common: they observe nothing, and say whether they work."""

    @property
    def tells_state(self) -> bool:
        """The vehicle can ask it."""
        return True

    def make(self, data: VehicleData) -> Sensor:
        """The equipment of a vehicle."""
        return Equipment()


class Equipment:
    """What a vehicle has on board to work with; it observes nothing."""

    table = None

    def sense(self, pose: Pose, world: object, now_s: float) -> list[Observation]:
        """Nothing."""
        return []


class DrillSettings(EquipmentSettings):
    """The table ``[[vehicle.sensor]]`` of a drill with a battery of its own."""

    EQUIPMENT: ClassVar[str] = "Manipulator"

    battery_j: float = Field(90e3, gt=0.0, description="energy in its battery when that is full, as it is at the start")
    power_w: float = Field(300.0, gt=0.0, description="power that it takes from its battery while it bores")


class ChargerSettings(EquipmentSettings):
    """The table ``[[vehicle.sensor]]`` of a charger: a store of energy for the drills of others."""

    EQUIPMENT: ClassVar[str] = "Equipment"

    store_j: float = Field(300e3, ge=0.0, description="energy in its store at the start")


@dataclass(frozen=True)
class Transfer:
    """How energy passes from a store to a battery while their vehicles lie beside each other.

    Attributes:
        power_w: that leaves the store; efficiency: share of it that comes into the battery, 0..1.
        berth_m: how far beside a hole the vehicle with the charger lies.
    """

    power_w: float
    efficiency: float
    berth_m: float

    def berth(self, place_m: Point) -> Point:
        """Where the vehicle with the charger lies, if the one with the drill is at that place.

        >>> Transfer(500.0, 0.7, 10.0).berth((100.0, 50.0))
        (110.0, 50.0)
        """
        return place_m[0] + self.berth_m, place_m[1]

    def passes_j(self, dt_s: float, left_j: float, lacks_j: float) -> float:
        """Energy that comes into a battery in a time: no more than is left in the store, nor than the battery lacks.

        >>> Transfer(500.0, 0.7, 10.0).passes_j(10.0, 3000.0, 9000.0)
        2100.0
        """
        return min(self.efficiency * min(self.power_w * dt_s, left_j), lacks_j)


class Gauge:
    """What a vehicle knows is left of its energy of one kind: it notes that as a fact, and goes on from there.

    Args:
        vehicle: its name; attribute: of the vocabulary; full_j: all of it.
    """

    def __init__(self, vehicle: str, attribute: str, full_j: float) -> None:
        self._vehicle, self._attribute, self.full_j = vehicle, attribute, full_j
        self._left_j: float | None = None  # of whoever uses it, until it lets go of it
        self._noted_j = full_j

    def left_j(self, facts: Known) -> float:
        """Energy that is left; none if nothing was noted."""
        if self._left_j is None:
            self._noted_j = facts.get((self._attribute, self._vehicle), 0.0) * self.full_j
            return self._noted_j
        return self._left_j

    def begun(self, facts: Known, now_s: float) -> tuple[Observation, ...]:
        """What a vehicle takes for granted that has noted nothing yet; nothing once it has."""
        if facts.get((self._attribute, self._vehicle)) is not None:
            return ()
        return (Observation(((self._vehicle, self._attribute, 1.0 if now_s <= FULL_UNTIL_S else 0.0),)),)

    def change(self, by_j: float, facts: Known) -> None:
        """So much comes in, or is taken out if it is negative; it is never less than empty, nor more than full."""
        self._left_j = max(0.0, min(self.full_j, self.left_j(facts) + by_j))

    def noted(self, at_once: bool = False) -> tuple[Observation, ...]:
        """What is left as a fact to be noted: if it has changed by a share, or else only if ``at_once``."""
        left_j = self._left_j
        if left_j is None or left_j == self._noted_j:
            return ()
        if not at_once and abs(left_j - self._noted_j) < SAID_SHARE * self.full_j and 0.0 < left_j < self.full_j:
            return ()
        self._noted_j = left_j
        return (Observation(((self._vehicle, self._attribute, left_j / self.full_j),)),)

    def let_go(self) -> tuple[Observation, ...]:
        """The same at once; whoever uses it next goes on from what is noted."""
        noted = self.noted(at_once=True)
        self._left_j = None
        return noted


def is_at(place_m: Point, within_m: float, picture: Picture) -> bool:
    """True if the obstacle sonar sees a vehicle so near to a place."""
    return any(distance(place_m, contact_m) <= within_m for contact_m in picture.body.contacts_m)
