"""The searched sea in square cells, and how looks at cells are put into numbers that go into a packet.

Cells are numbered row by row from the south-west. A tile is 4 x 4 cells. What a detector did not find is told as one
number for a pass over a tile, with a bit for each cell; what it did find, as one number for the cell.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from remoras.work import Point

Array = npt.NDArray[np.float64]

TILE = 4
"""Cells along the side of a tile."""
MOST_CELLS, MOST_TILES, MOST_PASSES, MOST_LOOKS = 4096, 256, 32, 64
"""What numbers on the wire have room for; a detector that has looked more often tells no more."""
N_DETECTORS = 2
"""Kinds of detectors that sweep."""


def halved(values: Array) -> Array:
    """Sums along the last axis, in an order of additions that is the same on every machine: the halves are added."""
    while (n := values.shape[-1]) > 1:
        half = n // 2
        added = values[..., :half] + values[..., half : 2 * half]
        values = np.concatenate([added, values[..., 2 * half :]], axis=-1) if n % 2 else added
    return values[..., 0] if n else np.zeros(values.shape[:-1])


def summed(values: Array) -> float:
    """The sum of numbers, shape (n,); see ``halved``.

    >>> summed(np.array([1.0, 2.0, 4.0]))
    7.0
    """
    return float(halved(values))


@dataclass(frozen=True)
class CellGrid:
    """A rectangle of square cells.

    Attributes:
        west_m, south_m: its south-west corner.
        cell_m: side of a cell.
        n_columns, n_rows: its size.
    """

    west_m: float
    south_m: float
    cell_m: float
    n_columns: int
    n_rows: int

    @property
    def n_cells(self) -> int:
        """How many cells there are."""
        return self.n_columns * self.n_rows

    @cached_property
    def x_m(self) -> Array:
        """East of the centre of each cell, shape (n_cells,)."""
        return np.tile(self.west_m + (np.arange(self.n_columns) + 0.5) * self.cell_m, self.n_rows)

    @cached_property
    def y_m(self) -> Array:
        """North of the centre of each cell, shape (n_cells,)."""
        return np.repeat(self.south_m + (np.arange(self.n_rows) + 0.5) * self.cell_m, self.n_columns)

    def centre_m(self, cell: int) -> Point:
        """The centre of a cell."""
        row, column = divmod(cell, self.n_columns)
        return self.west_m + (column + 0.5) * self.cell_m, self.south_m + (row + 0.5) * self.cell_m

    def cell_at(self, point_m: Point) -> int | None:
        """The cell that holds a point; None outside."""
        column = int((point_m[0] - self.west_m) // self.cell_m)
        row = int((point_m[1] - self.south_m) // self.cell_m)
        inside = 0 <= column < self.n_columns and 0 <= row < self.n_rows
        return row * self.n_columns + column if inside else None

    def near(self, point_m: Point, range_m: float) -> Iterator[int]:
        """Cells whose centre is within a range of a point, in the order of their numbers."""
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
        """How many tiles there are; those at the rim may be smaller."""
        return self._tile_columns * -(-self.n_rows // TILE)

    @property
    def _tile_columns(self) -> int:
        return -(-self.n_columns // TILE)

    def tile_of(self, cell: int) -> tuple[int, int]:
        """Tile of a cell, and the bit of the cell in it.

        >>> CellGrid(0.0, 0.0, 10.0, 8, 8).tile_of(13)
        (1, 5)
        """
        row, column = divmod(cell, self.n_columns)
        tile = (row // TILE) * self._tile_columns + column // TILE
        return tile, (row % TILE) * TILE + column % TILE

    def cells_of(self, tile: int, mask: int) -> Iterator[int]:
        """Cells of a tile whose bits are set; bits beyond the rim are passed over."""
        tile_row, tile_column = divmod(tile, self._tile_columns)
        for bit in range(TILE * TILE):
            row, column = tile_row * TILE + bit // TILE, tile_column * TILE + bit % TILE
            if mask >> bit & 1 and row < self.n_rows and column < self.n_columns:
                yield row * self.n_columns + column


def swept_code(n_pass: int, detector: int, tile: int, mask: int) -> int:
    """A pass of a detector over a tile that found nothing in the cells of the mask, as a number below 2^30."""
    return ((n_pass * N_DETECTORS + detector) * MOST_TILES + tile) << 16 | mask


def swept_of(code: int) -> tuple[int, int, int]:
    """(detector, tile, mask) of a number that ``swept_code`` made.

    >>> swept_of(swept_code(31, 1, 255, 65535)), swept_code(31, 1, 255, 65535) < 1 << 30
    ((1, 255, 65535), True)
    """
    return (code >> 24) % N_DETECTORS, code >> 16 & MOST_TILES - 1, code & 0xFFFF


def contact_code(n_look: int, detector: int, cell: int) -> int:
    """A look of a detector at a cell that found something, as a number below 2^19."""
    return (n_look * N_DETECTORS + detector) * MOST_CELLS + cell


def contact_of(code: int) -> tuple[int, int]:
    """(detector, cell) of a number that ``contact_code`` made.

    >>> contact_of(contact_code(63, 1, 4095)), contact_code(63, 1, 4095) < 1 << 19
    ((1, 4095), True)
    """
    return code // MOST_CELLS % N_DETECTORS, code % MOST_CELLS
