"""What has to hold between the tables of this mission; malformed tables are passed over, as everywhere."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from missions.arrows.grid import MOST_CELLS, MOST_TILES, Array, CellGrid
from missions.arrows.prior import grid_over, share_map
from missions.arrows.scenario import CELL_M, DETECTORS, SPREAD_M, UNIFORM_SHARE
from missions.errors import ConfigurationFault
from missions.scenarios.tables import (
    Raw,
    bounds_of,
    entries,
    list_of,
    names_of,
    one_of,
    outside_faults,
    point_of,
    table_of,
)

SUM_TOLERANCE = 1e-6


def arrows_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """All faults of the area, the priors, the detectors and of who carries them.

    Args:
        raw: the tables as TOML has them.
    """
    yield from _area(raw)
    yield from _kinds(raw)
    for number, find in enumerate(entries(raw, "historic_find"), 1):
        key = f"historic_find.{number}"
        yield from one_of(f"{key}.kind", find.get("kind"), names_of(raw, "kind"))
        yield from outside_faults(raw, [(f"{key}.position_m", at_m) for at_m in point_of(find, "position_m")])
    yield from _detectors(raw)
    yield from _crew(raw)


def _grid(raw: Raw) -> CellGrid | None:
    """The cells; None where the tables are malformed."""
    search = table_of(raw, "search")
    sides_m, cell_m = [point_of(search, key) for key in ("x_m", "y_m")], search.get("cell_m", CELL_M)
    if not all(sides_m) or not _is_number(cell_m) or cell_m < 5.0:
        return None
    (west_m, east_m), (south_m, north_m) = (side[0] for side in sides_m)
    if not all(map(math.isfinite, (west_m, east_m, south_m, north_m))) or not (west_m < east_m and south_m < north_m):
        return None
    return grid_over((west_m, east_m), (south_m, north_m), float(cell_m))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _area(raw: Raw) -> Iterator[ConfigurationFault]:
    """Borders: in order, and within the world; a side of cells of which there are not too many."""
    bounds = bounds_of(raw)
    edges = {"x_m": (bounds[0], bounds[2]), "y_m": (bounds[1], bounds[3])} if bounds else {}
    for key in ("x_m", "y_m"):
        for low, high in point_of(table_of(raw, "search"), key):
            given = f"[{low:g}, {high:g}]"
            if not low < high:
                yield ConfigurationFault(f"search.{key}", given, "the lower border first, then the higher")
            elif key in edges and not edges[key][0] <= low < high <= edges[key][1]:
                allowed = f"within world.{key} = [{edges[key][0]:g}, {edges[key][1]:g}]"
                yield ConfigurationFault(f"search.{key}", given, allowed)
    grid = _grid(raw)
    if grid is not None and (grid.n_cells > MOST_CELLS or grid.n_tiles > MOST_TILES):
        size = f"{grid.n_columns} x {grid.n_rows} cells"
        allowed = f"{size}; at most {MOST_CELLS} in {MOST_TILES} tiles of 4 x 4: take a larger side"
        yield ConfigurationFault("search.cell_m", f"{grid.cell_m:g}", allowed)


def _kinds(raw: Raw) -> Iterator[ConfigurationFault]:
    """Each kind once; maps that are maps; no more things than cells have room for."""
    for name, times in Counter(names_of(raw, "kind")).items():
        if times > 1:
            yield ConfigurationFault(f"kind.{name}.name", f'"{name}"', f"given {times} times; each kind has one table")
    grid = _grid(raw)
    if grid is None or grid.n_cells > MOST_CELLS:
        return
    faults = [fault for kind in entries(raw, "kind") if "map" in kind for fault in _map(kind, grid)]
    yield from faults
    expected = {} if faults or not _are_numbers(raw) else _expected(raw, grid)
    if expected:
        together = np.zeros(grid.n_cells)
        for chances in expected.values():
            together += chances
        fullest = float(together.max())
        name = max(expected, key=lambda name: float(expected[name].max()))
        if fullest > 1.0:
            allowed = "at most 1 of all kinds together: expect fewer, spread them farther, or take smaller cells"
            yield ConfigurationFault(f"kind.{name}.expected", f"{fullest:.3g} things in one cell", allowed)


def _are_numbers(raw: Raw) -> bool:
    """True if all maps are; others are reported elsewhere."""
    maps = [kind["map"] for kind in entries(raw, "kind") if "map" in kind]
    return all(_is_number(number) for rows in maps for row in rows for number in row)


def _expected(raw: Raw, grid: CellGrid) -> dict[str, Array]:
    """How many of each kind are expected in each cell; what is malformed is passed over."""
    found = {}
    for kind in entries(raw, "kind"):
        name, expected = str(kind.get("name")), kind.get("expected")
        spread_m, even = kind.get("spread_m", SPREAD_M), kind.get("uniform_share", UNIFORM_SHARE)
        if not all(map(_is_number, (expected, spread_m, even))) or not (spread_m > 0.0 and 0.0 <= even <= 1.0):
            continue
        finds = (entry for entry in entries(raw, "historic_find") if entry.get("kind") == name)
        finds_m = [at_m for find in finds for at_m in point_of(find, "position_m")]
        given = kind.get("map")
        shares = np.array(given).reshape(-1) if given else share_map(grid, finds_m, spread_m, even)
        found[name] = float(expected or 0.0) * shares
    return found


def _map(kind: Raw, grid: CellGrid) -> Iterator[ConfigurationFault]:
    """A map of shares: its size, and that it is one."""
    key, given = f"kind.{kind.get('name')}.map", kind["map"]
    rows = given if isinstance(given, list) and all(isinstance(row, list) for row in given) else []
    if len(rows) != grid.n_rows or any(len(row) != grid.n_columns for row in rows):
        sizes = " or ".join(str(size) for size in sorted({len(row) for row in rows}))
        allowed = f"{grid.n_rows} rows of {grid.n_columns} numbers: one for each cell, from the south-west"
        yield ConfigurationFault(key, f"{len(rows)} rows of {sizes or 0}", allowed)
        return
    if not all(_is_number(number) for row in rows for number in row):
        return
    for number, row in enumerate(rows, 1):
        for place, one in enumerate(row, 1):
            if one < 0.0:
                yield ConfigurationFault(f"{key}.{number}.{place}", f"{one:g}", "a number from 0 on")
                return
    total = math.fsum(number for row in rows for number in row)
    if abs(total - 1.0) > SUM_TOLERANCE:
        yield ConfigurationFault(key, f"sums to {total:.6g}", "shares of all cells sum to 1")


def _detectors(raw: Raw) -> Iterator[ConfigurationFault]:
    """Rates of kinds that may lie there."""
    tables, kinds = table_of(raw, "detector"), names_of(raw, "kind")
    for name in (*DETECTORS, "optical"):
        for kind in table_of(table_of(tables, name), "p_detect"):
            yield from one_of(f"detector.{name}.p_detect.{kind}", kind, kinds)


def _crew(raw: Raw) -> Iterator[ConfigurationFault]:
    """Somebody who searches."""
    sensors = [
        one for vehicle in entries(raw, "vehicle") for one in list_of(vehicle, "sensor") if isinstance(one, dict)
    ]
    carried = {str(sensor.get("type", DETECTORS[0])) for sensor in sensors}
    if entries(raw, "vehicle") and carried.isdisjoint(DETECTORS):
        allowed = f"nobody searches: some vehicle needs a [[vehicle.sensor]] of type {' or '.join(DETECTORS)}"
        yield ConfigurationFault("vehicle.sensor", "", allowed)
