"""Separation: sonar contacts and true conflicts between vehicles.

Depths are constant in a run, so the fleet has fixed layers; a feature with variable depths replaces ``Separation``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Protocol

from exchange.arithmetic import length
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.motion.avoidance import Neighbour
from remoras.recorder import Row

NEAR_M = 30.0
"""Distance within which a vehicle has settled at a place; it yields to others meanwhile."""
SONAR_M = 60.0
SAME_DEPTH_M = 3.0
"""Depth difference above which vehicles do not interact."""
TOLERANCE_M = 0.001
"""Tolerance of distances: starts at exactly the separation are no conflict."""
CONFLICT = "conflict"
"""Kind of rows in ``faults`` for violated separation."""


class _Layer(Protocol):
    @property
    def motion(self) -> Motion:
        """State of motion."""

    @property
    def depth_m(self) -> float:
        """Current depth."""


class Moving(Protocol):
    """Vehicle with name, depth and motion."""

    data: VehicleData

    @property
    def functional(self) -> _Layer:
        """Functional layer, which holds the motion."""

    @property
    def is_alive(self) -> bool:
        """False once it floats to the surface without power."""


def in_layers(depths_m: Sequence[float]) -> list[list[int]]:
    """Group indices of depths into layers without mutual interaction; singletons are omitted.

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


class Separation:
    """Monitor of the distances in a fleet.

    ``layers`` are indices of vehicles that may interact, in the node order of ``vehicles``, which the caller replaces
    when one restarts.
    """

    def __init__(self, vehicles: Sequence[Moving], separation_m: float) -> None:
        self.vehicles = vehicles
        self.separation_m = separation_m
        self.layers = in_layers([vehicle.data.depth_m for vehicle in vehicles])
        self._pairs: list[tuple[int, int]] = []
        self._conflicts: frozenset[tuple[int, int]] = frozenset()

    def look(self) -> dict[int, list[Neighbour]]:
        """Return the sonar contacts of each vehicle, by index; none for vehicles without contacts."""
        self._pairs = []
        vehicles = self.vehicles
        seen: dict[int, list[Neighbour]] = {}
        for layer in self.layers:
            motions = {index: vehicles[index].functional.motion for index in layer}
            for first, second in combinations(layer, 2):
                a, b = motions[first], motions[second]
                dx_m, dy_m = b.x_m - a.x_m, b.y_m - a.y_m
                if dx_m * dx_m + dy_m * dy_m > SONAR_M * SONAR_M:
                    continue
                # A vehicle without power floats to the surface, out of the way.
                if vehicles[first].is_alive and vehicles[second].is_alive and self.may_meet(first, second):
                    self._pairs.append((first, second))
                    seen.setdefault(first, []).append(Neighbour(dx_m, dy_m, *b.velocity_mps))
                    seen.setdefault(second, []).append(Neighbour(-dx_m, -dy_m, *a.velocity_mps))
        return seen

    def may_meet(self, first: int, second: int) -> bool:
        """True if two vehicles of a layer interact: a layer may be thicker than ``SAME_DEPTH_M``."""
        return abs(self.vehicles[first].data.depth_m - self.vehicles[second].data.depth_m) <= SAME_DEPTH_M

    def conflicts(self, now_s: float) -> list[Row]:
        """Return rows for ``faults`` of new violations since the last call."""
        if not self._pairs:
            self._conflicts = frozenset()
            return []
        # Pairs with sonar contact suffice: no vehicle crosses the sonar range in one tick.
        before, self._conflicts = self._conflicts, frozenset(pair for pair in self._pairs if self.are_too_near(*pair))
        return [
            (now_s, self.vehicles[first].data.name, CONFLICT, self.vehicles[second].data.name)
            for first, second in sorted(self._conflicts - before)
        ]

    def are_too_near(self, first: int, second: int) -> bool:
        """True if two vehicles violate the separation."""
        a, b = self.vehicles[first].functional.motion, self.vehicles[second].functional.motion
        return length(b.x_m - a.x_m, b.y_m - a.y_m) < self.separation_m - TOLERANCE_M
