"""What really happens between vehicles: energy passes from stores to batteries, drills work, holes get deeper.

It happens whether truth looks or not, and whatever vehicles believe. A drill works while its vehicle is at a hole of
its kind with the drill on. One that has no energy left halts; it goes on once its battery is full, or nothing comes in
any more and a tenth is there. Energy comes in from whoever lies at the berth beside the hole with its charger on.
"""

from __future__ import annotations

from collections.abc import Mapping

from exchange.arithmetic import distance
from missions.meeting.staying import THERE_M
from missions.resupply.boring import Boring
from missions.resupply.energy import (
    BORED,
    BORING,
    CHARGING,
    FULL,
    GIVING,
    HALTED,
    IDLE,
    LEAST_SHARE,
    Charger,
    ChargerSettings,
    Drill,
    DrillSettings,
    Energies,
    Transfer,
)
from remoras.mission import FleetView, VehicleView
from remoras.work import Point

GAP_S = 20.0
"""Who passes energy on again within this time has not left meanwhile."""
ALL = 1.0 - 1e-9
"""A hole is bored once so much of it is: the rest is rounding."""


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
