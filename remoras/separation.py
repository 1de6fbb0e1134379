"""Separation: which vehicles are near each other, as the obstacle sonars see them and as it really is.

Vehicles whose depths differ by more than ``SAME_DEPTH_M`` pass freely. Depths do not change in a run, so the fleet
falls into layers once; a feature by which they do puts something else in the place of ``Separation``. In every tick
those of a layer that are near each other are found: few by comparing all, more by squares as wide as the sonar reaches,
since only vehicles in one square or in adjacent ones can be near.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Protocol

from exchange.arithmetic import length
from remoras.avoidance import Neighbour
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.recorder import Row

NEAR_M = 30.0
"""A vehicle that stays within this distance of a place has settled there; it gives way to others meanwhile."""
SONAR_M = 60.0
"""Range of the obstacle sonar."""
SAME_DEPTH_M = 3.0
"""Vehicles that differ more than this in depth pass freely."""
TOLERANCE_M = 0.001
"""Distances are compared to the millimetre: a start that is written as far off as it has to be is no conflict."""
CONFLICT = "conflict"
"""Kind of the rows in ``faults`` which say that two vehicles are nearer to each other than they are to be."""
FEW = 8
"""So many vehicles are compared with each other all: to sort them into squares takes longer."""
_HALF = ((1, -1), (1, 0), (1, 1), (0, 1))
"""Squares adjacent to one, of each opposite pair only one."""


class _Layer(Protocol):
    @property
    def motion(self) -> Motion:
        """State of motion."""
        ...

    @property
    def depth_m(self) -> float:
        """At which it is now."""
        ...


class Moving(Protocol):
    """What has a name, a depth and a motion: a vehicle."""

    data: VehicleData

    @property
    def functional(self) -> _Layer:
        """What moves it."""
        ...

    @property
    def is_alive(self) -> bool:
        """True unless it floats up out of the way."""
        ...


def in_layers(depths_m: Sequence[float]) -> list[list[int]]:
    """Indices of the depths in groups between which nobody meets anybody; a depth that meets no other is left out.

    >>> in_layers([20.0, 0.0, 22.0, 24.5])
    [[0, 2, 3]]
    """
    layers: list[list[int]] = []
    before_m = -math.inf
    for depth_m, index in sorted((depth_m, index) for index, depth_m in enumerate(depths_m)):
        if depth_m - before_m > SAME_DEPTH_M:
            layers.append([])
        layers[-1].append(index)
        before_m = depth_m
    return [sorted(layer) for layer in layers if len(layer) > 1]


def _in_adjacent_squares(motions: Mapping[int, Motion]) -> list[tuple[int, int]]:
    """Pairs of vehicles, by index, in one square as wide as the sonar reaches, or in two that touch, in order."""
    squares: dict[tuple[int, int], list[int]] = {}
    for index, motion in motions.items():
        squares.setdefault((int(motion.x_m // SONAR_M), int(motion.y_m // SONAR_M)), []).append(index)
    near: list[tuple[int, int]] = []
    for (column, row), own in squares.items():
        near += combinations(own, 2)
        for right, up in _HALF:
            if others := squares.get((column + right, row + up)):
                near += [(mine, other) if mine < other else (other, mine) for mine in own for other in others]
    return sorted(near)


class Separation:
    """Watches the distances between the vehicles of a fleet.

    Args:
        vehicles: of the fleet, in the order of the nodes.
        separation_m: distance that two vehicles in one layer are to keep.

    Attributes:
        vehicles: the same, to be replaced where one begins anew.
        separation_m: the same.
        layers: indices of the vehicles that may meet.
    """

    def __init__(self, vehicles: Sequence[Moving], separation_m: float) -> None:
        self.vehicles = vehicles
        self.separation_m = separation_m
        self.layers = in_layers([vehicle.data.depth_m for vehicle in vehicles])
        self._pairs: list[tuple[int, int]] = []
        self._conflicts: frozenset[tuple[int, int]] = frozenset()

    def look(self) -> dict[int, list[Neighbour]]:
        """What the obstacle sonar of every vehicle sees of the others, by its index; who sees nobody is missing.

        One without power floats up, out of the way.
        """
        self._pairs = []
        seen: dict[int, list[Neighbour]] = {}
        for layer in self.layers:
            self._look_in(layer, seen)
        return seen

    def _look_in(self, layer: Sequence[int], seen: dict[int, list[Neighbour]]) -> None:
        """Add what the vehicles of a layer see of each other, in the order of the nodes."""
        vehicles = self.vehicles
        motions = {index: vehicles[index].functional.motion for index in layer}
        for one, other in combinations(layer, 2) if len(layer) <= FEW else _in_adjacent_squares(motions):
            a, b = motions[one], motions[other]
            dx_m, dy_m = b.x_m - a.x_m, b.y_m - a.y_m
            if dx_m * dx_m + dy_m * dy_m > SONAR_M * SONAR_M:
                continue
            of_one, of_other = vehicles[one], vehicles[other]
            if not (of_one.is_alive and of_other.is_alive and self.may_meet(one, other)):
                continue
            self._pairs.append((one, other))
            seen.setdefault(one, []).append(Neighbour(dx_m, dy_m, *b.velocity_mps))
            seen.setdefault(other, []).append(Neighbour(-dx_m, -dy_m, *a.velocity_mps))

    def may_meet(self, one: int, other: int) -> bool:
        """True if two vehicles of a layer, by index, keep clear of each other: a layer may be thicker than that."""
        return abs(self.vehicles[one].data.depth_m - self.vehicles[other].data.depth_m) <= SAME_DEPTH_M

    def conflicts(self, now_s: float) -> list[Row]:
        """Rows for ``faults`` of pairs that have come too near since the last call.

        Only pairs that saw each other are looked at: the sonar reaches farther than two vehicles move in a tick.
        """
        if not self._pairs:
            self._conflicts = frozenset()
            return []
        before, self._conflicts = self._conflicts, frozenset(pair for pair in self._pairs if self.are_too_near(*pair))
        return [
            (now_s, self.vehicles[one].data.name, CONFLICT, self.vehicles[other].data.name)
            for one, other in sorted(self._conflicts - before)
        ]

    def are_too_near(self, one: int, other: int) -> bool:
        """True if two vehicles that see each other, by index, are nearer than they are to be."""
        a, b = self.vehicles[one].functional.motion, self.vehicles[other].functional.motion
        return length(b.x_m - a.x_m, b.y_m - a.y_m) < self.separation_m - TOLERANCE_M
