"""Invariants of motion: where vehicles are, and what they use; from the fleet's own record, tick by tick."""

from __future__ import annotations

import itertools
import math

from missions.scenarios.sea import CurrentTable
from remoras.separation import SAME_DEPTH_M
from stress.invariants.seam import Moment, Scene

ROUNDING_M, ROUNDING_J = 1e-3, 1e-6
OVERSHOOT_M = 60.0
"""How far beyond the borders a vehicle may drift while it turns."""
LEAST_SHARE = 0.5
"""Share of the separation that vehicles keep in any case; what is between is counted as a conflict."""


def has_current(scene: Scene) -> bool:
    """True if the water moves."""
    return scene.setup.scenario.current != CurrentTable()


class Finite:
    """All positions, headings, speeds and energies are finite numbers."""

    name = "finite"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Look at the state of motion of each vehicle; at the end at all numbers of all tables."""
        for vehicle in scene.fleet.vehicles:
            m = vehicle.functional.motion
            if not math.isfinite(m.x_m + m.y_m + m.heading_rad + m.speed_mps + m.energy_j):
                return f"{vehicle.name} at {scene.now_s:g} s: {m}"
        if scene.finished is not None:
            recorder = scene.finished.recorder
            for name in recorder.tables:
                for row in recorder.rows(name):
                    if any(value.__class__ is float and not math.isfinite(value) for value in row):
                        return f"table {name}: {row}"
        return None


class Borders:
    """No vehicle leaves the area of operations by more than it takes to turn."""

    name = "borders"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def broken(self, scene: Scene) -> str | None:
        """Look at where vehicles are; a current may carry one that is off away."""
        if has_current(scene):
            return None
        x_min, y_min, x_max, y_max = scene.setup.bounds_m
        for vehicle in scene.fleet.vehicles:
            m = vehicle.functional.motion
            out_m = max(x_min - m.x_m, m.x_m - x_max, y_min - m.y_m, m.y_m - y_max)
            if out_m > OVERSHOOT_M and vehicle.is_alive:
                return f"{vehicle.name} is {out_m:.1f} m outside at {scene.now_s:g} s"
        return None


class Energy:
    """No vehicle gains energy, or uses more than it has."""

    name = "energy"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._used_j: dict[str, float] = {}

    def broken(self, scene: Scene) -> str | None:
        """Compare with the tick before."""
        for vehicle in scene.fleet.vehicles:
            used_j, before_j = vehicle.functional.motion.energy_j, self._used_j.get(vehicle.name, 0.0)
            if used_j < before_j - ROUNDING_J or used_j > vehicle.functional.data.energy_j + ROUNDING_J:
                return f"{vehicle.name} had used {before_j:.1f} J, now {used_j:.1f} J at {scene.now_s:g} s"
            self._used_j[vehicle.name] = used_j
        return None


class Speed:
    """No vehicle is anywhere else than it can have gone."""

    name = "speed"
    moment = Moment.TICK
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._at: dict[str, tuple[float, float, float]] = {}

    def broken(self, scene: Scene) -> str | None:
        """Compare with the tick before; in a current there is no saying."""
        for vehicle in () if has_current(scene) else scene.fleet.vehicles:
            m, data = vehicle.functional.motion, vehicle.functional.data
            now_s, x_m, y_m = scene.now_s, m.x_m, m.y_m
            if (before := self._at.get(vehicle.name)) is not None:
                top_mps = max(data.transit_speed_mps, data.survey_speed_mps)
                gone_m = math.hypot(x_m - before[1], y_m - before[2])
                if gone_m > top_mps * (now_s - before[0]) * 1.001 + ROUNDING_M:
                    return f"{vehicle.name} went {gone_m:.2f} m from {before[0]:g} s to {now_s:g} s"
            self._at[vehicle.name] = now_s, x_m, y_m
        return None


class Separation:
    """No two vehicles of one layer that were apart come nearer than half of the separation."""

    name = "separation"
    moment = Moment.TICK
    not_under = frozenset({"lost", "restarts", "joins"})

    def __init__(self) -> None:
        self._apart: set[tuple[str, str]] = set()

    def broken(self, scene: Scene) -> str | None:
        """Look at each pair; those that have not been apart yet are starting."""
        separation_m = scene.setup.scenario.guidance.separation_m
        for one, other in itertools.combinations([v for v in scene.fleet.vehicles if v.is_alive], 2):
            if abs(one.data.depth_m - other.data.depth_m) > SAME_DEPTH_M:
                continue
            a, b, pair = one.functional.motion, other.functional.motion, (one.name, other.name)
            distance_m = math.hypot(a.x_m - b.x_m, a.y_m - b.y_m)
            if distance_m >= separation_m:
                self._apart.add(pair)
            elif distance_m < LEAST_SHARE * separation_m and pair in self._apart:
                return f"{one.name} and {other.name} are {distance_m:.2f} m apart at {scene.now_s:g} s"
        return None
