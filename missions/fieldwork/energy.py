"""Energy that is passed on: batteries of drills and stores of chargers, and what both measure.

How much there really is stands in the run's ``Energies``: ``Passing`` changes them, drills and chargers read them. A
reading is that of the tick before. What passes does so whether truth looks or not, and whatever vehicles believe. A
drill works while its vehicle is at a hole of its kind with the drill on. One that has no energy left halts; it goes on
once its battery is full, or nothing comes in any more and a tenth is there. Energy comes in from whoever lies at the
berth beside the hole with its charger on.

The battery of a drill moves no vehicle: how far a vehicle gets is the affair of its own battery, as in every mission.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from missions.fieldwork.sites import SiteSurvey
from missions.meeting.staying import THERE_M
from remoras.database import VehicleData
from remoras.mission import FleetView, VehicleView
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
"""What befalls a hole, beside that its drill has no energy (``HALTED``), see ``missions.fieldwork.truth.ENERGY``."""
LEAST_SHARE = 0.1
"""With less than this in the battery a drill that had none is not set to work."""
STEPS = 10
"""A reading is told whenever it has come to another of so many steps, and at both ends."""
GAP_S = 20.0
"""Who passes energy on again within this time has not left meanwhile."""
ALL = 1.0 - 1e-9
"""A hole is bored once so much of it is: the rest is rounding."""


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
        events: what truth writes down, in order: rows of ``missions.fieldwork.truth.ENERGY``.
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


@dataclass(frozen=True)
class Boring(SiteSurvey):
    """A hole: a ``remoras.work.Job`` for whoever has the drill.

    Attributes:
        name: of the hole; place_m: where it is; stay_s: how long it takes to bore it.
        drill: name of the sensor that bores it.
        n_helpers: how many it takes beside whoever has it.
        is_starved: nobody is able to any more, since no energy is left for it.
    """

    n_helpers: ClassVar[int] = 1

    drill: str
    is_starved: bool = False

    def is_able(self, data: VehicleData) -> bool:
        """True for a vehicle with the drill."""
        return not self.is_starved and self.drill_of(data) is not None

    def drill_of(self, data: VehicleData) -> DrillSettings | None:
        """The drill of a vehicle that bores such holes; None without one."""
        drills = (one for one in data.sensors if isinstance(one, DrillSettings) and one.name == self.drill)
        return next(drills, None)


class Passing:
    """Changes the energies of a run as time goes on.

    Args:
        borings: by name; transfer: how energy passes over; energies: of the run.
    """

    def __init__(self, borings: Mapping[str, Boring], transfer: Transfer, energies: Energies) -> None:
        self._borings, self._transfer, self._energies = borings, transfer, energies
        self._halted: set[tuple[str, str]] = set()  # vehicle and hole
        self._last_s = 0.0

    def go_on(self, fleet: FleetView, now_s: float) -> None:
        """Let pass and work what does, for the time since this was called last."""
        dt_s, self._last_s = now_s - self._last_s, now_s
        if dt_s <= 0.0:
            return
        for charger in self._energies.chargers.values():
            charger.state = IDLE
        for vehicle in fleet.vehicles:
            for settings in vehicle.data.sensors:
                if isinstance(settings, DrillSettings):
                    self._let_work(fleet, vehicle, settings, dt_s, now_s)
        for key, (_, last_s) in list(self._energies.passing.items()):
            if now_s - last_s > GAP_S:
                self._energies.note_left(key, now_s)

    def _let_work(
        self, fleet: FleetView, vehicle: VehicleView, settings: DrillSettings, dt_s: float, now_s: float
    ) -> None:
        drills, key = self._energies.drills, (vehicle.name, settings.name)
        hole = self._hole(vehicle, settings)
        if hole is None:
            if key in drills:
                drills[key].state, drills[key].hole = IDLE, ""
            return
        drill = drills.setdefault(key, Drill(settings.battery_j))
        drill.hole = hole.name
        self._energies.bored.setdefault(hole.name, 0.0)
        comes = self._come_in(fleet, hole, settings.battery_j, drill, dt_s, now_s)
        waits = vehicle.name, hole.name
        if waits in self._halted and not comes and drill.left_j >= LEAST_SHARE * settings.battery_j:
            self._halted.discard(waits)
        if waits in self._halted:
            drill.state = CHARGING if comes else HALTED
        else:
            self._bore(vehicle.name, hole, settings.power_w, drill, dt_s, now_s)

    def _hole(self, vehicle: VehicleView, settings: DrillSettings) -> Boring | None:
        """The nearest hole at which the vehicle is with its drill on."""
        if settings.name not in vehicle.sensing or not vehicle.is_alive:
            return None
        at_m = vehicle.position_m
        there = [hole for hole in self._borings.values() if hole.drill == settings.name and _is_at(at_m, hole.place_m)]
        return min(there, key=lambda hole: distance(at_m, hole.place_m), default=None)

    def _bore(self, vehicle: str, hole: Boring, power_w: float, drill: Drill, dt_s: float, now_s: float) -> None:
        energies, whole_j = self._energies, power_w * hole.stay_s
        left = 1.0 - energies.bored[hole.name]
        if left <= 0.0:
            drill.state = IDLE
            return
        used_j = min(power_w * dt_s, drill.left_j, whole_j * left)
        drill.left_j -= used_j
        drill.state = BORING
        energies.bored[hole.name] += used_j / whole_j
        if energies.bored[hole.name] >= ALL:
            energies.bored[hole.name] = 1.0
            energies.events.append((now_s, vehicle, hole.name, BORED, 0.0))
        elif drill.left_j <= 0.0:
            self._halted.add((vehicle, hole.name))
            drill.state = HALTED
            energies.events.append((now_s, vehicle, hole.name, HALTED, 0.0))

    def _come_in(self, fleet: FleetView, hole: Boring, full_j: float, drill: Drill, dt_s: float, now_s: float) -> bool:
        """Energy from whoever lies at the berth with its charger on; True if there is some."""
        berth_m, comes, energies = self._transfer.berth(hole.place_m), False, self._energies
        for other in fleet.vehicles:
            settings = _charger(other)
            if settings is None or settings.name not in other.sensing or not other.is_alive:
                continue
            if not _is_at(other.position_m, berth_m):
                continue
            charger = energies.chargers.setdefault((other.name, settings.name), Charger(settings.store_j))
            lacks_j = full_j - drill.left_j
            passes_j = self._transfer.passes_j(dt_s, charger.left_j, lacks_j)
            charger.state = GIVING if passes_j > 0.0 else FULL if lacks_j <= 0.0 else IDLE
            if passes_j > 0.0:
                comes = True
                charger.left_j = max(0.0, charger.left_j - passes_j / self._transfer.efficiency)
                drill.left_j = min(full_j, drill.left_j + passes_j)
                energies.note_passed((other.name, hole.name), passes_j, now_s)
        return comes


def _charger(vehicle: VehicleView) -> ChargerSettings | None:
    return vehicle.data.sensor(ChargerSettings)


def _is_at(at_m: Point, place_m: Point) -> bool:
    return distance(at_m, place_m) <= THERE_M
