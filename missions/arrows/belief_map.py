"""Grid of cells, sampled seafloor, and belief map of each vehicle: Bayesian updates by detections.

Each cell holds at most one thing: nothing, or one of several kinds. Given the content, observations are independent,
and so are cells. The posterior is prior times likelihoods, cell by cell::

    P(k | observations)  ~  P(k) * prod over detectors d of  p_dk^yes_d * (1 - p_dk)^no_d

p_dk is the rate of detections of kind k by d (for nothing: its false alarms); yes_d and no_d count its answers at the
cell. Only these counts matter, so vehicles with the same observations have bitwise equal maps in any order of
reception. Only + - * / and exact float operations are used, for equal bytes on every machine.

Information is in bits. That of a future observation is the mutual information of its answer and the cell's content.
That of past observations is the Kullback-Leibler divergence of the map from the prior; its expectation is the former
(Cover and Thomas, Elements of Information Theory, chapter 2).

**Grid.** Cells are numbered row by row from the south-west; a tile has 4 x 4 cells. The wire carries a pass without
detections as one number per tile with a bit per cell, and a detection as one number per cell.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce

import numpy as np
import numpy.typing as npt

from exchange.arithmetic import LN2
from exchange.channel import loss
from missions.arrows.scenario import DETECTORS, SITES, ArrowsScenario, DetectorTable, KindTable
from remoras.beliefs import Known
from remoras.work import Point

Array = npt.NDArray[np.float64]

TILE = 4
MOST_CELLS, MOST_TILES, MOST_PASSES, MOST_LOOKS = 4096, 256, 32, 64
"""Ranges of numbers on the wire; further observations are not reported."""
N_DETECTORS = 2


def halved(values: Array) -> Array:
    """Sum along the last axis by halving: the same order of additions on every machine."""
    while (n := values.shape[-1]) > 1:
        half = n // 2
        added = values[..., :half] + values[..., half : 2 * half]
        values = np.concatenate([added, values[..., 2 * half :]], axis=-1) if n % 2 else added
    return values[..., 0] if n else np.zeros(values.shape[:-1])


def summed(values: Array) -> float:
    """Sum of numbers, shape (n,), by ``halved``."""
    return float(halved(values))


@dataclass(frozen=True)
class CellGrid:
    """Grid of square cells; ``west_m`` and ``south_m`` give its south-west corner."""

    west_m: float
    south_m: float
    cell_m: float
    n_columns: int
    n_rows: int

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.n_columns * self.n_rows

    @cached_property  # 1 % of a mission
    def x_m(self) -> Array:
        """East coordinates of cell centres, shape (n_cells,)."""
        return np.tile(self.west_m + (np.arange(self.n_columns) + 0.5) * self.cell_m, self.n_rows)

    @cached_property  # 1 % of a mission
    def y_m(self) -> Array:
        """North coordinates of cell centres, shape (n_cells,)."""
        return np.repeat(self.south_m + (np.arange(self.n_rows) + 0.5) * self.cell_m, self.n_columns)

    def centre_m(self, cell: int) -> Point:
        """Centre of a cell."""
        row, column = divmod(cell, self.n_columns)
        return self.west_m + (column + 0.5) * self.cell_m, self.south_m + (row + 0.5) * self.cell_m

    def cell_at(self, point_m: Point) -> int | None:
        """Cell of a point; None outside."""
        column = int((point_m[0] - self.west_m) // self.cell_m)
        row = int((point_m[1] - self.south_m) // self.cell_m)
        inside = 0 <= column < self.n_columns and 0 <= row < self.n_rows
        return row * self.n_columns + column if inside else None

    def near(self, point_m: Point, range_m: float) -> Iterator[int]:
        """Yield cells with centre within a range, by number."""
        reach = int(range_m // self.cell_m) + 1
        column = int((point_m[0] - self.west_m) // self.cell_m)
        row = int((point_m[1] - self.south_m) // self.cell_m)
        for j in range(max(0, row - reach), min(self.n_rows, row + reach + 1)):
            dy_m = self.south_m + (j + 0.5) * self.cell_m - point_m[1]
            for i in range(max(0, column - reach), min(self.n_columns, column + reach + 1)):
                dx_m = self.west_m + (i + 0.5) * self.cell_m - point_m[0]
                if dx_m * dx_m + dy_m * dy_m <= range_m * range_m:
                    yield j * self.n_columns + i

    @property
    def n_tiles(self) -> int:
        """Number of tiles; those at the border may be smaller."""
        return self._tile_columns * -(-self.n_rows // TILE)

    @property
    def _tile_columns(self) -> int:
        return -(-self.n_columns // TILE)

    def tile_of(self, cell: int) -> tuple[int, int]:
        """Tile of a cell, and the cell's bit in it."""
        row, column = divmod(cell, self.n_columns)
        tile = (row // TILE) * self._tile_columns + column // TILE
        return tile, (row % TILE) * TILE + column % TILE

    def cells_of(self, tile: int, mask: int) -> Iterator[int]:
        """Yield cells of a tile whose bits are set; skip bits beyond the border."""
        tile_row, tile_column = divmod(tile, self._tile_columns)
        for bit in range(TILE * TILE):
            row, column = tile_row * TILE + bit // TILE, tile_column * TILE + bit % TILE
            if mask >> bit & 1 and row < self.n_rows and column < self.n_columns:
                yield row * self.n_columns + column


def swept_code(n_pass: int, detector: int, tile: int, mask: int) -> int:
    """Encode a pass without detections over a tile, below 2^30."""
    return ((n_pass * N_DETECTORS + detector) * MOST_TILES + tile) << 16 | mask


def swept_of(code: int) -> tuple[int, int, int]:
    """Decode (detector, tile, mask) from ``swept_code``.

    >>> swept_of(swept_code(31, 1, 255, 65535)), swept_code(31, 1, 255, 65535) < 1 << 30
    ((1, 255, 65535), True)
    """
    return (code >> 24) % N_DETECTORS, code >> 16 & MOST_TILES - 1, code & 0xFFFF


def contact_code(n_look: int, detector: int, cell: int) -> int:
    """Encode a detection at a cell, below 2^19."""
    return (n_look * N_DETECTORS + detector) * MOST_CELLS + cell


def contact_of(code: int) -> tuple[int, int]:
    """Decode (detector, cell) from ``contact_code``.

    >>> contact_of(contact_code(63, 1, 4095)), contact_code(63, 1, 4095) < 1 << 19
    ((1, 4095), True)
    """
    return code // MOST_CELLS % N_DETECTORS, code % MOST_CELLS


def grid_of(scenario: ArrowsScenario) -> CellGrid:
    """Grid of a scenario from the south-west corner of its area; the last cells may extend beyond it."""
    (west_m, east_m), (south_m, north_m), cell_m = scenario.search.x_m, scenario.search.y_m, scenario.search.cell_m
    # The tolerance keeps rounding from adding a column or row.
    n_columns, n_rows = (max(1, math.ceil(m / cell_m - 1e-9)) for m in (east_m - west_m, north_m - south_m))
    return CellGrid(west_m, south_m, cell_m, n_columns, n_rows)


def share_map(grid: CellGrid, finds_m: list[Point], spread_m: float, uniform_share: float) -> Array:
    """Distribution over cells, shape (n_cells,): uniform share, and ``spread_m`` around finds."""
    hills = np.zeros(grid.n_cells)
    # Quartic kernel (1 - d^2 / s^2)^2 within the spread s; sorted, so that sums are equal in any listed order.
    for x_m, y_m in sorted(finds_m):
        dx_m, dy_m = grid.x_m - x_m, grid.y_m - y_m
        height = np.maximum(0.0, 1.0 - (dx_m * dx_m + dy_m * dy_m) / (spread_m * spread_m))
        hills += height * height
    total = summed(hills)
    even = np.full(grid.n_cells, 1.0 / grid.n_cells)
    return even if total == 0.0 else uniform_share * even + (1.0 - uniform_share) * hills / total


def prior_of(scenario: ArrowsScenario) -> Array:
    """Prior by kind and cell, shape (1 + kinds, n_cells); columns sum to 1, nothing first."""
    grid = grid_of(scenario)
    rows = [expected_of(grid, kind, scenario) for kind in scenario.kinds]
    return np.vstack([1.0 - total_of(rows), *rows])


def expected_of(grid: CellGrid, kind: KindTable, scenario: ArrowsScenario) -> Array:
    """Expected number of things of a kind in each cell, shape (n_cells,)."""
    if kind.map:
        return kind.expected * np.array(kind.map, dtype=float).reshape(-1)
    finds_m = [historic.position_m for historic in scenario.historic_find if historic.kind == kind.name]
    return kind.expected * share_map(grid, finds_m, kind.spread_m, kind.uniform_share)


def rates_of(scenario: ArrowsScenario) -> Array:
    """Detection rates, shape (detectors, 1 + kinds), those of an empty cell first."""
    detectors: list[DetectorTable] = [getattr(scenario.detector, name) for name in DETECTORS]
    return np.array(
        [
            [detector.p_false, *(detector.p_detect.get(kind.name, detector.p_false) for kind in scenario.kinds)]
            for detector in detectors
        ]
    )


@dataclass(frozen=True)
class Thing:
    """True content of a cell; ``kind`` counts from 1."""

    kind: int
    name: str
    position_m: Point


@dataclass(frozen=True, eq=False)
class Seafloor:
    """True seafloor for detectors; ``things`` by cell, ``rates`` by detector and kind."""

    grid: CellGrid
    things: dict[int, Thing]
    scenario: ArrowsScenario = field(repr=False)
    rates: Array = field(repr=False)
    seed: int


def draw_seafloor(scenario: ArrowsScenario, seed: int) -> Seafloor:
    """Sample the seafloor of a run."""
    grid, prior = grid_of(scenario), prior_of(scenario)
    names, things = [kind.name for kind in scenario.kinds], dict[int, Thing]()
    occupied = (prior[0] < 1.0).nonzero()[0]
    for cell in map(int, occupied):
        share = loss.uniform(seed, loss.FINDS, cell, 0, 0)
        # One number decides: the cumulated probabilities of the kinds divide [0, 1), nothing gets the rest.
        for number, name in enumerate(names, 1):
            share -= float(prior[number, cell])
            if share < 0.0:
                x_m, y_m = grid.centre_m(cell)
                east, north = (loss.uniform(seed, loss.FINDS, cell, 0, which) - 0.5 for which in (1, 2))
                things[cell] = Thing(number, name, (x_m + east * grid.cell_m, y_m + north * grid.cell_m))
                break
    return Seafloor(grid, things, scenario, rates_of(scenario), seed)


Counts = npt.NDArray[np.int64]
SMALLEST = 1e-250  # lower limit of weights, so that later observations can revise them
N_TERMS = 12  # terms of the logarithm's series; the error is below 1e-15


def log2_of(x: Array) -> Array:
    """Binary logarithm of numbers >= 0; 0 maps to 0, as it only occurs in products with 0.

    By the series of artanh, z + z^3 / 3 + ..., with z = (m - 1) / (m + 1) of the mantissa m.
    """
    mantissa, exponent = np.frexp(np.where(x > 0.0, x, 1.0))
    # Mantissas between 1/sqrt(2) and sqrt(2) keep |z| below 0.172, so that few terms suffice.
    is_low = mantissa < 0.7071067811865476
    mantissa, exponent = np.where(is_low, 2.0 * mantissa, mantissa), exponent - is_low
    z = (mantissa - 1.0) / (mantissa + 1.0)
    squared, series = z * z, np.zeros_like(z)
    for term in range(N_TERMS, -1, -1):
        series = series * squared + 1.0 / (2 * term + 1)
    return np.asarray(exponent + (2.0 / LN2) * z * series)


def posterior(prior: Array, p_yes: Array, n_yes: Counts, n_no: Counts) -> Array:
    """Posterior of each cell, shape (kinds, cells) as ``prior``; columns sum to 1.

    ``p_yes`` (0 to 1, exclusive) has shape (detectors, kinds), ``n_yes`` and ``n_no`` (detectors, cells).
    """
    weights = prior.copy()
    for detector, rates in enumerate(p_yes):
        for counts, chances in ((n_yes[detector], rates), (n_no[detector], 1.0 - rates)):
            most = int(counts.max(initial=0))
            if most == 0:
                continue
            powers = np.ones((most + 1, len(chances)))
            for n in range(1, most + 1):
                powers[n] = powers[n - 1] * chances
                # Only ratios matter; the scaling avoids underflow.
                powers[n] /= powers[n].max()
            weights = np.maximum(weights * powers[counts].T, SMALLEST)
            weights /= total_of(weights)
    return np.asarray(weights / total_of(weights), dtype=np.float64)


def total_of(rows: Array | Sequence[Array]) -> Array:
    """Sum of rows, in their order."""
    return np.asarray(reduce(np.add, rows))


def look_information(chart: Array, rates: Array) -> Array:
    """Mutual information (bits), shape (cells,), of an observation and each cell's content."""
    sure = rates * log2_of(rates) + (1.0 - rates) * log2_of(1.0 - rates)
    p_yes, expected = total_of(chart * rates[:, None]), total_of(chart * sure[:, None])
    p_no = 1.0 - p_yes
    return np.asarray(np.maximum(expected - p_yes * log2_of(p_yes) - p_no * log2_of(p_no), 0.0))


def entropy(chart: Array) -> Array:
    """Entropy of each cell (bits), shape (cells,)."""
    return 0.0 - total_of(chart * log2_of(chart))


def divergence(chart: Array, other: Array) -> float:
    """Kullback-Leibler divergence of a map from another, summed over cells (bits)."""
    return summed(total_of(chart * (log2_of(chart) - log2_of(other))))


def disagreement(charts: list[Array]) -> float:
    """Jensen-Shannon divergence of equally weighted maps, summed over cells (bits).

    >>> one, other = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
    >>> disagreement([one, one]), disagreement([one, other])
    (0.0, 1.0)
    """
    if len(charts) < 2:
        return 0.0
    mean, within = total_of(charts) / len(charts), total_of([entropy(chart) for chart in charts])
    return max(0.0, summed(entropy(mean) - within / len(charts)))


SWEPT, CONTACT = "swept", "contact"  # attributes of vehicles: observations without and with a detection


class Chart:
    """Map updated from known facts; its rows are the possible contents of a cell, an empty cell first."""

    def __init__(self, scenario: ArrowsScenario) -> None:
        self.grid, self.prior, self.rates = grid_of(scenario), prior_of(scenario), rates_of(scenario)
        self.names = scenario.names
        self._sites = [number for number, name in enumerate(self.names) if name in SITES]
        self._seen: dict[tuple[str, str], set[int]] = {}
        self._clear()

    def _clear(self) -> None:
        self._seen.clear()
        self._n_yes = np.zeros((N_DETECTORS, self.grid.n_cells), dtype=np.int64)
        self._n_no = self._n_yes.copy()
        self._shares: Array | None = self.prior

    @property
    def shares(self) -> Array:
        """Posterior, shape (1 + kinds, n_cells); columns sum to 1."""
        if self._shares is None:
            self._shares = posterior(self.prior, self.rates, self._n_yes, self._n_no)
        return self._shares

    @property
    def holds_find(self) -> npt.NDArray[np.bool_]:
        """Cells with a detection by any vehicle, shape (n_cells,)."""
        return np.asarray(self._n_yes.any(axis=0))

    def sites(self, shares: Array) -> Array:
        """Sum of the site kinds in ``shares`` of shape (1 + kinds, ...)."""
        return total_of([np.zeros_like(shares[0]), *shares[self._sites]])

    def update(self, facts: Known, vehicles: Sequence[str]) -> None:
        """Add known observations of some vehicles; recompute after an exclusion."""
        for attribute in (SWEPT, CONTACT):
            for vehicle in vehicles:
                known, seen = facts.values((attribute, vehicle)), self._seen.get((attribute, vehicle), set())
                # An exclusion removes facts, and counts cannot be subtracted without knowing which.
                if len(known) < len(seen):
                    self._clear()
                    self.update(facts, vehicles)
                    return
                if len(known) > len(seen):
                    new = known - seen
                    self.add(attribute, new)
                    self._seen[attribute, vehicle] = seen | new

    def add(self, attribute: str, codes: Iterable[int]) -> None:
        """Add observation codes, each once."""
        for code in codes:
            if attribute == CONTACT:
                detector, cell = contact_of(int(code))
                if cell < self.grid.n_cells:
                    self._n_yes[detector, cell] += 1
            else:
                detector, tile, mask = swept_of(int(code))
                for cell in self.grid.cells_of(tile, mask):
                    self._n_no[detector, cell] += 1
        self._shares = None
