"""What a vehicle perceives: the seabed below it, and what is close by."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from missions.mapping.survey import Point, contains

Cell = tuple[int, int]


class Neighbour(NamedTuple):
    """Something close by, as the obstacle sonar sees it: relative position and velocity."""

    dx_m: float
    dy_m: float
    vx_mps: float
    vy_mps: float


@dataclass(frozen=True)
class Seabed:
    """Cells of the areas to be mapped: which area, and which index in it, a cell has.

    ``cells`` maps (column, row) of the world grid to (area name, index in the area). A cell covers
    ``cell_m`` by ``cell_m``; its centre is ((column + 0.5) cell_m, (row + 0.5) cell_m).
    """

    cell_m: float
    cells: Mapping[Cell, tuple[str, int]]

    @classmethod
    def of_areas(cls, cell_m: float, corners_m: Mapping[str, Sequence[Point]]) -> Seabed:
        """Cells whose centre lies in an area; row by row, from the south-west, their index in it."""
        cells: dict[Cell, tuple[str, int]] = {}
        for name, corners in corners_m.items():
            xs, ys = [x for x, _ in corners], [y for _, y in corners]
            index = 0
            for row in range(math.floor(min(ys) / cell_m), math.ceil(max(ys) / cell_m)):
                for column in range(math.floor(min(xs) / cell_m), math.ceil(max(xs) / cell_m)):
                    centre = (column + 0.5) * cell_m, (row + 0.5) * cell_m
                    if (column, row) not in cells and contains(corners, centre):
                        cells[column, row] = name, index
                        index += 1
        return cls(cell_m, cells)

    def under(self, x_m: float, y_m: float, reach_m: float) -> list[Cell]:
        """Cells of an area whose centre is within ``reach_m`` of (x_m, y_m)."""
        size = self.cell_m
        found = []
        for column in range(math.floor((x_m - reach_m) / size), math.floor((x_m + reach_m) / size) + 1):
            for row in range(math.floor((y_m - reach_m) / size), math.floor((y_m + reach_m) / size) + 1):
                if (column, row) in self.cells:
                    dx_m = (column + 0.5) * size - x_m
                    dy_m = (row + 0.5) * size - y_m
                    if dx_m * dx_m + dy_m * dy_m <= reach_m * reach_m:
                        found.append((column, row))
        return found


class MappingSensor:
    """Swath sensor: maps the cells below it while it is on and the vehicle is slow enough."""

    def __init__(self, seabed: Seabed, swath_m: float, speed_limit_mps: float) -> None:
        self._seabed = seabed
        self._reach_m = swath_m / 2.0
        self._speed_limit_mps = speed_limit_mps * 1.000001  # a vehicle at the limit still maps
        self.mapped: set[Cell] = set()

    def sense(self, x_m: float, y_m: float, speed_mps: float) -> list[Cell]:
        """Cells mapped now that this sensor had not mapped before."""
        if self._reach_m <= 0.0 or speed_mps > self._speed_limit_mps:
            return []
        new = [cell for cell in self._seabed.under(x_m, y_m, self._reach_m) if cell not in self.mapped]
        self.mapped.update(new)
        return new


def time_to_collision_s(
    neighbour: Neighbour, own_vx_mps: float, own_vy_mps: float, safety_m: float, horizon_s: float
) -> float | None:
    """Time until a neighbour is closest, if it then passes within ``safety_m`` and before ``horizon_s``.

    Constant velocities: t = -d.v / v.v with d the relative position and v the relative velocity.

    >>> time_to_collision_s(Neighbour(20.0, 1.0, -1.0, 0.0), 1.0, 0.0, safety_m=5.0, horizon_s=30.0)
    10.0
    >>> time_to_collision_s(Neighbour(20.0, 9.0, -1.0, 0.0), 1.0, 0.0, safety_m=5.0, horizon_s=30.0)
    """
    vx_mps = neighbour.vx_mps - own_vx_mps
    vy_mps = neighbour.vy_mps - own_vy_mps
    closing = -(neighbour.dx_m * vx_mps + neighbour.dy_m * vy_mps)
    speed_squared = vx_mps * vx_mps + vy_mps * vy_mps
    if closing <= 0.0 or speed_squared == 0.0:
        return None
    time_s = closing / speed_squared
    if time_s > horizon_s:
        return None
    miss_x_m = neighbour.dx_m + vx_mps * time_s
    miss_y_m = neighbour.dy_m + vy_mps * time_s
    return time_s if miss_x_m * miss_x_m + miss_y_m * miss_y_m < safety_m * safety_m else None
