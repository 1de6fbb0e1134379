"""Invariants of motion: where vehicles are, and what they use; from the fleet's own record, tick by tick."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields
from typing import Any

from missions.fault import Danger
from missions.scenarios.extending import water
from remoras.recorder import PACKETS
from remoras.separation import SAME_DEPTH_M
from stress.invariants.seam import Moment, Scene

ROUNDING_M, ROUNDING_J, ROUNDING_MPS, ROUNDING_RAD = 1e-3, 1e-6, 1e-9, 1e-6
SENDER, SIZE_BITS = map(PACKETS.column_names.index, ("sender", "size_bits"))
CLOCKS_OFF_S = 35.0
"""By how much clocks may be off: jumps of 30 s, and what a scenario has beside them."""
OVERSHOOT_M = 60.0
"""How far beyond the borders a vehicle may drift while it turns."""
LEAST_SHARE = 0.5
"""Share of the separation that vehicles keep in any case; what is between is counted as a conflict."""


@dataclass(frozen=True)
class Water:
    """The keys of ``[current]``; what stands where a scenario has none."""

    east_mps: float = 0.0
    north_mps: float = 0.0
    shear_depth_m: float | None = None
    tide_period_h: float | None = None
    tide_phase: float = 0.0
    surge: tuple[Any, ...] = ()


def water_of(scene: Scene) -> Water:
    """How the water moves, as the scenario says."""
    table = water(scene.setup.scenario)
    return Water() if table is None else Water(**{field.name: getattr(table, field.name) for field in fields(Water)})


def has_current(scene: Scene) -> bool:
    """True if the water moves."""
    return water_of(scene) != Water()


STILL = (0.0, 0.0), 0.0
"""What ``carried`` gives where the water does not move."""


def carried(table: Water, depth_m: float, now_s: float) -> tuple[tuple[float, float], float]:
    """Velocity of the water (m/s, east and north) but for surges, and by how much clocks that are off may change it.

    Worked out from the keys, not by the model: full at the surface, nothing at ``shear_depth_m``, to and fro with the
    tide.

    >>> carried(Water(east_mps=0.4, shear_depth_m=40.0), 10.0, 0.0)
    ((0.30000000000000004, 0.0), 0.0)
    """
    share, turns = 1.0, 0.0
    if table.shear_depth_m is not None:
        share = max(0.0, 1.0 - depth_m / table.shear_depth_m)
    strength_mps = share * math.hypot(table.east_mps, table.north_mps)
    if table.tide_period_h is not None:
        turns = 2.0 * math.pi / (3600.0 * table.tide_period_h)
        share *= math.cos(turns * now_s + 2.0 * math.pi * table.tide_phase)
    return (share * table.east_mps, share * table.north_mps), strength_mps * min(2.0, turns * CLOCKS_OFF_S)


class Finite:
    """All positions, headings, speeds and energies are finite numbers."""

    name = "finite"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Look at the state of motion of each vehicle; at the end at all numbers of all tables."""
        for vehicle in scene.fleet.vehicles:
            m = vehicle.functional.motion
            if not math.isfinite(m.x_m + m.y_m + m.ahead[0] + m.ahead[1] + m.speed_mps + m.energy_j):
                return f"{vehicle.name} at {scene.now_s:g} s: {m}"
        if scene.finished is None:
            return None
        recorder = scene.finished.recorder
        for name, table in recorder.tables.items():
            rows = recorder.rows(name)
            for column, values in zip(table.columns, zip(*rows, strict=True), strict=False):
                if column.kind == "float" and not math.isfinite(sum(filter(None, values))):
                    for row, value in zip(rows, values, strict=True):
                        if value is not None and not math.isfinite(value):
                            return f"table {name}: {row}"
        return None


class Borders:
    """No vehicle leaves the area of operations by more than it takes to turn."""

    name = "borders"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._is_carried: bool | None = None

    def broken(self, scene: Scene) -> str | None:
        """Look at where vehicles are; a current may carry one that is off away."""
        if self._is_carried is None:
            self._is_carried = has_current(scene)
        if self._is_carried:
            return None
        x_min, y_min, x_max, y_max = scene.setup.bounds_m
        for vehicle in scene.fleet.vehicles:
            m = vehicle.functional.motion
            out_m = max(x_min - m.x_m, m.x_m - x_max, y_min - m.y_m, m.y_m - y_max)
            if out_m > OVERSHOOT_M and vehicle.is_alive:
                return f"{vehicle.name} is {out_m:.1f} m outside at {scene.now_s:g} s"
        return None


class Energy:
    """A vehicle has used what its systems, its motion, its modem and its faults took, and no more than it has."""

    name = "energy"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._used_j: dict[str, float] = {}
        self._before_s = 0.0
        self._n_packets = 0

    def broken(self, scene: Scene) -> str | None:
        """Work it out from the tick before; an empty battery gives nothing more."""
        if scene.finished is not None:
            return None
        dt_s, self._before_s = scene.now_s - self._before_s, scene.now_s
        packets = scene.fleet.recorder.packets
        sent, self._n_packets = packets[self._n_packets :], len(packets)
        for vehicle in scene.fleet.vehicles:
            m, data, name = vehicle.functional.motion, vehicle.functional.data, vehicle.name
            before_j = due_j = self._used_j.get(name, 0.0)
            for row in sent:
                if row[SENDER] == name:
                    due_j += data.transmit_j_per_packet + row[SIZE_BITS] * data.transmit_j_per_bit
            if vehicle.is_alive:
                own_w = data.hotel_w + data.drag_w_per_mps3 * m.speed_mps**3
                due_j += (own_w + math.fsum(vehicle.functional.loads_w)) * dt_s
            is_right = abs(m.energy_j - due_j) <= ROUNDING_J * (1.0 + due_j)
            is_within = before_j - ROUNDING_J <= m.energy_j <= data.energy_j + ROUNDING_J
            if not is_within or not (is_right or vehicle.functional.exhausted):
                used = f"{name} had used {before_j:.1f} J, now {m.energy_j:.1f} J"
                return f"{used} at {scene.now_s:g} s; due {due_j:.1f} J"
            self._used_j[name] = m.energy_j
        return None


class Speed:
    """No vehicle is anywhere else than it can have gone, or turns or gains speed faster than it can."""

    name = "speed"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._before: dict[str, tuple[float, float, float, tuple[float, float], float]] = {}
        """By name: place, speed, direction, depth."""
        self._before_s = 0.0
        self._was_alive: set[str] = set()
        self._water: Water | None = None
        self._flow_mps = 0.0
        self._is_still = True

    def broken(self, scene: Scene) -> str | None:
        """Compare with the tick before: its way through the water, and what the water carried it."""
        if scene.finished is not None:
            return None
        if (table := self._water) is None:
            table = self._water = water_of(scene)
            self._flow_mps = math.fsum(math.hypot(surge.east_mps, surge.north_mps) for surge in (table, *table.surge))
            self._is_still = table == Water()
        alive = {vehicle.name for vehicle in scene.fleet.vehicles if vehicle.is_alive}
        moved_itself = frozenset[str]() if table.surge else alive & self._was_alive
        before_s, self._before_s = self._before_s, scene.now_s
        dt_s, flow_mps = self._before_s - before_s, self._flow_mps
        for vehicle in scene.fleet.vehicles:
            m, data, name = vehicle.functional.motion, vehicle.functional.data, vehicle.name
            x_m, y_m, speed_mps, ahead = m.x_m, m.y_m, m.speed_mps, m.ahead
            now = x_m, y_m, speed_mps, ahead, vehicle.functional.depth_m
            before, self._before[name] = self._before.get(name), now
            if before is None:
                continue
            dx_m, dy_m, gained_mps = x_m - before[0], y_m - before[1], speed_mps - before[2]
            most_m = (max(data.transit_speed_mps, data.survey_speed_mps) + flow_mps) * dt_s * 1.001 + ROUNDING_M
            if dx_m * dx_m + dy_m * dy_m > most_m * most_m:
                return f"{name} went {math.hypot(dx_m, dy_m):.2f} m from {before_s:g} s to {scene.now_s:g} s"
            if name in moved_itself:
                (east_mps, north_mps), off_mps = STILL if self._is_still else carried(table, before[4], before_s)
                if now[4] != before[4]:  # it goes up or down
                    (to_east_mps, to_north_mps), _ = carried(table, now[4], before_s)
                    off_mps += math.hypot(to_east_mps - east_mps, to_north_mps - north_mps)
                x_gone_m, y_gone_m = dx_m - east_mps * dt_s, dy_m - north_mps * dt_s
                along_m = x_gone_m * ahead[0] + y_gone_m * ahead[1]
                aside_m = abs(x_gone_m * ahead[1] - y_gone_m * ahead[0])
                slack_m = off_mps * dt_s + ROUNDING_M
                if aside_m > slack_m or not -slack_m <= along_m <= speed_mps * dt_s + slack_m:
                    way = f"{along_m:.2f} m ahead through the water and {aside_m:.2f} m aside"
                    return f"{name} went {way} from {before_s:g} s to {scene.now_s:g} s"
            if gained_mps > data.acceleration_mps2 * dt_s + ROUNDING_MPS:
                return f"{name} gained {gained_mps:.2f} m/s from {before_s:g} s to {scene.now_s:g} s"
            if ahead != before[3]:
                along = ahead[0] * before[3][0] + ahead[1] * before[3][1]
                across = ahead[1] * before[3][0] - ahead[0] * before[3][1]
                turned_rad = abs(math.atan2(across, along))
                if turned_rad > data.turn_rate_radps * dt_s + ROUNDING_RAD:
                    return f"{name} turned by {turned_rad:.2f} rad from {before_s:g} s to {scene.now_s:g} s"
        self._was_alive = alive
        return None


class SeparationKept:
    """No two vehicles of one layer that were apart come nearer than half of the separation."""

    name = "separation"
    moment = Moment.TICK
    not_under = frozenset({Danger.PRESENCE})

    def __init__(self) -> None:
        self._apart: set[tuple[str, str]] = set()

    def broken(self, scene: Scene) -> str | None:
        """Look at each pair; those that have not been apart yet are starting."""
        separation_m = scene.setup.scenario.guidance.separation_m
        for one, other in itertools.combinations([v for v in scene.fleet.vehicles if v.is_alive], 2):
            if abs(one.functional.depth_m - other.functional.depth_m) > SAME_DEPTH_M:
                self._apart.discard((one.name, other.name))
                continue
            a, b, pair = one.functional.motion, other.functional.motion, (one.name, other.name)
            distance_m = math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
            if distance_m >= separation_m:
                self._apart.add(pair)
            elif distance_m < LEAST_SHARE * separation_m and pair in self._apart:
                return f"{one.name} and {other.name} are {distance_m:.2f} m apart at {scene.now_s:g} s"
        return None
