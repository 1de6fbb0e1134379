"""Grounds drawn from seeds, for the split of a benchmark by which strategies are judged.

A drawn ground is a given one with other areas: the pieces of a drawn rectangle, cut across again and again. How many
they are, whether each has room for two vehicles, and how many vehicles map them is drawn, too. The same seed gives the
same ground.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from exchange.acoustics.loss import GROUNDS, uniform

MAPPERS = (3, 4)
"""Vehicles that map; with the surface vehicle as many as the least of the measured networks has nodes."""
PIECES = (5, 13)
WIDTHS, CELLS = (12, 26), (240, 480)
"""Least and most cells of a side of the rectangle, and of all of it."""
LEAST_SIDE = 2
"""Fewest cells of a side of a piece."""

Piece = tuple[int, int, int, int]
"""Column, row, width and height, in cells of the rectangle."""


def drawn_ground(
    tables: Mapping[str, Any],
    seed: int,
    n_mappers: tuple[int, int] = MAPPERS,
    n_pieces: tuple[int, int] = PIECES,
    n_cells: tuple[int, int] = CELLS,
) -> dict[str, Any]:
    """The tables of a scenario with drawn areas and a drawn fleet.

    Args:
        tables: of a scenario of this mission with ``fleet.copies_of``, and one group with areas.
        seed: of the draws, 0 to 2^62.
        n_mappers, n_pieces, n_cells: least and most of what is drawn.
    """
    draws, found = _draws(seed), deepcopy(dict(tables))
    cell_m, (x_m, y_m) = found["world"]["cell_m"], (found["world"]["x_m"], found["world"]["y_m"])
    n_across, n_up = (int((high - low) / cell_m) for low, high in (x_m, y_m))
    width = _whole(draws, *WIDTHS)
    height = min(n_up, round(_whole(draws, *n_cells) / width))
    left_m = x_m[0] + cell_m * _whole(draws, 0, n_across - width)
    low_m = y_m[0] + cell_m * _whole(draws, 0, n_up - height)
    pieces = _cut((0, 0, width, height), _whole(draws, *n_pieces), draws)
    room, mappers = _whole(draws, 1, 2), _whole(draws, *n_mappers)
    names = [f"piece {number:02d}" for number in range(1, len(pieces) + 1)]
    roles = [name.title().replace(" ", "") for name in names]
    found["area"] = [
        {
            "name": name,
            "corners_m": [
                [left_m + cell_m * x, low_m + cell_m * y]
                for x, y in ((at, on), (at, on + high), (at + wide, on + high), (at + wide, on))
            ],
        }
        for name, (at, on, wide, high) in zip(names, pieces, strict=True)
    ]
    former = set[str]()
    for group in found["group"]:
        jobs = [role["name"] for role in group["role"] if "job" in role]
        former.update(jobs)
        if jobs:
            group["role"] = [role for role in group["role"] if "job" not in role] + [
                {"name": role, "minimum": 1, "maximum": room, "job": name}
                for role, name in zip(roles, names, strict=True)
            ]
    n_others = 0
    for vehicle in found["vehicle"]:
        able = vehicle["playable_roles"]
        kept = [role for role in able if role not in former]
        vehicle["playable_roles"] = kept + (roles if len(kept) < len(able) else [])
        n_others += len(kept) == len(able)
    found["fleet"]["size"] = n_others + mappers
    return found


def _draws(seed: int) -> Iterator[float]:
    """Numbers in [0, 1), one after another."""
    number = 0
    while True:
        yield uniform(seed, GROUNDS, number, 0, 1)
        number += 1


def _whole(draws: Iterator[float], least: int, most: int) -> int:
    """A drawn whole number of a range, both of whose ends are in it."""
    return least + int((most - least + 1) * next(draws))


def _cut(whole: Piece, n: int, draws: Iterator[float]) -> list[Piece]:
    """A rectangle in pieces: always the largest is cut across its longer side.

    Args:
        whole: the rectangle.
        n: pieces; draws: where each cut is.
    """
    pieces = [whole]
    while len(pieces) < n:
        piece = max(pieces, key=lambda piece: (piece[2] * piece[3], piece))
        pieces.remove(piece)
        at, on, wide, high = piece
        first = _whole(draws, LEAST_SIDE, max(wide, high) - LEAST_SIDE)
        if wide >= high:
            pieces += [(at, on, first, high), (at + first, on, wide - first, high)]
        else:
            pieces += [(at, on, wide, first), (at, on + first, wide, high - first)]
    return sorted(pieces)
