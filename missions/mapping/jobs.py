"""Jobs of the mapping mission: surveys of the remaining cells of one area each, which are bits of one integer."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

from exchange.arithmetic import distance, length
from missions.mapping.sensors import Cell, Seabed, mapping_speed_mps, seabed_of, swath_m
from missions.meeting.survey import length_m, rows, runs_along_x, to_and_fro
from remoras.behaviours import CAPTURE_M
from remoras.beliefs import Key, Known
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group
from remoras.work import Outlook, Point

TOLERANCE_M = 1e-6


class SurveyRow(NamedTuple):
    """A row of a survey; bits in ``cells`` mark its nearest cells, split in ``lines`` of cells along the row."""

    ends_m: tuple[Point, Point]
    cells: int
    lines: tuple[int, ...]


class Way(NamedTuple):
    """A path over all remaining cells; ``row`` and ``ends_m`` describe its first row."""

    first_m: Point
    last_m: Point
    length_m: float
    row: int
    ends_m: tuple[Point, Point]


class Ground:
    """Cells of one area, row by row from the south-west; ``fix_m`` is the error gained per fix."""

    def __init__(self, corners_m: Sequence[Point], cell_m: float, cells: Sequence[Cell], fix_m: float = 0.0) -> None:
        self._fix_m = fix_m
        self.corners_m = tuple(corners_m)
        self.cell_m = cell_m
        self.cells = tuple(cells)
        # A cache per object, since a decorated method would keep every object alive.
        self.survey = lru_cache(maxsize=64)(self._survey)
        self.work = (1 << len(self.cells)) - 1
        self._bit_of: dict[float, int] = {index: 1 << index for index in range(len(self.cells))}

    def centre_m(self, index: int) -> Point:
        """Centre of a cell."""
        column, row = self.cells[index]
        return (column + 0.5) * self.cell_m, (row + 0.5) * self.cell_m

    def bits(self, indices: Iterable[float]) -> int:
        """Return the bits of cells by index; the world model stores indices as floats."""
        bit_of = self._bit_of
        # Distinct powers of two add up to their union.
        return sum([bit_of.get(index, 0) for index in set(indices)])

    def _survey(self, swath_m: float) -> Survey:
        plain = Survey(self, swath_m)
        if self._fix_m == 0.0 or not plain.rows:
            return plain
        axis = 1 if runs_along_x(self.corners_m) else 0
        across_m = [at_m[axis] for at_m in self.corners_m]
        width_m, n_least = max(across_m) - min(across_m), len(plain.rows)
        # Closer rows lengthen the way but allow larger position errors, hence fewer fixes.
        closer = [Survey(self, width_m / n, swath_m) for n in range(n_least + 1, 2 * n_least + 1)]
        return min((plain, *closer), key=self._costs)

    def _costs(self, survey: Survey) -> float:
        # Up to a constant factor, n rows with the error a allowed on each take n (1 + K / a) if a fix costs the time in
        # which the error K accumulates. Without room for any error no row is mapped whole.
        accuracy_m = survey.slack_m - CAPTURE_M
        return len(survey.rows) * (1.0 + self._fix_m / accuracy_m) if accuracy_m > 0.0 else math.inf


class Survey:
    """Rows over an area, ``swath_m`` apart; ``sensor_m`` is the sensor's width, if larger."""

    def __init__(self, ground: Ground, swath_m: float, sensor_m: float = 0.0) -> None:
        self.ground = ground
        self._sensor_m = max(swath_m, sensor_m)
        self.swath_m = swath_m
        ends = rows(ground.corners_m, swath_m, min(swath_m, ground.cell_m) / 2.0)
        self._axis = 0 if runs_along_x(ground.corners_m) else 1
        self._along_m: list[float] = [0.0] * len(ground.cells)
        lines: list[dict[int, int]] = [{} for _ in ends]
        for index in range(len(ground.cells)):
            if (number := self._nearest(index, ends)) is not None:
                line = ground.cells[index][1 - self._axis]
                lines[number][line] = lines[number].get(line, 0) | 1 << index
        self.rows: list[SurveyRow] = []
        for of_row, of_lines in zip(ends, lines, strict=True):
            self.rows.append(SurveyRow(of_row, sum(of_lines.values()), tuple(of_lines.values())))
            self._lengthen(len(self.rows) - 1)
        self.reach = sum(row.cells for row in self.rows)
        """Bits of the cells that the rows cover."""
        self._runs_all = all(row.cells for row in self.rows)
        self.ways = lru_cache(maxsize=4096)(self._ways)

    def _nearest(self, index: int, ends: Sequence[tuple[Point, Point]]) -> int | None:
        centre_m, axis = self.ground.centre_m(index), self._axis
        reach_m = self.swath_m / 2.0 + TOLERANCE_M
        off_m, number = min(
            ((abs(centre_m[1 - axis] - first[1 - axis]), number) for number, (first, _) in enumerate(ends)),
            default=(math.inf, 0),
        )
        if off_m > reach_m:
            return None
        first, last = ends[number]
        along_m = min(max(centre_m[axis], first[axis]), last[axis])
        # Beside a slanted border the end of the row may not show the cell; ``_lengthen`` extends the row to it then.
        is_seen = length(centre_m[axis] - along_m, off_m) <= reach_m
        self._along_m[index] = along_m if is_seen else centre_m[axis]
        return number

    def _lengthen(self, number: int) -> None:
        row, axis = self.rows[number], self._axis
        at_m = [self._along_m[index] for index in range(len(self.ground.cells)) if row.cells >> index & 1]
        low_m, high_m = min([row.ends_m[0][axis], *at_m]), max([row.ends_m[1][axis], *at_m])
        self.rows[number] = row._replace(ends_m=(self.point_m(number, low_m), self.point_m(number, high_m)))

    @cached_property  # 9 % of a mission with position errors
    def slack_m(self) -> float:
        """Largest cross-track error (m) at which a vehicle still maps every cell of its row."""
        axis, off_m = self._axis, 0.0
        for row in self.rows:
            level_m, bits = row.ends_m[0][1 - axis], row.cells
            while bits:
                bit = bits & -bits
                bits ^= bit
                index = bit.bit_length() - 1
                centre_m = self.ground.centre_m(index)
                off_m = max(off_m, length(centre_m[axis] - self._along_m[index], centre_m[1 - axis] - level_m))
        return self._sensor_m / 2.0 - off_m

    def along_m(self, point: Point) -> float:
        """Coordinate of a point along the rows."""
        return point[self._axis]

    def across_m(self, point: Point) -> float:
        """Coordinate of a point across the rows."""
        return point[1 - self._axis]

    def span_m(self, number: int, left: int) -> tuple[float, float] | None:
        """Lowest and highest coordinate of the remaining part of a row; None if nothing remains."""
        row = self.rows[number]
        if not (here := left & row.cells):
            return None
        if here == row.cells:
            return row.ends_m[0][self._axis], row.ends_m[1][self._axis]
        low, high, along_m = math.inf, -math.inf, self._along_m
        # Bits rise along a line of cells, so its lowest and highest bit are its ends.
        for line in row.lines:
            if bits := here & line:
                low = min(low, along_m[(bits & -bits).bit_length() - 1])
                high = max(high, along_m[bits.bit_length() - 1])
        return low, high

    def point_m(self, number: int, along_m: float) -> Point:
        """Point of a row at a coordinate along it."""
        level_m = self.rows[number].ends_m[0][1 - self._axis]
        return (along_m, level_m) if self._axis == 0 else (level_m, along_m)

    def _ways(self, left: int) -> tuple[Way, ...]:
        left &= self.reach
        if left == self.reach and self._runs_all:
            return self._whole()
        lines = []
        for number in range(len(self.rows)):
            if (span := self.span_m(number, left)) is not None:
                lines.append((number, (self.point_m(number, span[0]), self.point_m(number, span[1]))))
        return (*_onwards(lines), *_onwards(lines[::-1]))

    def _whole(self) -> tuple[Way, ...]:
        lines = [row.ends_m for row in self.rows]
        ways: dict[Point, Way] = {}
        for number in (0, len(lines) - 1):
            # A single row offers each start twice; the dictionary keeps one.
            for start_m in lines[number]:
                points = to_and_fro(lines, start_m)
                ways[start_m] = Way(start_m, points[-1], length_m(points), number, (points[0], points[1]))
        return tuple(ways.values())


def _onwards(lines: Sequence[tuple[int, tuple[Point, Point]]]) -> list[Way]:
    """Return the shortest path over rows in this order from either end (backward recursion)."""
    rest: list[tuple[float, Point]] = []
    before: tuple[Point, Point] | None = None
    for _, ends_m in reversed(lines):
        own_m = distance(*ends_m)
        if before is None:
            rest = [(own_m, ends_m[1]), (own_m, ends_m[0])]
        else:
            (low_m, low_last), (high_m, high_last) = rest
            rest = []
            for leaving in (ends_m[1], ends_m[0]):
                to_low, to_high = distance(leaving, before[0]) + low_m, distance(leaving, before[1]) + high_m
                # Ties go to the lower end, so that equal knowledge gives equal paths on all vehicles.
                rest.append((own_m + to_low, low_last) if to_low <= to_high else (own_m + to_high, high_last))
        before = ends_m
    if before is None:
        return []
    number = lines[0][0]
    low, high = before
    return [
        Way(low, rest[0][1], rest[0][0], number, (low, high)),
        Way(high, rest[1][1], rest[1][0], number, (high, low)),
    ]


@lru_cache(maxsize=256)  # jobs of equal areas share their surveys
def ground_of(corners_m: tuple[Point, ...], cell_m: float) -> Ground:
    """Ground of a single area."""
    return Ground(corners_m, cell_m, tuple(Seabed.of_areas(cell_m, {"": corners_m}).cells))


@lru_cache(maxsize=8)  # 1 to 3 ms, and runs of a study share surveys
def grounds_of(
    cell_m: float, corners_m: tuple[tuple[str, tuple[Point, ...]], ...], fix_m: float = 0.0
) -> dict[str, Ground]:
    """Grounds of areas by name, cached for the runs of a study; ``fix_m`` as for ``Ground``."""
    cells: dict[str, list[Cell]] = {name: [] for name, _ in corners_m}
    for cell, (name, _) in seabed_of(cell_m, corners_m).cells.items():
        cells[name].append(cell)
    return {name: Ground(corners, cell_m, cells[name], fix_m) for name, corners in corners_m}


CELL_M = 25.0  # side of the cells of an area without a given grid

MOST_PARTS = 4096  # capacity of the cache of partial surveys


@dataclass(slots=True)
class _Left:
    of: weakref.ref[Set[float]]
    seen: set[float]
    rest: SurveyJob


class _Memory:
    # Without a dictionary of its own: the identities of one run are no change of a mission that runs share.
    __slots__ = ("by_set",)

    def __init__(self) -> None:
        self.by_set: dict[int, _Left] = {}


@dataclass(frozen=True)
class SurveyJob:
    """Zigzag survey of ``cells`` (None for all) of an area; ``ground`` None means cells of 25 m."""

    name: str
    corners_m: tuple[Point, ...]
    needs: tuple[str, ...] = ()
    ground: Ground | None = None
    cells: int | None = None
    parts: dict[int, SurveyJob] = field(default_factory=dict, compare=False, repr=False)
    depth_m: float = 0.0
    _left: _Memory = field(default_factory=_Memory, init=False, compare=False, repr=False)

    @cached_property  # 0.3 % of a mission
    def on(self) -> Ground:
        """Cells of the area."""
        return self.ground or ground_of(self.corners_m, CELL_M)

    @cached_property  # 0.2 % of a mission
    def bits(self) -> int:
        """Bits of the remaining cells."""
        return self.on.work if self.cells is None else self.cells

    @property
    def place_m(self) -> Point:
        """Mean of the corners."""
        n = len(self.corners_m)
        return math.fsum(x for x, _ in self.corners_m) / n, math.fsum(y for _, y in self.corners_m) / n

    @cached_property  # 0.1 % of a mission
    def done(self) -> Key:
        """Fact that a vehicle has finished the area."""
        return "areaDone", self.name

    @cached_property  # 1 % of a mission
    def share_left(self) -> float:
        """Share of remaining cells, 0..1."""
        work = self.on.work
        return self.bits.bit_count() / work.bit_count() if work else 0.0

    def is_able(self, data: VehicleData) -> bool:
        """Return True if the vehicle has a mapping sensor and withstands the depth."""
        return swath_m(data) > 0.0 and data.depth_limit_m >= self.depth_m

    def left(self, facts: Known) -> SurveyJob:
        """Return the survey of the cells not known to be mapped."""
        # The set of an area grows in place until values are invalidated, so only its new indices need work. The weak
        # reference drops the entry together with the set, before another object can have the same identity.
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

    def fastest(
        self, position_m: Point, swath_m: float, transit_mps: float, survey_mps: float
    ) -> tuple[Way | None, float]:
        """Return the fastest path over the remaining cells, and the distance (m) within which it surely stays so.

        None if no row covers a remaining cell.
        """
        x_m, y_m = position_m
        soonest, least_s, next_s = None, math.inf, math.inf
        for way in self.on.survey(swath_m).ways(self.bits):
            dx_m, dy_m = way.first_m[0] - x_m, way.first_m[1] - y_m
            way_s = math.sqrt(dx_m * dx_m + dy_m * dy_m) / transit_mps + way.length_m / survey_mps
            if way_s < least_s:
                soonest, least_s, next_s = way, way_s, least_s
            elif way_s < next_s:
                next_s = way_s
        # Each metre makes a path longer or shorter by at most a metre of transit.
        return soonest, max(0.0, (next_s - least_s) * transit_mps / 2.0 - TOLERANCE_M)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Outlook after this survey; None if unable: no sensor, too deep, or no row over an open cell."""
        if not self.bits:
            return outlook
        swath, survey_mps, transit_mps = swath_m(data), mapping_speed_mps(data), data.transit_speed_mps
        if swath <= 0.0 or survey_mps <= 0.0 or data.depth_limit_m < self.depth_m:
            return None
        way, _ = self.fastest(outlook.position_m, swath, transit_mps, survey_mps)
        if way is None:
            return None
        way_s = distance(outlook.position_m, way.first_m) / transit_mps
        return Outlook(outlook.free_s + way_s + way.length_m / survey_mps, way.last_m)


def swaths_of(
    groups: Iterable[Group], database: AUVDatabase, depths_m: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Swaths (m) of the vehicles able to map each area, by area and vehicle."""
    swaths: dict[str, dict[str, float]] = {area: {} for area in depths_m}
    for group, role in ((declared, role) for declared in groups for role in declared.roles):
        for data in database.able_to_play(group.name, role.name) if role.job in swaths else ():
            if swath_m(data) > 0.0 and data.depth_limit_m >= depths_m[role.job or ""]:
                swaths[role.job or ""][data.name] = swath_m(data)
    return swaths
