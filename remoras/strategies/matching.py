"""Who had best do what, one job to each: a bottleneck assignment followed by one of minimum cost.

Source: Burkard, Dell'Amico, Martello 2009: linear bottleneck assignment by a threshold, linear sum assignment by
shortest augmenting paths, which is SciPy's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Costs = NDArray[Any]

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
    import numpy as np  # this and SciPy take a third of a second to load, and few strategies need them
    from scipy.optimize import linear_sum_assignment

    costs = np.array([[np.nan if cost is None else cost for cost in row] for row in costs_ms], dtype=float)
    is_pair = ~np.isnan(costs)
    limits = np.unique(costs[is_pair])
    if not limits.size:
        return {}
    costs = costs[:, : 1 + int(is_pair.any(axis=0).nonzero()[0][-1])]
    n_rows, n_columns = costs.shape

    def cheapest(weights: Costs, none: float) -> tuple[Costs, Costs]:
        """Row and column of each pair, where one that costs ``none`` is none."""
        rows, columns = linear_sum_assignment(weights)
        is_given = weights[rows, columns] != none
        return rows[is_given], columns[is_given]

    def n_assigned(limit: float) -> int:
        return len(cheapest(np.where(costs <= limit, 0.0, 1.0), 1.0)[0])

    is_allowed = costs <= _bottleneck(limits, n_assigned)
    weights = costs * TIE_BREAK  # ties are least where lower rows have lower columns
    weights += np.arange(n_rows)[:, None] * np.arange(n_columns - 1, -1, -1)
    none = 1.0 + min(n_rows, n_columns) * weights[is_allowed].max()  # a row more is worth any costs
    rows, columns = cheapest(np.where(is_allowed, weights, none), none)
    return dict(zip(rows.tolist(), columns.tolist(), strict=True))


def _bottleneck(limits: Costs, n_assigned: Callable[[float], int]) -> float:
    """The least cost to which pairs may be limited so that as many rows are assigned as without a limit."""
    most = n_assigned(limits[-1])
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if n_assigned(limits[middle]) == most:
            high = middle
        else:
            low = middle + 1
    return float(limits[low])
