"""Who had best do what, one job to each: a bottleneck assignment followed by one of minimum cost.

Source: Burkard, Dell'Amico, Martello 2009: linear bottleneck assignment by a threshold, linear sum assignment by
shortest augmenting paths.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

TIE_BREAK = 100_000
"""A pair that costs a millisecond more is worse than any fall of ties."""


def assignment(costs_ms: Sequence[Sequence[int | None]]) -> dict[int, int]:
    """Row -> column so that as many rows as possible are assigned, the dearest pair is as cheap as possible, and
    then the sum is least; None forbids a pair. Equals fall the same way in every run.

    >>> assignment([[5, 9], [9, 14]])
    {0: 1, 1: 0}
    >>> assignment([[1, 1], [1, 1]])
    {0: 0, 1: 1}
    """
    pairs = {(r, c): cost for r, row in enumerate(costs_ms) for c, cost in enumerate(row) if cost is not None}
    if not pairs:
        return {}
    limit = _bottleneck(pairs)
    n_columns = 1 + max(c for _, c in pairs)
    weights = {  # ties are least where lower rows have lower columns
        (r, c): cost * TIE_BREAK + r * (n_columns - 1 - c) for (r, c), cost in pairs.items() if cost <= limit
    }
    none = 1 + sum(map(abs, weights.values()))  # a row more is worth any costs
    matrix = [[weights.get((r, c), none) for c in range(n_columns)] for r in range(len(costs_ms))]
    if len(matrix) <= n_columns:
        chosen = list(enumerate(_cheapest(matrix)))
    else:
        chosen = [(r, c) for c, r in enumerate(_cheapest([list(column) for column in zip(*matrix, strict=True)]))]
    return {r: c for r, c in sorted(chosen) if (r, c) in weights}


def _bottleneck(pairs: Mapping[tuple[int, int], int]) -> int:
    """The least cost to which pairs may be limited so that as many rows are assigned as without a limit."""
    limits = sorted(set(pairs.values()))
    most = _n_matched(pairs)
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if _n_matched([pair for pair, cost in pairs.items() if cost <= limits[middle]]) == most:
            high = middle
        else:
            low = middle + 1
    return limits[low]


def _n_matched(pairs: Iterable[tuple[int, int]]) -> int:
    """How many rows can be assigned at once, by augmenting paths."""
    columns: dict[int, list[int]] = {}
    for r, c in pairs:
        columns.setdefault(r, []).append(c)
    row_of: dict[int, int] = {}

    def is_placed(row: int, tried: set[int]) -> bool:
        for column in columns[row]:
            if column not in tried:
                tried.add(column)
                if column not in row_of or is_placed(row_of[column], tried):
                    row_of[column] = row
                    return True
        return False

    return sum(is_placed(row, set()) for row in columns)


def _cheapest(costs: Sequence[Sequence[int]]) -> list[int]:
    """The column of each row so that the sum is least; no more rows than columns.

    Rows come in one by one, each by a shortest path that moves others; ``row_price`` and ``price`` are the dual
    variables, by which no reduced cost is below zero.
    """
    n_columns = len(costs[0])
    row_of: dict[int, int] = {}
    price, row_price = [0] * n_columns, [0] * len(costs)
    for new in range(len(costs)):
        least: dict[int, int] = {}  # reduced cost of the shortest path to each column
        before: dict[int, int | None] = {}  # the column from which that path comes
        left, reached = list(range(n_columns)), list[int]()
        row, length = new, 0
        at: int | None = None
        while True:
            for column in left:
                beyond = length + costs[row][column] - row_price[row] - price[column]
                if column not in least or beyond < least[column]:
                    least[column], before[column] = beyond, at
            at = min(left, key=least.__getitem__)
            length = least[at]
            if at not in row_of:
                break
            left.remove(at)
            reached.append(at)
            row = row_of[at]
        row_price[new] += length
        for column in reached:
            row_price[row_of[column]] += length - least[column]
            price[column] -= length - least[column]
        while at is not None:
            came = before[at]
            row_of[at] = new if came is None else row_of[came]
            at = came
    chosen = {row: column for column, row in row_of.items()}
    return [chosen[row] for row in range(len(costs))]
