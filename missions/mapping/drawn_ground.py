"""Random areas and fleets by seed, for the held-out split of a benchmark: pieces of a random rectangle."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from exchange.channel.loss import GROUNDS, uniform

MAPPERS = (3, 4)  # mapping vehicles; with the surface vehicle, the size of the smallest measured networks
PIECES = (5, 13)
WIDTHS, CELLS = (12, 26), (240, 480)
LEAST_SIDE = 2  # shortest side of a piece, in cells

Piece = tuple[int, int, int, int]  # column, row, width and height, in cells of the rectangle


def drawn_ground(tables: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Randomise areas and fleet of a scenario with ``fleet.copies_of`` and one group with areas."""
    # The order of the draws below is part of the split: another order makes other scenarios from the same seeds.
    draws, drawn = _draws(seed), deepcopy(dict(tables))
    cell_m, (x_m, y_m) = drawn["world"]["cell_m"], (drawn["world"]["x_m"], drawn["world"]["y_m"])
    n_across, n_up = (int((high - low) / cell_m) for low, high in (x_m, y_m))
    width = _whole(draws, *WIDTHS)
    height = min(n_up, round(_whole(draws, *CELLS) / width))
    left_m = x_m[0] + cell_m * _whole(draws, 0, n_across - width)
    low_m = y_m[0] + cell_m * _whole(draws, 0, n_up - height)
    pieces = _cut((0, 0, width, height), _whole(draws, *PIECES), draws)
    room, mappers = _whole(draws, 1, 2), _whole(draws, *MAPPERS)
    names = [f"piece {number:02d}" for number in range(1, len(pieces) + 1)]
    roles = [name.title().replace(" ", "") for name in names]
    drawn["area"] = [
        {
            "name": name,
            "corners_m": [
                [left_m + cell_m * x, low_m + cell_m * y]
                for x, y in ((west, south), (west, south + high), (west + wide, south + high), (west + wide, south))
            ],
        }
        for name, (west, south, wide, high) in zip(names, pieces, strict=True)
    ]
    former = set[str]()
    for group in drawn["group"]:
        jobs = [role["name"] for role in group["role"] if "job" in role]
        former.update(jobs)
        if jobs:
            group["role"] = [role for role in group["role"] if "job" not in role] + [
                {"name": role, "minimum": 1, "maximum": room, "job": name}
                for role, name in zip(roles, names, strict=True)
            ]
    n_others = 0
    for vehicle in drawn["vehicle"]:
        able = vehicle["playable_roles"]
        kept = [role for role in able if role not in former]
        vehicle["playable_roles"] = kept + (roles if len(kept) < len(able) else [])
        n_others += len(kept) == len(able)
    drawn["fleet"]["size"] = n_others + mappers
    return drawn


def _draws(seed: int) -> Iterator[float]:
    number = 0
    while True:
        yield uniform(seed, GROUNDS, number, 0, 1)
        number += 1


def _whole(draws: Iterator[float], least: int, most: int) -> int:
    return least + int((most - least + 1) * next(draws))


def _cut(whole: Piece, n: int, draws: Iterator[float]) -> list[Piece]:
    pieces = [whole]
    while len(pieces) < n:
        # The largest piece is cut across its longer side, so that pieces stay alike and compact.
        piece = max(pieces, key=lambda piece: (piece[2] * piece[3], piece))
        pieces.remove(piece)
        west, south, wide, high = piece
        first = _whole(draws, LEAST_SIDE, max(wide, high) - LEAST_SIDE)
        if wide >= high:
            pieces += [(west, south, first, high), (west + first, south, wide - first, high)]
        else:
            pieces += [(west, south, wide, first), (west, south + first, wide, high - first)]
    return sorted(pieces)
