"""What is known of the sea before the search: a map of probabilities for each kind of thing, from historic finds.

Around each historic find lies a hill of density (1 - d^2 / s^2)^2 within the distance s, zero beyond (the quartic
kernel of density estimation, up to its scale). The hills of a kind and an even share sum to 1 over the cells; times the
number expected this is the probability that a cell holds such a thing.
"""

from __future__ import annotations

import math

import numpy as np

from missions.arrows.grid import Array, CellGrid, summed
from missions.arrows.scenario import DETECTORS, ArrowsScenario, DetectorTable, KindTable
from remoras.work import Point


def grid_over(x_m: Point, y_m: Point, cell_m: float) -> CellGrid:
    """The cells over a rectangle from its western and southern borders on; the last may reach beyond the others.

    >>> grid_over((0.0, 100.0), (0.0, 90.0), 40.0).n_cells
    9
    """
    n_columns, n_rows = (max(1, math.ceil((high - low) / cell_m - 1e-9)) for low, high in (x_m, y_m))
    return CellGrid(x_m[0], y_m[0], cell_m, n_columns, n_rows)


def grid_of(scenario: ArrowsScenario) -> CellGrid:
    """The cells of a scenario."""
    return grid_over(scenario.search.x_m, scenario.search.y_m, scenario.search.cell_m)


def share_map(grid: CellGrid, finds_m: list[Point], spread_m: float, uniform_share: float) -> Array:
    """Where a thing of some kind lies if there is one: shape (n_cells,), sums to 1.

    Args:
        grid: the cells.
        finds_m: where such things were found.
        spread_m: how far around.
        uniform_share: share that is even.
    """
    hills = np.zeros(grid.n_cells)
    for x_m, y_m in sorted(finds_m):  # sums are the same bytes in whatever order they are listed
        dx_m, dy_m = grid.x_m - x_m, grid.y_m - y_m
        height = np.maximum(0.0, 1.0 - (dx_m * dx_m + dy_m * dy_m) / (spread_m * spread_m))
        hills += height * height
    total = summed(hills)
    even = np.full(grid.n_cells, 1.0 / grid.n_cells)
    return even if total == 0.0 else uniform_share * even + (1.0 - uniform_share) * hills / total


def prior_of(scenario: ArrowsScenario) -> Array:
    """The probability of each kind in each cell, shape (1 + kinds, n_cells); columns sum to 1, the first is nothing."""
    grid = grid_of(scenario)
    rows = [kind.expected * _shares(grid, kind, scenario) for kind in scenario.kinds]
    occupied = rows[0].copy()
    for row in rows[1:]:
        occupied += row
    return np.vstack([1.0 - occupied, *rows])


def _shares(grid: CellGrid, kind: KindTable, scenario: ArrowsScenario) -> Array:
    if kind.map:
        return np.array(kind.map, dtype=float).reshape(-1)
    finds_m = [historic.position_m for historic in scenario.historic_find if historic.kind == kind.name]
    return share_map(grid, finds_m, kind.spread_m, kind.uniform_share)


def rates_of(scenario: ArrowsScenario) -> Array:
    """Rate of contacts by detector and kind: shape (detectors, 1 + kinds), the first column is nothing."""
    detectors: list[DetectorTable] = [getattr(scenario.detector, name) for name in DETECTORS]
    return np.array(
        [
            [detector.p_false, *(detector.p_detect.get(kind.name, detector.p_false) for kind in scenario.kinds)]
            for detector in detectors
        ]
    )
