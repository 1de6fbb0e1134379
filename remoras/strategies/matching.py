"""Who had best do what, one job to each: a bottleneck assignment followed by one of minimum cost.

Source: Burkard, Dell'Amico, Martello 2009: linear bottleneck assignment by a threshold, linear sum assignment by
shortest augmenting paths, which is SciPy's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

TIE_BREAK = 100_000
"""A pair that costs a millisecond more is worse than any fall of ties."""
Pair = tuple[int, int]


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
    shape = len(costs_ms), 1 + max(c for _, c in pairs)
    limit = _bottleneck(pairs, shape)
    weights = {  # ties are least where lower rows have lower columns
        (r, c): cost * TIE_BREAK + r * (shape[1] - 1 - c) for (r, c), cost in pairs.items() if cost <= limit
    }
    return {r: c for r, c in _cheapest(weights, shape) if (r, c) in weights}


def _bottleneck(pairs: Mapping[Pair, int], shape: Pair) -> int:
    """The least cost to which pairs may be limited so that as many rows are assigned as without a limit."""

    def n_assigned(limit: int) -> int:
        weights = {pair: 0 for pair, cost in pairs.items() if cost <= limit}
        return sum(pair in weights for pair in _cheapest(weights, shape))

    limits = sorted(set(pairs.values()))
    most = n_assigned(limits[-1])
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if n_assigned(limits[middle]) == most:
            high = middle
        else:
            low = middle + 1
    return limits[low]


def _cheapest(weights: Mapping[Pair, int], shape: Pair) -> list[Pair]:
    """Row and column of each pair so that as few as possible lack in ``weights``, and their sum is least."""
    import numpy as np  # these take a third of a second to load, and few strategies need them
    from scipy.optimize import linear_sum_assignment

    matrix = np.full(shape, 1.0 + min(shape) * max(weights.values(), default=0))  # a row more is worth any costs
    for pair, weight in weights.items():
        matrix[pair] = weight
    rows, columns = linear_sum_assignment(matrix)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))
