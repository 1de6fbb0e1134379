"""Statistics of repeated runs: Student's and Wilson's intervals, paired tests, effect sizes.

Other intervals are in ``missions/comparison/intervals.py``. All draws are seeded: the same runs give the same figures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import stats

RESAMPLES = 2000
CONFIDENCE = 0.95
SEED = 20110901

Interval = tuple[float, float]
Array = npt.NDArray[np.float64]


def generator() -> np.random.Generator:
    """The generator of all draws of statistics, at its start."""
    return np.random.Generator(np.random.Philox(SEED))


def t_half_width(values: Sequence[float]) -> float:
    """Half-width of Student's 95 % interval of the mean; for stopping rules, since it is quick.

    >>> round(t_half_width([1.0, 2.0, 3.0, 4.0]), 4)  # 3.18245 * 1.29099 / 2
    2.0543
    """
    spread = float(np.std(values, ddof=1))
    return float(stats.t.ppf((1.0 + CONFIDENCE) / 2.0, len(values) - 1)) * spread / math.sqrt(len(values))


def wilson_interval(successes: int, n: int) -> Interval:
    """95 % interval of a success rate (Wilson 1927); useful at 0 and at n successes too.

    >>> tuple(round(bound, 4) for bound in wilson_interval(8, 10))  # Brown, Cai and DasGupta 2001, equation 4
    (0.4902, 0.9433)
    >>> tuple(round(bound, 4) for bound in wilson_interval(0, 20))
    (0.0, 0.1611)
    """
    found = stats.binomtest(successes, n).proportion_ci(CONFIDENCE, method="wilson")
    return float(found.low), float(found.high)


def sign_flips(n: int) -> Array:
    """Ways to flip the signs of n pairs, a row each: all of them up to 12 pairs, else the identity and seeded draws."""
    if n <= 12:
        return np.where((np.arange(2**n)[:, None] >> np.arange(n)) & 1, -1.0, 1.0)
    drawn = generator().random((2 * RESAMPLES, n))
    drawn[0] = 1.0
    return np.where(drawn < 0.5, -1.0, 1.0)


def step_down_p(differences: npt.ArrayLike) -> list[float]:
    """Two-sided p of mean paired differences, corrected for their number.

    If two treatments are alike, the sign of their difference is chance in each repeat (Fisher 1935). All differences of
    a repeat are flipped together, so that their dependence is kept. The statistic is ``|sum d| / sqrt(sum d^2)``, a
    monotone function of Student's t whose scale no flip changes. Step-down (Romano and Wolf 2005, algorithm 1; p values
    as in Romano and Wolf 2016): each difference is compared with the largest of those that are not clearer than itself,
    so clear differences take nothing from the others. SciPy has sign flips of a single sample only.

    Args:
        differences: repeats down, comparisons across; 0 where a repeat has no pair.

    >>> step_down_p([[1.0], [2.0], [3.0], [4.0]])  # of 16 flips only + + + + and - - - - reach the sum
    [0.125]
    >>> step_down_p([[9.0, 1.0], [9.1, 2.0], [9.2, 3.0], [9.0, -2.5]])  # 2 / 16; then the second by itself, 8 / 16
    [0.125, 0.5]
    """
    sample = np.asarray(differences, dtype=float)
    scale = np.sqrt((sample**2).sum(axis=0))
    sample = sample / np.where(scale > 0.0, scale, 1.0)
    observed = np.abs(sample.sum(axis=0))
    order = np.argsort(-observed, kind="stable")
    flips, reached = sign_flips(len(sample)), np.zeros(len(order))
    for some in np.array_split(flips, 1 + len(flips) // 256):  # all at once are a gigabyte of 10,000 comparisons
        flipped = np.abs(some @ sample[:, order])
        largest = np.maximum.accumulate(flipped[:, ::-1], axis=1)[:, ::-1]
        reached += (largest >= observed[order] * (1.0 - 1e-9)).sum(axis=0)
    corrected = np.empty(len(order))
    corrected[order] = np.maximum.accumulate(reached / len(flips))
    return [float(value) for value in corrected]


def least_p(n: int) -> float:
    """The smallest p that ``step_down_p`` can give for n pairs.

    >>> least_p(5), least_p(10)
    (0.0625, 0.001953125)
    """
    return 2.0 / 2**n if 1 <= n <= 12 else 0.5 / RESAMPLES if n else 1.0


def effect_size(values: Sequence[float], baseline: Sequence[float]) -> float | None:
    """Cohen's d with the mean variance of the two (Lakens 2013, equation 10); None without any spread.

    >>> round(effect_size([2.0, 3.0, 4.0], [1.0, 2.0, 3.0]), 4)
    1.0
    """
    a, b = np.asarray(values, dtype=float), np.asarray(baseline, dtype=float)
    spread = math.sqrt((a.var(ddof=1) + b.var(ddof=1)) / 2.0) if len(a) > 1 else 0.0
    return float(a.mean() - b.mean()) / spread if spread > 0.0 else None


def pairing_gain(values: Sequence[float], baseline: Sequence[float]) -> float | None:
    """How many times fewer runs pairing needed: variance of the difference unpaired over paired.

    >>> pairing_gain([1.0, 2.0, 3.0], [2.0, 4.0, 6.0])  # (1 + 4) / 1
    5.0
    """
    a, b = np.asarray(values, dtype=float), np.asarray(baseline, dtype=float)
    paired = float((a - b).var(ddof=1)) if len(a) > 1 else 0.0
    return float(a.var(ddof=1) + b.var(ddof=1)) / paired if paired > 0.0 else None
