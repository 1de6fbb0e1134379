"""Jobs of the mapping mission: surveys of the remaining cells of one area each."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field, replace
from functools import cached_property

from exchange.arithmetic import distance
from missions.mapping.ground import Ground, Way, ground_of
from missions.mapping.sensors import mapping_speed_mps, swath_m
from remoras.beliefs import Key, Known
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group
from remoras.work import Outlook, Point

CELL_M = 25.0
"""Side of the cells of an area without a given grid."""

MOST_PARTS = 4096
"""Capacity of the cache of partial surveys."""


@dataclass(slots=True)
class _Left:
    """Remaining survey for a set of mapped cells, which only grows."""

    of: weakref.ref[Set[float]]
    seen: set[float]
    rest: SurveyJob


class _Memory:
    """Cache of remaining surveys by identity of the set of mapped cells."""

    __slots__ = ("by_set",)

    def __init__(self) -> None:
        self.by_set: dict[int, _Left] = {}


@dataclass(frozen=True)
class SurveyJob:
    """Zigzag survey of one area with a mapping sensor: a ``remoras.work.DivisibleJob``.

    ``ground`` None means cells of 25 m; ``cells`` are bits, None for all; ``parts`` caches partial surveys.
    """

    name: str
    corners_m: tuple[Point, ...]
    needs: tuple[str, ...] = ()
    ground: Ground | None = None
    cells: int | None = None
    parts: dict[int, SurveyJob] = field(default_factory=dict, compare=False, repr=False)
    depth_m: float = 0.0

    @cached_property
    def on(self) -> Ground:
        """Cells of the area."""
        return self.ground or ground_of(self.corners_m, CELL_M)

    @cached_property
    def bits(self) -> int:
        """Bits of the remaining cells."""
        return self.on.work if self.cells is None else self.cells

    @cached_property
    def place_m(self) -> Point:
        """Mean of the corners."""
        n = len(self.corners_m)
        return math.fsum(x for x, _ in self.corners_m) / n, math.fsum(y for _, y in self.corners_m) / n

    @cached_property
    def done(self) -> Key:
        """Fact that a vehicle has finished the area."""
        return "areaDone", self.name

    @cached_property
    def share_left(self) -> float:
        """Share of remaining cells, 0..1."""
        work = self.on.work
        return self.bits.bit_count() / work.bit_count() if work else 0.0

    def is_able(self, data: VehicleData) -> bool:
        """Return True if the vehicle has a mapping sensor and withstands the depth."""
        return swath_m(data) > 0.0 and data.depth_limit_m >= self.depth_m

    def left(self, facts: Known) -> SurveyJob:
        """Return the survey of the cells not known to be mapped."""
        mapped = facts.values(("mappedCell", self.name))
        key, left = id(mapped), self._left.by_set
        known = left.get(key)
        if known is None or known.of() is not mapped:
            known = left[key] = _Left(weakref.ref(mapped, lambda _: left.pop(key, None)), set(), self.of(self.on.work))
        if len(known.seen) != len(mapped):
            new = mapped - known.seen
            known.seen |= new
            known.rest = self.of(known.rest.bits & ~self.on.bits(new))
        return known.rest

    @cached_property
    def _left(self) -> _Memory:
        return _Memory()

    def of(self, cells: int) -> SurveyJob:
        """Return the survey of these cells of the area."""
        if cells == self.bits:
            return self
        part = self.parts.get(cells)
        if part is None:
            if len(self.parts) >= MOST_PARTS:
                self.parts.clear()
            part = self.parts[cells] = replace(self, ground=self.on, cells=cells)
        return part

    def way(self, position_m: Point, data: VehicleData) -> Way | None:
        """Return the fastest path over the remaining cells; None if the vehicle cannot survey them."""
        swath, survey_mps = swath_m(data), mapping_speed_mps(data)
        if swath <= 0.0 or survey_mps <= 0.0 or data.depth_limit_m < self.depth_m:
            return None
        (x_m, y_m), transit_mps = position_m, data.transit_speed_mps
        soonest, least_s = None, math.inf
        for way in self.on.survey(swath).ways(self.bits):
            dx_m, dy_m = way.first_m[0] - x_m, way.first_m[1] - y_m
            way_s = math.sqrt(dx_m * dx_m + dy_m * dy_m) / transit_mps + way.length_m / survey_mps
            if way_s < least_s:
                soonest, least_s = way, way_s
        return soonest

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Outlook after this survey; None without sensor, if too deep, or if rows pass no open cell."""
        if not self.bits:
            return outlook
        way = self.way(outlook.position_m, data)
        if way is None:
            return None
        way_s = distance(outlook.position_m, way.first_m) / data.transit_speed_mps
        return Outlook(outlook.free_s + way_s + way.length_m / mapping_speed_mps(data), way.last_m)


def swaths_of(
    groups: Iterable[Group], database: AUVDatabase, depths_m: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Swaths (m) of the vehicles able to map each area, by area and vehicle."""
    found: dict[str, dict[str, float]] = {area: {} for area in depths_m}
    for group, role in ((declared, role) for declared in groups for role in declared.roles):
        for data in database.able_to_play(group.name, role.name) if role.job in found else ():
            if swath_m(data) > 0.0 and data.depth_limit_m >= depths_m[role.job or ""]:
                found[role.job or ""][data.name] = swath_m(data)
    return found
