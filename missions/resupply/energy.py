"""Energy that is passed on: batteries of drills and stores of chargers, and what both measure.

How much there really is stands in the run's ``Energies``: what happens between vehicles changes them
(``missions.resupply.passing``), drills and chargers read them. A reading is that of the tick before.

The battery of a drill moves no vehicle: how far a vehicle gets is the affair of its own battery, as in every mission.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import Field

from remoras.database import VehicleData
from remoras.recorder import Row
from remoras.sensor import Fact, Observation, Pose, Sensor, SensorSettings
from remoras.work import Point

DRILL_CHARGE, STORE_CHARGE = "drillCharge", "storeCharge"
"""Attributes of a vehicle: how much of the battery of its drill, or of the store of its charger, is left."""
DRILL_STATE, CHARGER_STATE = "drillState", "chargerState"
"""Attributes of a vehicle: what its drill, or its charger, does."""
BORES, BORED_SHARE = "bores", "boredShare"
"""Attributes: of a vehicle, the hole at which its drill is; of a hole, how far it is bored."""
IDLE, BORING, HALTED, CHARGING, GIVING, FULL = "idle", "bores", "halted", "charges", "gives", "full"
"""What a drill does: nothing, bore, wait for energy, take some in; a charger: nothing, give, find the battery full."""
CAME, BROUGHT, BORED = "came", "brought", "bored"
"""What befalls a hole, beside that its drill has no energy (``HALTED``), see ``missions.resupply.truth.ENERGY``."""
LEAST_SHARE = 0.1
"""With less than this in the battery a drill that had none is not set to work."""
STEPS = 10
"""A reading is told whenever it has come to another of so many steps, and at both ends."""


@dataclass
class Drill:
    """How a drill really is.

    Attributes:
        left_j: energy in its battery; state: what it does; hole: at which it is, empty for none.
    """

    left_j: float
    state: str = IDLE
    hole: str = ""


@dataclass
class Charger:
    """How a charger really is.

    Attributes:
        left_j: energy in its store; state: what it does.
    """

    left_j: float
    state: str = IDLE


@dataclass
class Energies:
    """All energy of a run, how far holes are bored, and what has befallen them.

    Attributes:
        drills, chargers: by vehicle and name of the sensor; those that have not been used yet are missing.
        bored: share of each hole that is bored, 0..1.
        events: what truth writes down, in order: rows of ``missions.resupply.truth.ENERGY``.
        passing: by vehicle that gives and hole, the energy that has passed, and when some did last.
    """

    drills: dict[tuple[str, str], Drill] = field(default_factory=dict)
    chargers: dict[tuple[str, str], Charger] = field(default_factory=dict)
    bored: dict[str, float] = field(default_factory=dict)
    events: list[Row] = field(default_factory=list)
    passing: dict[tuple[str, str], tuple[float, float]] = field(default_factory=dict)

    def note_passed(self, key: tuple[str, str], energy_j: float, now_s: float) -> None:
        """So much energy has passed from a vehicle, at a hole, until now."""
        if key not in self.passing:
            self.events.append((now_s, *key, CAME, 0.0))
        self.passing[key] = self.passing.get(key, (0.0, now_s))[0] + energy_j, now_s

    def note_left(self, key: tuple[str, str], now_s: float) -> None:
        """Nothing passes from that vehicle there any more."""
        energy_j, _ = self.passing.pop(key)
        self.events.append((now_s, *key, BROUGHT, energy_j))


class EquipmentSettings(SensorSettings):
    """What a drill and a charger have in common: they say whether they work, and what they have left."""

    @property
    def tells_state(self) -> bool:
        """The vehicle can ask it."""
        return True

    def make(self, data: VehicleData) -> Sensor:
        """The equipment of a vehicle."""
        return Gauge(self, data.name)

    @abstractmethod
    def reading(self, vehicle: str, energies: Energies) -> list[Fact]:
        """What that of a vehicle shows."""


class DrillSettings(EquipmentSettings):
    """The table ``[[vehicle.sensor]]`` of a drill with a battery of its own."""

    EQUIPMENT: ClassVar[str] = "Manipulator"

    battery_j: float = Field(90e3, gt=0.0, description="energy in its battery when that is full, as it is at the start")
    power_w: float = Field(300.0, gt=0.0, description="power that it takes from its battery while it bores")

    def of(self, vehicle: str, energies: Energies) -> Drill:
        """How that of a vehicle really is."""
        return energies.drills.get((vehicle, self.name)) or Drill(self.battery_j)

    def reading(self, vehicle: str, energies: Energies) -> list[Fact]:
        """What it does, what its battery has left, at which hole it is, and how far that is bored."""
        drill = self.of(vehicle, energies)
        read: list[Fact] = [(vehicle, DRILL_STATE, drill.state), (vehicle, DRILL_CHARGE, drill.left_j / self.battery_j)]
        if drill.hole:
            read += [(vehicle, BORES, drill.hole), (drill.hole, BORED_SHARE, energies.bored[drill.hole])]
        return read


class ChargerSettings(EquipmentSettings):
    """The table ``[[vehicle.sensor]]`` of a charger: a store of energy for the drills of others."""

    EQUIPMENT: ClassVar[str] = "Equipment"

    store_j: float = Field(300e3, ge=0.0, description="energy in its store at the start")

    def of(self, vehicle: str, energies: Energies) -> Charger:
        """How that of a vehicle really is."""
        return energies.chargers.get((vehicle, self.name)) or Charger(self.store_j)

    def reading(self, vehicle: str, energies: Energies) -> list[Fact]:
        """What it does, and what its store has left."""
        charger = self.of(vehicle, energies)
        left = charger.left_j / self.store_j if self.store_j > 0.0 else 0.0
        return [(vehicle, CHARGER_STATE, charger.state), (vehicle, STORE_CHARGE, left)]


class Gauge:
    """The sensor of a drill or a charger: it tells what has changed of its reading, and shares in steps.

    Args:
        settings: of the equipment; vehicle: that has it.
    """

    table = None

    def __init__(self, settings: EquipmentSettings, vehicle: str) -> None:
        self._settings, self._vehicle = settings, vehicle
        self._told: dict[tuple[str, str], object] = {}

    def sense(self, pose: Pose, world: Energies, now_s: float) -> list[Observation]:
        """One observation of the facts that are not as they were told."""
        facts = []
        for fact in self._settings.reading(self._vehicle, world):
            of, value = fact[:2], fact[2]
            step = _step(value) if isinstance(value, float) else value
            if self._told.get(of) != step:
                self._told[of] = step
                facts.append(fact)
        return [Observation(tuple(facts))] if facts else []


def _step(share: float) -> int:
    return 0 if share <= 0.0 else STEPS + 1 if share >= 1.0 else 1 + math.floor(STEPS * share)


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
