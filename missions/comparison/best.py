"""The best of several: who can be told from it, by a test whose error counts all of them together.

The winner of a column wins by luck, too. A test of each against the winner of the same data, corrected for k - 1 tests,
tells one of ten equal treatments from the best in 14 % of studies. Here all ordered pairs are one family:

    T(i, j) = mean of (x_i - x_j) over the repeats / its standard error,    M = the largest T(i, j) of all pairs.

Treatments that are equal could have had each other's values of a repeat. So M is compared with itself after the values
of every repeat were dealt anew, at random, among the treatments (max-T, Westfall and Young 1993): the probability that
anybody is told from anybody where all are equal is exact, whatever the distribution and however few repeats there are.
With studentised differences it also holds, as repeats grow, where means are equal and spreads are not (Chung and Romano
2013). Hsu's multiple comparisons with the best (1984) have smaller bounds, but say "not the only best" of a tie.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from missions.statistics import RESAMPLES, Array, generator

MOST_LISTED = 4096
"""Ways to deal the values that are listed; of more, ``RESAMPLES`` are drawn."""
MOST_AT_ONCE = 2_000_000
"""Numbers that are held at once."""
ROUNDING = 1e-9


def worse_p(values: Array, rivals: Sequence[bool]) -> list[float]:
    """Probability, of every treatment, of being worse by that much than one of its rivals if all were equal.

    Args:
        values: higher is worse; repeats down, treatments across.
        rivals: treatments that others are told from.

    Returns:
        Corrected for all pairs; below 0.05 a treatment is told from the best, in at most 5 % of studies of equal ones.

    >>> worse_p(np.array([[0.0, 1.0]] * 6), [True, True])  # of 2^6 ways to deal, two are as one-sided
    [1.0, 0.03125]
    """
    n, k = values.shape
    if n < 2 or k < 2:
        return [1.0] * k
    centred = values - values.mean(axis=1, keepdims=True)
    against = _studentised(centred[None])[0]
    against[:, ~np.asarray(rivals, dtype=bool)] = -np.inf
    np.fill_diagonal(against, -np.inf)
    own = against.max(axis=1)
    n_ways = math.factorial(k) ** n if n * k <= 64 else math.inf
    dealt = _listed(n, k) if n_ways <= MOST_LISTED else _drawn(n, k)
    reached, total = (np.zeros(k), 0) if n_ways <= MOST_LISTED else (np.ones(k), 1)
    for order in dealt:
        statistics = _studentised(np.take_along_axis(centred[None], order, axis=2))
        statistics[:, range(k), range(k)] = -np.inf
        largest = statistics.max(axis=(1, 2))
        reached += (largest[:, None] >= own - ROUNDING * np.abs(np.where(np.isfinite(own), own, 0.0))).sum(axis=0)
        total += len(order)
    return [float(count) / total for count in reached]


def _studentised(values: Array) -> Array:
    """T(i, j) of every set of values; infinite for a difference that is the same in all repeats."""
    n = values.shape[1]
    means = values.mean(axis=1)
    rest = values - means[:, None, :]
    products = np.matmul(rest.transpose(0, 2, 1), rest)
    own = np.einsum("rii->ri", products)
    squares = own[:, :, None] + own[:, None, :] - 2.0 * products
    differences = means[:, :, None] - means[:, None, :]
    scale = ROUNDING * max(float(np.abs(values).max()), 1e-300)
    differences[np.abs(differences) <= scale] = 0.0
    steady = squares <= n * scale**2
    errors = np.sqrt(np.where(steady, 1.0, squares) / (n * (n - 1)))
    alike = np.where(differences == 0.0, 0.0, np.copysign(np.inf, differences))
    studentised: Array = np.where(steady, alike, differences / errors)
    return studentised


def _listed(n: int, k: int) -> Iterator[npt.NDArray[np.int64]]:
    """All ways to deal the values of every repeat among the treatments."""
    orders = np.array(list(itertools.permutations(range(k))))
    yield orders[np.array(list(itertools.product(range(len(orders)), repeat=n)))]


def _drawn(n: int, k: int) -> Iterator[npt.NDArray[np.int64]]:
    """Ways to deal them that are drawn."""
    draws, left = generator(), RESAMPLES - 1
    while left:
        size = min(left, max(1, MOST_AT_ONCE // (n * k)))
        yield draws.random((size, n, k)).argsort(axis=2)
        left -= size


@lru_cache(maxsize=256)
def least_p(n: int, k: int) -> float:
    """The smallest probability that ``worse_p`` can give of k treatments in n repeats.

    >>> least_p(5, 2)
    0.0625
    """
    return min(worse_p(np.tile(2.0 ** np.arange(k), (n, 1)), [True] * k))
