"""Zigzag surveys: parallel rows over a convex polygon, at equal distances, along its longer side (x if equal).

Corners are in order. The first and last row keep half their distance from the border.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from operator import itemgetter

from exchange.arithmetic import distance, length
from remoras.work import Point

ROUNDING_M = 0.01  # numerical tolerance for the overlap of polygons with a common border


def _crossings(corners: Sequence[Point], axis: int, level: float) -> list[float]:
    crossings = []
    for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
        a, b = ((ax, ay), (bx, by)) if axis == 1 else ((ay, ax), (by, bx))
        # Half open, so that a level through a corner crosses the border once.
        if (a[1] <= level) != (b[1] <= level):
            # Rising order, so that rounding is alike for both polygons beside a border.
            a, b = min(a, b, key=itemgetter(1)), max(a, b, key=itemgetter(1))
            crossings.append(a[0] + (level - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
    return sorted(crossings)


def rectangle(x_m: Point, y_m: Point) -> tuple[Point, Point, Point, Point]:
    """Return the corners between two pairs of borders, anticlockwise from the south-west."""
    (west, east), (south, north) = x_m, y_m
    return (west, south), (east, south), (east, north), (west, north)


def runs_along_x(corners: Sequence[Point]) -> bool:
    """Return True if rows run along x (east), False along y."""
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    return max(xs) - min(xs) >= max(ys) - min(ys)


def rows(corners: Sequence[Point], apart_m: float, inset_m: float) -> list[tuple[Point, Point]]:
    """Return the ends of survey rows, each from the lower to the higher coordinate.

    ``apart_m`` is the greatest row spacing; ``inset_m`` the distance of row ends from the border.

    >>> rows([(100, 100), (100, 350), (350, 350), (350, 100)], 25.0, 12.5)[0]
    ((112.5, 112.5), (337.5, 112.5))
    """
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    along_x = runs_along_x(corners)
    low, high = (min(ys), max(ys)) if along_x else (min(xs), max(xs))
    # The tolerance keeps rounding from adding a row.
    n_rows = max(1, math.ceil((high - low) / apart_m - 1e-9))
    spacing = (high - low) / n_rows
    lines = []
    for row in range(n_rows):
        level = low + (row + 0.5) * spacing
        ends = _crossings(corners, 1 if along_x else 0, level)
        if len(ends) < 2:
            continue
        inset = min(inset_m, (ends[-1] - ends[0]) / 2.0)
        first, last = ends[0] + inset, ends[-1] - inset
        lines.append(((first, level), (last, level)) if along_x else ((level, first), (level, last)))
    return lines


def to_and_fro(lines: Sequence[tuple[Point, Point]], start_m: Point) -> list[Point]:
    """Return waypoints along all lines, from the outer line's end nearest to ``start_m``.

    >>> to_and_fro(rows([(0, 0), (0, 20), (40, 20), (40, 0)], 10.0, 5.0), (0.0, 30.0))
    [(5.0, 15.0), (35.0, 15.0), (35.0, 5.0), (5.0, 5.0)]
    """
    corners_first = [(distance(start_m, lines[r][e]), r, e) for r in (0, len(lines) - 1) for e in (0, 1)]
    _, first_row, first_end = min(corners_first)
    ordered = lines if first_row == 0 else lines[::-1]
    waypoints = []
    for number, line in enumerate(ordered):
        begin = (first_end + number) % 2
        waypoints += [line[begin], line[1 - begin]]
    return waypoints


def length_m(waypoints: Sequence[Point]) -> float:
    """Length of the path along the waypoints."""
    return math.fsum(distance(a, b) for a, b in pairwise(waypoints))


def contains(corners: Sequence[Point], point: Point) -> bool:
    """Return True if the point is inside (even-odd rule); a border counts for the polygon east or north of it."""
    return sum(x > point[0] for x in _crossings(corners, 1, point[1])) % 2 == 1


def overlap(polygon: Sequence[Point], other: Sequence[Point]) -> bool:
    """Return True if convex polygons overlap by over ``ROUNDING_M`` (separating axis theorem).

    >>> overlap([(0, 0), (10, 0), (10, 10), (0, 10)], [(10, 0), (20, 0), (20, 10), (10, 10)])
    False
    """
    for corners in (polygon, other):
        for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
            side_m = length(bx - ax, by - ay)
            if side_m == 0.0:
                continue
            across = (by - ay) / side_m, (ax - bx) / side_m
            own, others = ([x * across[0] + y * across[1] for x, y in points] for points in (polygon, other))
            if min(max(own), max(others)) - max(min(own), min(others)) < ROUNDING_M:
                return False
    return True
