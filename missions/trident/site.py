"""Site of a run: seabed blocks in tiles, and the objects in them.

One object is the target, the others are decoys. Positions are sampled by seed and number in a separate stream.
Strategies, losses and faults never move an object, and more decoys leave the others unchanged.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from exchange.arithmetic import distance
from exchange.channel import loss
from remoras.work import Point

Tile = tuple[int, int]
"""(column, row) of a tile of the world grid."""
APART_M = 35.0
"""Least distance between objects where there is room."""
RIM_M = 10.0
"""Least distance of an object from the border of its block."""
TARGET = "target"
"""Name of the target in tables."""
DRAWS = 64
"""Trials for a place before objects may lie closer."""


@dataclass(frozen=True)
class SeabedBlock:
    """Rectangle of the seabed with tiles of side ``tile_m``."""

    name: str
    west_m: float
    south_m: float
    east_m: float
    north_m: float
    tile_m: float

    @property
    def centre_m(self) -> Point:
        """Centre."""
        return (self.west_m + self.east_m) / 2.0, (self.south_m + self.north_m) / 2.0

    @property
    def outline_m(self) -> tuple[Point, ...]:
        """Corners."""
        west, south, east, north = self.west_m, self.south_m, self.east_m, self.north_m
        return (west, south), (east, south), (east, north), (west, north)

    @cached_property
    def tiles(self) -> tuple[Tile, ...]:
        """Tiles with centre in the block, row by row from the south-west; facts use these indices.

        >>> SeabedBlock("north", 0.0, 0.0, 40.0, 20.0, 20.0).tiles
        ((0, 0), (1, 0))
        """
        size_m = self.tile_m
        columns = range(math.ceil(self.west_m / size_m - 0.5), math.ceil(self.east_m / size_m - 0.5))
        rows = range(math.ceil(self.south_m / size_m - 0.5), math.ceil(self.north_m / size_m - 0.5))
        return tuple((column, row) for row in rows for column in columns)

    def centre_of(self, number: int) -> Point:
        """Centre of a tile."""
        column, row = self.tiles[number]
        return (column + 0.5) * self.tile_m, (row + 0.5) * self.tile_m


@dataclass(frozen=True, slots=True)
class Lying:
    """True object on the seabed; ``name`` appears in tables only."""

    name: str
    position_m: Point
    is_target: bool


@dataclass(frozen=True)
class Site:
    """Blocks and objects of a run; ``transponder_m`` is None without a transponder."""

    blocks: tuple[SeabedBlock, ...]
    objects: tuple[Lying, ...] = ()
    transponder_m: Point | None = None
    transponder_range_m: float = 0.0
    seed: int = 0
    numbers: Mapping[Tile, tuple[str, int]] = field(init=False, repr=False, compare=False)
    """Block and index in it of every tile."""

    def __post_init__(self) -> None:
        numbers = {tile: (block.name, n) for block in self.blocks for n, tile in enumerate(block.tiles)}
        object.__setattr__(self, "numbers", numbers)

    def below(self, at_m: Point, reach_m: float) -> list[Tile]:
        """Return tiles of blocks with centre within ``reach_m`` of a place."""
        if not self.blocks:
            return []
        size_m, (x_m, y_m) = self.blocks[0].tile_m, at_m
        found = []
        for column in range(math.floor((x_m - reach_m) / size_m), math.floor((x_m + reach_m) / size_m) + 1):
            for row in range(math.floor((y_m - reach_m) / size_m), math.floor((y_m + reach_m) / size_m) + 1):
                dx_m, dy_m = (column + 0.5) * size_m - x_m, (row + 0.5) * size_m - y_m
                if dx_m * dx_m + dy_m * dy_m <= reach_m * reach_m and (column, row) in self.numbers:
                    found.append((column, row))
        return found

    def nearest(self, at_m: Point) -> tuple[float, int] | None:
        """Return distance and number of the nearest object; None without objects."""
        return min(((distance(one.position_m, at_m), n) for n, one in enumerate(self.objects)), default=None)


def lying(blocks: Sequence[SeabedBlock], target_m: Point | None, n_decoys: int, seed: int) -> tuple[Lying, ...]:
    """Return the target and the decoys of a run; ``target_m`` None means a random place."""
    found: list[Lying] = []
    for number in range(1 + n_decoys):
        name = f"decoy {number}" if number else TARGET
        at_m = target_m if target_m is not None and not number else _drawn_m(blocks, number, seed, found)
        found.append(Lying(name, at_m, not number))
    return tuple(found)


def _drawn_m(blocks: Sequence[SeabedBlock], number: int, seed: int, others: Sequence[Lying]) -> Point:
    """First sampled place clear of the others; the last trial if none is."""
    at_m = (0.0, 0.0)
    for trial in range(DRAWS):
        which, east, north = (loss.uniform(seed, loss.FINDS, number, trial, draw) for draw in range(3))
        block = blocks[int(which * len(blocks))]
        width_m, height_m = (max(0.0, side - 2.0 * RIM_M) for side in _sides_m(block))
        x_m, y_m = block.centre_m
        at_m = x_m + (east - 0.5) * width_m, y_m + (north - 0.5) * height_m
        if all(distance(at_m, other.position_m) >= APART_M for other in others):
            break
    return at_m


def _sides_m(block: SeabedBlock) -> tuple[float, float]:
    return block.east_m - block.west_m, block.north_m - block.south_m
