"""What became of the features, as the truth of mapping sees it: who found them, and which were inspected."""

from __future__ import annotations

from collections.abc import Mapping, Set

from missions.mapping.sensors import Cell, Seabed, Stays
from remoras.mission import VehicleView


class FindsWatch:
    """Watches the features of one run from outside.

    Args:
        seabed: with the features that lie in it.
    """

    def __init__(self, seabed: Seabed) -> None:
        self._seabed = seabed
        self._stays: dict[str, Stays] = {}
        self._finders: dict[str, set[str]] = {}  # vehicles that have found each
        self._inspected: set[str] = set()

    def is_new(self, cell: Cell, vehicle: str) -> bool:
        """Note that a vehicle has covered a cell; True if a feature lies there that nobody had found."""
        feature = self._seabed.features.get(cell)
        if feature is None:
            return False
        finders = self._finders.setdefault(feature.name, set())
        finders.add(vehicle)
        return len(finders) == 1

    def n_inspected_by(self, vehicle: VehicleView, now_s: float) -> int:
        """How many features a vehicle has inspected with this look that nobody had."""
        stays = self._stays.setdefault(vehicle.name, Stays())
        over = stays.inspected(self._seabed, vehicle.position_m, vehicle.speed_mps, now_s)
        new = {feature.name for feature in over} - self._inspected
        self._inspected |= new
        return len(new)

    @property
    def n_inspected(self) -> int:
        """How many features have been inspected."""
        return len(self._inspected)

    def has_open(self, left: Set[str]) -> bool:
        """True while a vehicle of those that are left has found something that nobody has inspected."""
        return any(
            not finders.isdisjoint(left) for name, finders in self._finders.items() if name not in self._inspected
        )

    def n_within_reach(self, able: Mapping[str, bool]) -> int:
        """How many features are not inspected though somebody left could find or has found them, and inspect them.

        Args:
            able: by area, whether a vehicle that is able to map it is left.
        """
        if not any(able.values()):
            return 0
        cells = self._seabed.cells
        return sum(
            able[cells[cell][0]] or feature.name in self._finders
            for cell, feature in self._seabed.features.items()
            if feature.name not in self._inspected
        )
