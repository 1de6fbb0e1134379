"""Who had best do what, one job to each: a bottleneck assignment followed by one of minimum cost.

Source: Burkard, Dell'Amico, Martello 2009: linear bottleneck assignment by a threshold, with as many pairs as
augmenting paths can make; linear sum assignment by shortest augmenting paths, in the rectangular form of Crouse 2016.
SciPy has the same, and is asked where there are many pairs: to load it takes a third as long as a whole mission.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

TIE_BREAK = 100_000
"""A pair that costs a millisecond more is worse than any fall of ties."""
MANY = 20_000
"""Pairs times rows (or columns, if these are fewer) from which on SciPy is asked: about 10 ms of this module."""

Costs = Sequence[Sequence[float]]


def assignment(costs_ms: Sequence[Sequence[int | None]]) -> dict[int, int]:
    """Row -> column so that as many rows as possible are assigned, the dearest pair is as cheap as possible, and
    then the sum is least; None forbids a pair. Equals fall the same way in every run.

    >>> assignment([[5, 9], [9, 14]])
    {0: 1, 1: 0}
    >>> assignment([[1, 1], [1, 1]])
    {0: 0, 1: 1}
    """
    limits = sorted({cost for row in costs_ms for cost in row if cost is not None})
    if not limits:
        return {}
    n_columns = 1 + max(column for row in costs_ms for column, cost in enumerate(row) if cost is not None)
    limit = _bottleneck(limits, lambda most: _n_pairs(costs_ms, most))
    weights = [  # ties are least where lower rows have lower columns
        [
            None if cost is None or cost > limit else cost * TIE_BREAK + row * (n_columns - 1 - column)
            for column, cost in enumerate(costs[:n_columns])
        ]
        for row, costs in enumerate(costs_ms)
    ]
    fewer = min(len(costs_ms), n_columns)
    none = 1 + fewer * max(weight for of in weights for weight in of if weight is not None)  # a row more is worth any
    pairs = least([[none if weight is None else weight for weight in of] for of in weights])
    return {row: column for row, column in pairs.items() if weights[row][column] is not None}


def _bottleneck(limits: Sequence[int], n_pairs: Callable[[int], int]) -> int:
    """The least cost to which pairs may be limited so that as many rows are assigned as without a limit."""
    most = n_pairs(limits[-1])
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if n_pairs(limits[middle]) == most:
            high = middle
        else:
            low = middle + 1
    return limits[low]


def _n_pairs(costs_ms: Sequence[Sequence[int | None]], limit: int) -> int:
    """How many rows can have a column of their own that costs no more than a limit, by augmenting paths."""
    allowed = [[c for c, cost in enumerate(row) if cost is not None and cost <= limit] for row in costs_ms]
    column_of: dict[int, int] = {}
    row_of: dict[int, int] = {}
    for begin in range(len(allowed)):
        before: dict[int, int] = {}  # the row from which each column is reached
        rows = [begin]
        while rows:
            row = rows.pop()
            for column in allowed[row]:
                if column in before:
                    continue
                before[column] = row
                if column in row_of:
                    rows.append(row_of[column])
                    continue
                rows.clear()
                _exchange(begin, column, before, column_of, row_of)
                break
    return len(column_of)


def _exchange(
    begin: int, column: int, before: Mapping[int, int], column_of: dict[int, int], row_of: dict[int, int]
) -> None:
    """Give each row on the path from a row to a column the next column on it."""
    row = -1
    while row != begin:
        row = before[column]
        was = column_of.get(row, -1)
        row_of[column], column_of[row], column = row, column, was


def least(costs: Costs) -> dict[int, int]:
    """Row -> column, in the order of rows, so that the sum is least; as many as the fewer of the two.

    Args:
        costs: whole numbers, one of each row and column.
    """
    n_rows, n_columns = len(costs), len(costs[0])
    if n_rows * n_columns * min(n_rows, n_columns) > MANY:
        from scipy.optimize import linear_sum_assignment

        return dict(zip(*(indices.tolist() for indices in linear_sum_assignment(costs)), strict=True))
    if n_rows > n_columns:
        turned = least(list(zip(*costs, strict=True)))
        return dict(sorted((row, column) for column, row in turned.items()))
    row_prices, column_prices = [0.0] * n_rows, [0.0] * n_columns
    column_of: dict[int, int] = {}
    row_of: dict[int, int] = {}
    for row in range(n_rows):
        _augment(costs, row, row_prices, column_prices, column_of, row_of)
    return dict(sorted(column_of.items()))


def _augment(
    costs: Costs,
    begin: int,
    row_prices: list[float],
    column_prices: list[float],
    column_of: dict[int, int],
    row_of: dict[int, int],
) -> None:
    """Give a row a column along the shortest path of exchanges: Dijkstra's, over costs less the prices of both ends."""
    shortest = [math.inf] * len(column_prices)
    before: dict[int, int] = {}  # the row from which each column is reached
    open_columns = list(range(len(column_prices) - 1, -1, -1))
    reached_rows, reached_columns = [begin], list[int]()
    row, way, column = begin, 0.0, -1
    while column < 0:
        nearest, found = math.inf, -1
        for place, other in enumerate(open_columns):
            then = way + costs[row][other] - row_prices[row] - column_prices[other]
            if then < shortest[other]:
                shortest[other], before[other] = then, row
            ends = other not in row_of
            if shortest[other] < nearest or (ends and shortest[other] == nearest):
                nearest, found = shortest[other], place
        way, last = nearest, open_columns.pop()
        at = last
        if found < len(open_columns):
            at, open_columns[found] = open_columns[found], last
        if at not in row_of:
            column = at
        else:
            row = row_of[at]
            reached_rows.append(row)
        reached_columns.append(at)
    row_prices[begin] += way
    for other in reached_rows[1:]:
        row_prices[other] += way - shortest[column_of[other]]
    for other in reached_columns:
        column_prices[other] -= way - shortest[other]
    _exchange(begin, column, before, column_of, row_of)
