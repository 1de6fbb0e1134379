"""Who had best do what, one job to each: a bottleneck assignment followed by one of minimum cost.

Source: Burkard, Dell'Amico, Martello 2009: linear bottleneck assignment by a threshold, linear sum assignment by
shortest augmenting paths, which is SciPy's.
"""

from __future__ import annotations

from collections.abc import Sequence
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
    import numpy as np  # this takes a third of a second to load, and few strategies need it

    costs = np.array([[np.nan if cost is None else cost for cost in row] for row in costs_ms], dtype=float)
    if np.isnan(costs).all():
        return {}
    costs = costs[:, : 1 + int(np.flatnonzero(~np.isnan(costs).all(axis=0))[-1])]
    rows, columns = np.indices(costs.shape)
    weights = costs * TIE_BREAK + rows * (
        costs.shape[1] - 1 - columns
    )  # ties are least where lower rows have lower columns
    weights[~(costs <= _bottleneck(costs))] = np.nan
    return {int(r): int(c) for r, c in _cheapest(weights)}


def _bottleneck(costs: Costs) -> float:
    """The least cost to which pairs may be limited so that as many rows are assigned as without a limit."""
    import numpy as np

    def n_assigned(limit: float) -> int:
        return len(_cheapest(np.where(costs <= limit, 0.0, np.nan)))

    limits = np.unique(costs[~np.isnan(costs)])
    most = n_assigned(limits[-1])
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if n_assigned(limits[middle]) == most:
            high = middle
        else:
            low = middle + 1
    return float(limits[low])


def _cheapest(weights: Costs) -> Costs:
    """Row and column of each pair so that as many rows as possible have a pair, and the sum of weights is least."""
    import numpy as np
    from scipy.optimize import linear_sum_assignment

    is_pair = ~np.isnan(weights)
    none = 1.0 + min(weights.shape) * weights[is_pair].max(initial=0.0)  # a row more is worth any costs
    pairs: Costs = np.column_stack(linear_sum_assignment(np.where(is_pair, weights, none)))
    found: Costs = pairs[is_pair[pairs[:, 0], pairs[:, 1]]]
    return found
