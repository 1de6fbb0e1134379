"""What every run of the mapping mission keeps: its verdict is that of the ground, worked out a second time.

See ``stress.invariants.seam`` for what an invariant is; only whoever tests asks.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any, cast

from missions.mapping.scenario import MappingScenario
from missions.mapping.sensors import LIMIT_TOLERANCE, Cell, SwathSettings

ROUNDING = 1e-6


class TrueCoverage:
    """Cells count as covered if, and only if, a working sensor passed them, and a complete mission has its share."""

    name = "ground"
    moment = "tick"
    not_under = frozenset[str]()

    def __init__(self) -> None:
        self._looked: dict[str, set[tuple[float, float, float]]] = {}
        self._swaths: dict[str, list[tuple[str, float, float]]] = {}  # by vehicle: sensor, limit (m/s), reach (m)

    def broken(self, scene: Any) -> str | None:
        """Note where working sensors are; at the end compare with the tables and the verdict."""
        if scene.finished is not None:
            return self._judged(scene)
        for vehicle in scene.fleet.vehicles:
            layer, name = vehicle.functional, vehicle.name
            if not layer.sensing or not vehicle.is_alive:
                continue
            if (swaths := self._swaths.get(name)) is None:
                swaths = self._swaths[name] = _swaths_of(layer.data)
            motion, dead = layer.motion, vehicle.condition.dead_sensors
            for sensor, limit_mps, reach_m in swaths:
                if layer.guidance.ground_mps <= limit_mps and sensor in layer.sensing and sensor not in dead:
                    self._looked.setdefault(name, set()).add((motion.x_m, motion.y_m, reach_m))
        return None

    def _judged(self, scene: Any) -> str | None:
        run, scenario = scene.finished, cast("MappingScenario", scene.setup.scenario)
        world = run.mission.world(run.seed)
        covered = {(name, cell) for name, looked in self._looked.items() for cell in _cells(looked, world)}
        told = {(row[1], (row[2], row[3])) for row in run.recorder.rows("coverage")}
        if covered != told:
            wrong = sorted(covered ^ told)
            return f"{len(wrong)} cells are covered on the ground or in the table alone: {wrong[:3]}"
        cells = {cell for _, cell in covered}
        share = len(cells) / len(world.cells) if world.cells else 0.0
        if abs(scene.summary["coverage_fraction"] - share) > ROUNDING:
            return f"coverage_fraction is {scene.summary['coverage_fraction']}; on the ground it is {share:.6f}"
        if world.features or not run.completed:
            return None
        if share < scenario.mission.goal - ROUNDING:
            return f"completed with {len(cells)} of {len(world.cells)} cells covered; goal {scenario.mission.goal:g}"
        return None


def _swaths_of(data: Any) -> list[tuple[str, float, float]]:
    """Name, greatest speed (m/s) and reach to each side (m) of the swath sensors of a vehicle."""
    factor = data.speed_factor * LIMIT_TOLERANCE
    swaths = [sensor for sensor in data.sensors if isinstance(sensor, SwathSettings)]
    return [(sensor.name, factor * sensor.speed_limit_mps, sensor.swath_m / 2.0) for sensor in swaths]


def _cells(looked: set[tuple[float, float, float]], world: Any) -> set[Cell]:
    """Cells whose centre was within reach of a sensor at one of its places."""
    size, found = world.cell_m, set[Cell]()
    for x_m, y_m, reach_m in looked:
        columns, rows = (
            range(math.floor((at_m - reach_m) / size - 0.5), math.ceil((at_m + reach_m) / size - 0.5) + 1)
            for at_m in (x_m, y_m)
        )
        for cell in product(columns, rows):
            if cell not in found and cell in world.cells:
                dx_m, dy_m = (cell[0] + 0.5) * size - x_m, (cell[1] + 0.5) * size - y_m
                if dx_m * dx_m + dy_m * dy_m <= reach_m * reach_m:
                    found.add(cell)
    return found
