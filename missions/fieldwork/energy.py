"""Drilling, and energy transfer to drills: ``Passing`` changes true energies; behaviours read those of a tick ago."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from pydantic import Field

from exchange.arithmetic import distance
from missions.fieldwork.assistance import MUCH_NEARER_M, Help, HelpAwaited
from missions.fieldwork.jobs import SiteSurvey
from missions.meeting.job_mission import DONE_BY, THERE_M, to_stay
from missions.meeting.meeting import NEWS_FRAMES
from remoras.behaviours import (
    ADVANCING,
    DONE,
    FAILED,
    IDLE,
    STANDING,
    Approach,
    Behaviour,
    Perception,
    Reference,
    distance_m,
)
from remoras.beliefs import Known
from remoras.database import VehicleData
from remoras.mission import FleetView, VehicleView
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.recorder import Row
from remoras.sensor import Fact, Observation, Pose, Sensor, SensorSettings
from remoras.table import Positive, Section
from remoras.work import Point, Work

DRILL_CHARGE, STORE_CHARGE = "drillCharge", "storeCharge"
"""Attributes of a vehicle: remaining share of its drill's battery and its charger's store."""
DRILL_STATE, CHARGER_STATE = "drillState", "chargerState"
"""Attributes of a vehicle: state of its drill and of its charger."""
BORES, BORED_SHARE = "bores", "boredShare"  # attributes: site at which a vehicle's drill is; finished share of a site
AT_REST, BORING, HALTED, CHARGING, GIVING, FULL = "idle", "bores", "halted", "charges", "gives", "full"
"""States of a drill: at rest, drilling, empty, charging; a charger: at rest, giving, battery full."""
CAME, BROUGHT, BORED = "came", "brought", "bored"
"""Events at a site besides ``HALTED``, see ``missions.fieldwork.truth.ENERGY``."""
LEAST_SHARE = 0.1  # battery share below which an emptied drill stays halted
STEPS = 10  # readings are reported at changes between this many steps, and at both ends
GAP_S = 20.0  # longest pause within one transfer
ALL = 1.0 - 1e-9  # share at which a hole counts as finished, within rounding


@dataclass
class Store:
    """True state of a drill's battery, or of a charger; ``hole`` is the site of the drill, or empty."""

    left_j: float
    state: str = AT_REST
    hole: str = ""


@dataclass
class Energies:
    """True energies, drilling progress and events of a run.

    ``stores`` are by vehicle and sensor, ``bored`` is the finished share by site, ``passing`` the energy (J) and time
    of the last transfer, by giver and site.
    """

    stores: dict[tuple[str, str], Store] = field(default_factory=dict)
    bored: dict[str, float] = field(default_factory=dict)
    events: list[Row] = field(default_factory=list)
    passing: dict[tuple[str, str], tuple[float, float]] = field(default_factory=dict)

    def note_passed(self, key: tuple[str, str], energy_j: float, now_s: float) -> None:
        """Add energy to the transfer in progress of ``key`` (giver, site); record its start."""
        if key not in self.passing:
            self.events.append((now_s, *key, CAME, 0.0))
        self.passing[key] = self.passing.get(key, (0.0, now_s))[0] + energy_j, now_s

    def note_left(self, key: tuple[str, str], now_s: float) -> None:
        """Record the end of a transfer of ``key`` (giver, site)."""
        energy_j, _ = self.passing.pop(key)
        self.events.append((now_s, *key, BROUGHT, energy_j))


class EquipmentSettings(SensorSettings):
    """Common settings of drills and chargers, which report their state and remaining energy."""

    @property
    def tells_state(self) -> bool:
        return True

    def make(self, data: VehicleData) -> Sensor:
        return Gauge(self, data.name)

    @abstractmethod
    def reading(self, vehicle: str, energies: Energies) -> list[Fact]:
        """Return the facts that a vehicle's equipment shows."""


class DrillSettings(EquipmentSettings):
    """Table ``[[vehicle.sensor]]`` of a drill with its own battery."""

    EQUIPMENT: ClassVar[str] = "Manipulator"

    battery_j: float = Field(90e3, gt=0.0, description="energy of its full battery, as at the start")
    power_w: float = Field(300.0, gt=0.0, description="battery power for drilling")

    def of(self, vehicle: str, energies: Energies) -> Store:
        """True state of a vehicle's drill."""
        # A store is recorded at its first use and is full before.
        return energies.stores.get((vehicle, self.name)) or Store(self.battery_j)

    def reading(self, vehicle: str, energies: Energies) -> list[Fact]:
        drill = self.of(vehicle, energies)
        read: list[Fact] = [(vehicle, DRILL_STATE, drill.state), (vehicle, DRILL_CHARGE, drill.left_j / self.battery_j)]
        if drill.hole:
            read += [(vehicle, BORES, drill.hole), (drill.hole, BORED_SHARE, energies.bored[drill.hole])]
        return read


class ChargerSettings(EquipmentSettings):
    """Table ``[[vehicle.sensor]]`` of a charger: an energy store for the drills of others."""

    EQUIPMENT: ClassVar[str] = "Equipment"

    store_j: float = Field(300e3, ge=0.0, description="energy in its store at the start")

    def of(self, vehicle: str, energies: Energies) -> Store:
        """True state of a vehicle's charger."""
        return energies.stores.get((vehicle, self.name)) or Store(self.store_j)

    def reading(self, vehicle: str, energies: Energies) -> list[Fact]:
        charger = self.of(vehicle, energies)
        left = charger.left_j / self.store_j if self.store_j > 0.0 else 0.0
        return [(vehicle, CHARGER_STATE, charger.state), (vehicle, STORE_CHARGE, left)]


class Gauge:
    """Sensor of a drill or charger: reports changes of its reading, shares in steps."""

    table = None

    def __init__(self, settings: EquipmentSettings, vehicle: str) -> None:
        self._settings, self._vehicle = settings, vehicle
        self._told: dict[tuple[str, str], object] = {}

    def sense(self, pose: Pose, world: Energies, now_s: float) -> list[Observation]:
        """Return one observation of the changed facts."""
        facts = []
        for fact in self._settings.reading(self._vehicle, world):
            key, value = fact[:2], fact[2]
            step = _step(value) if isinstance(value, float) else value
            if self._told.get(key) != step:
                self._told[key] = step
                facts.append(fact)
        return [Observation(tuple(facts))] if facts else []


def _step(share: float) -> int:
    # Empty and full are steps of their own, since decisions depend on exactly these.
    return 0 if share <= 0.0 else STEPS + 1 if share >= 1.0 else 1 + math.floor(STEPS * share)


class TransferTable(Section):
    """Table ``[transfer]``: energy from the store of one vehicle to the drill of another."""

    power_w: Positive = Field(500.0, description="power taken from the store while both vehicles are in place")
    efficiency: float = Field(0.7, gt=0.0, le=1.0, description="share of it that reaches the battery")
    berth_m: Positive = Field(10.0, description="distance of the supplying vehicle east of the drill site")

    def berth(self, place_m: Point) -> Point:
        """Position of the giving vehicle: ``berth_m`` east of the drill site."""
        return place_m[0] + self.berth_m, place_m[1]

    def passes_j(self, dt_s: float, left_j: float, lacks_j: float) -> float:
        """Energy (J) into the battery in ``dt_s``, limited by the store and the battery's deficit.

        >>> TransferTable().passes_j(10.0, 3000.0, 9000.0)
        2100.0
        """
        return min(self.efficiency * min(self.power_w * dt_s, left_j), lacks_j)


class Boring(SiteSurvey):
    """One ``[[boring]]``: drilling at a site."""

    PLAYER, SHOWN = "Borer", "boring"
    n_helpers: ClassVar[int] = 1

    stay_s: Positive = Field(300.0, description="duration of drilling")
    drill: str = Field(description="name of the sensor that drills, of type drill")

    def is_able(self, data: VehicleData) -> bool:
        return self.drill_of(data) is not None

    def drill_of(self, data: VehicleData) -> DrillSettings | None:
        """Return the vehicle's drill for this site; None without one."""
        drills = (sensor for sensor in data.sensors if isinstance(sensor, DrillSettings) and sensor.name == self.drill)
        return next(drills, None)

    def behaviour(self, data: VehicleData, scenario: Any) -> Behaviour:
        others = {hole.name for hole in scenario.boring if hole.drill == self.drill and hole != self}
        return Drilling(self, others, scenario.mission.wait_s, data)

    def helper(self, help: Help, data: VehicleData, scenario: Any) -> Behaviour:
        """Create the behaviour that brings energy."""
        return Bringing(self, scenario.transfer, help, data.sensor(ChargerSettings) or ChargerSettings(), data)


class Passing:
    """Evolution of the energies of a run."""

    def __init__(self, borings: Mapping[str, Boring], transfer: TransferTable, energies: Energies) -> None:
        self._borings, self._transfer, self._energies = borings, transfer, energies
        self._halted: set[tuple[str, str]] = set()  # vehicle and hole
        self._last_s = 0.0

    def go_on(self, fleet: FleetView, now_s: float) -> None:
        """Advance transfers and drilling by the time since the last call."""
        dt_s, self._last_s = now_s - self._last_s, now_s
        if dt_s <= 0.0:
            return
        # A drill or charger is at rest unless it is used in this step.
        for store in self._energies.stores.values():
            store.state, store.hole = AT_REST, ""
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
        hole = self._hole(vehicle, settings)
        if hole is None:
            return
        drill = self._energies.stores.setdefault((vehicle.name, settings.name), Store(settings.battery_j))
        drill.hole = hole.name
        self._energies.bored.setdefault(hole.name, 0.0)
        comes = self._come_in(fleet, hole, settings.battery_j, drill, dt_s, now_s)
        waits = vehicle.name, hole.name
        # Under supply the drill waits for its full battery; when the supply ends, a tenth is enough to resume.
        if waits in self._halted and not comes and drill.left_j >= LEAST_SHARE * settings.battery_j:
            self._halted.discard(waits)
        if waits in self._halted:
            drill.state = CHARGING if comes else HALTED
        else:
            self._bore(vehicle.name, hole, settings.power_w, drill, dt_s, now_s)

    def _hole(self, vehicle: VehicleView, settings: DrillSettings) -> Boring | None:
        if settings.name not in vehicle.sensing or not vehicle.is_alive:
            return None
        at_m = vehicle.position_m
        holes = [hole for hole in self._borings.values() if hole.drill == settings.name and _is_at(at_m, hole.place_m)]
        return min(holes, key=lambda hole: distance(at_m, hole.place_m), default=None)

    def _bore(self, vehicle: str, hole: Boring, power_w: float, drill: Store, dt_s: float, now_s: float) -> None:
        energies, whole_j = self._energies, power_w * hole.stay_s
        left = 1.0 - energies.bored[hole.name]
        if left <= 0.0:
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

    def _come_in(self, fleet: FleetView, hole: Boring, full_j: float, drill: Store, dt_s: float, now_s: float) -> bool:
        """Transfer energy from vehicles at the berth with the charger on; return True if any."""
        berth_m, comes, energies = self._transfer.berth(hole.place_m), False, self._energies
        for other in fleet.vehicles:
            settings = other.data.sensor(ChargerSettings)
            if settings is None or settings.name not in other.sensing or not other.is_alive:
                continue
            if not _is_at(other.position_m, berth_m):
                continue
            charger = energies.stores.setdefault((other.name, settings.name), Store(settings.store_j))
            lacks_j = full_j - drill.left_j
            passes_j = self._transfer.passes_j(dt_s, charger.left_j, lacks_j)
            charger.state = GIVING if passes_j > 0.0 else FULL if lacks_j <= 0.0 else AT_REST
            if passes_j > 0.0:
                comes = True
                # The share lost in the transfer leaves the store too.
                charger.left_j = max(0.0, charger.left_j - passes_j / self._transfer.efficiency)
                drill.left_j = min(full_j, drill.left_j + passes_j)
                energies.note_passed((other.name, hole.name), passes_j, now_s)
        return comes


def _is_at(at_m: Point, place_m: Point) -> bool:
    return distance(at_m, place_m) <= THERE_M


BRINGS, IS_HALTED = "brings", "isHalted"
"""Attributes: site to which a vehicle last brought energy; whether the work there is halted."""

IN_PLACE_M = 5.0  # distance for a received position to count as in place; it is some seconds old


class Drilling(Behaviour):
    """Drilling at a site until finished; dissatisfied without energy, given up after ``wait_s``."""

    def __init__(self, boring: Boring, others: Collection[str], wait_s: float, data: VehicleData) -> None:
        self._boring, self._others = boring, others
        self._me, self._speed_mps = data.name, data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._wait = HelpAwaited(f"energy at {boring.name}", wait_s)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending until the hole is finished, nearest first; progresses while drilling or charging."""
        boring, facts, now_s = self._boring, picture.facts, picture.body.now_s
        if facts.get(boring.done) is not None or facts.get((BORED_SHARE, boring.name), 0.0) >= 1.0:
            return DONE
        # A drill without an answer is broken, so another vehicle has to take the job.
        if boring.drill not in picture.body.answering:
            return FAILED
        to_go_m = distance_m(motion, boring.place_m)
        if performed and to_go_m <= THERE_M:
            return self._work(facts, now_s)
        self._wait.is_over()
        perception = self._approach.perceived(to_go_m, now_s, performed)
        return IDLE if self._waits_elsewhere(facts) else perception

    def _waits_elsewhere(self, facts: Known) -> bool:
        # With an empty drill the vehicle stays at the halted hole, to which energy is brought.
        hole = facts.get((BORES, self._me))
        if hole not in self._others or not facts.get((IS_HALTED, hole)) or facts.get((DONE_BY, hole)) is not None:
            return False
        return bool(facts.get((DRILL_CHARGE, self._me), 1.0) < LEAST_SHARE)

    def _work(self, facts: Known, now_s: float) -> Perception:
        # The latest reading may still describe another hole.
        is_here = facts.get((BORES, self._me)) == self._boring.name
        state = facts.get((DRILL_STATE, self._me)) if is_here else None
        is_known = bool(facts.get((IS_HALTED, self._boring.name)))
        if state in (BORING, CHARGING):
            self._wait.is_over()
            goes_on = state == BORING and is_known
            return ADVANCING._replace(concludes=(self._says(False),)) if goes_on else ADVANCING
        perception = self._wait.perceived(now_s)
        if perception.failed:
            return FAILED._replace(concludes=(self._says(False),)) if is_known else FAILED
        says = state == HALTED and not is_known
        return perception._replace(concludes=(self._says(True),)) if says else perception

    def _says(self, is_halted: bool) -> Observation:
        return Observation(((self._boring.name, IS_HALTED, is_halted),))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return to_stay(self._boring.place_m, self._speed_mps, motion)


class HelpAtBerth(Help):
    """Help at a berth for one vehicle: of approaching equals the first by name continues."""

    turn_frames = 2.0

    def goes_before(self, name: str, its_m: float, to_go_m: float) -> bool:
        """True if the other is at the berth, much nearer, or as near and first by name or under way."""
        # Received positions are seconds old: by distance alone each of two vehicles would take the other to be farther,
        # and both would come. A vehicle that has ceded the berth returns only if it is much nearer.
        if self.is_on and to_go_m <= IN_PLACE_M:
            return False
        margin_m = 2.0 * MUCH_NEARER_M if not self.is_on else MUCH_NEARER_M if name < self.me else -MUCH_NEARER_M
        return its_m <= IN_PLACE_M or its_m - margin_m <= to_go_m

    def stay_away(self, work: Work, picture: Picture) -> Collection[str]:
        """Members that wait themselves, or have no energy as far as known."""
        without = [name for name in work.members if not _has_energy(work.database[name], picture.facts)]
        return [*super().stay_away(work, picture), *without]


def _has_energy(data: VehicleData, facts: Known) -> bool:
    charger = data.sensor(ChargerSettings)
    return charger is not None and facts.get((STORE_CHARGE, data.name), charger.store_j) > 0.0


class Bringing(Behaviour):
    """Transfer of energy to a drill site where the work of another vehicle is halted."""

    def __init__(
        self, boring: Boring, transfer: TransferTable, help: Help, charger: ChargerSettings, data: VehicleData
    ) -> None:
        self._boring, self._help, self._charger, self._data = boring, help, charger, data
        self._berth_m = transfer.berth(boring.place_m)
        self._me, self._speed_mps = data.name, data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)

    def _is_due(self, to_go_m: float, picture: Picture, performed: bool) -> bool:
        facts = picture.facts
        is_halted = bool(facts.get((IS_HALTED, self._boring.name)))
        return (
            self._help.is_of_use(self._berth_m if is_halted else None, to_go_m, picture, performed)
            and facts.get(self._boring.done) is None
            and self._charger.name in picture.body.answering
            and _has_energy(self._data, facts)
            # Leaving another site before its battery is full would soon cause another call from there.
            and (performed or not self._is_giving(picture))
            and self._is_awaited(picture)
        )

    def _is_awaited(self, picture: Picture) -> bool:
        """True if the job has a holder, or a vehicle received lately at the site may hold it unreported."""
        peers, late_s = picture.peers, picture.body.now_s - NEWS_FRAMES * picture.frame_s
        near = (name for name, at_m in peers.positions_m.items() if distance(at_m, self._boring.place_m) <= IN_PLACE_M)
        return bool(self._help.holders) or any(peers.word_s.get(name, -math.inf) >= late_s for name in near)

    def _is_giving(self, picture: Picture) -> bool:
        return self._charger.name in picture.body.sensors_on and picture.facts.get((CHARGER_STATE, self._me)) == GIVING

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending while work is halted without another helper; progresses on the way and at work."""
        to_go_m, now_s = distance_m(motion, self._berth_m), picture.body.now_s
        if not self._is_due(to_go_m, picture, performed):
            return IDLE
        is_there = performed and to_go_m <= THERE_M
        on_way = None if is_there else self._approach.perceived(to_go_m, now_s, performed)
        perception = on_way or self._give(picture.facts)
        return perception._replace(concludes=(*self._help.said(), *perception.concludes), ends=self._help.ends)

    def _give(self, facts: Known) -> Perception:
        state = facts.get((CHARGER_STATE, self._me))
        # A full battery ends the wait at once, before the drill reports its progress.
        if state == FULL:
            return ADVANCING._replace(concludes=(Observation(((self._boring.name, IS_HALTED, False),)),))
        return ADVANCING if state == GIVING else STANDING

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return to_stay(self._berth_m, self._speed_mps, motion)
