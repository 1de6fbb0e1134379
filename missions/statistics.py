"""Statistics of repeated runs: Student's and Wilson's intervals, paired tests, effect sizes.

All draws are seeded: the same runs give the same figures.

Intervals of means and of differences, or the reason why there is none.

**Means.** Let one run in ten be of a slow kind. A sample of n runs has none of that kind with probability 0.9^n: 0.43
at n = 8, 0.12 at 20. Such a sample looks like one of a fleet without slow runs, so no interval covers the mean of both
in 95 % (Bahadur and Savage 1956). Below ``MANY`` = 30 runs (0.9^30 = 0.04) a mean therefore has no interval, and tables
print the least and the largest value. From 30 on it is Student's. At the side of a long tail it ends at the farther of
Student's bound and of the bootstrap-t bound at ``TAIL`` (Hall 1988; Efron and Tibshirani 1993, section 12.5), a share
that was fitted to normal, lognormal and exponential values.

**Differences of pairs.** A paired difference of two treatments that are alike but for a shift is symmetric about the
shift, also where one run in ten of each is slow. The interval holds all shifts that sign flips do not refute at 5 %:
the means of all subsets of the differences, without the 2.5 % at either end (Hartigan 1969). It is exact for symmetric
differences from ``FEW`` pairs on, and agrees with ``missions.statistics.step_down_p`` of a single comparison.

**Times of runs that may not get there.** Let p be the share that does not, m the mean of those that do, H the horizon
at which all others count. The restricted mean is (1 - p) m + p H. Each part has an interval of its own: Clopper and
Pearson (1934) of p, the above of m, or Student's below 30 runs. They are joined by the method of variance estimates
recovery (Zou and Donner 2008): the distance to the upper bound is the root of the sum of the squares of what each part
adds. So ten runs that all got there do not say that all will: p may be 0.31, and the interval reaches up, beyond any
slow run that was not seen, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

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


FEW = 8
"""Fewest pairs, or runs of which some may not get there, that have an interval."""
MANY = 30
"""Fewest values that a mean has an interval from."""
TAIL = 0.0125
"""Share of the resamples beyond the bound at the long tail."""
STEADY = 0.05
"""A resample hardly varies if its spread is at most this part of the sample's; its studentised mean is infinite."""
STRAIGHT = 1e-9
"""Skewness up to which values have no long tail; what is less is of rounding."""
INTERVALS_OF_MEANS = (
    "95 % intervals of the mean (Student's t, at the long tail bootstrap-t); of fewer than 30 runs least to largest"
)
INTERVALS_OF_DIFFERENCES = "95 % intervals of the mean difference (by sign flips)"


class NoInterval(Enum):
    """Why there is no interval."""

    DETERMINISTIC = "deterministic, n = 1"
    TOO_FEW = "n too small"
    RARE = "n < 30: least to largest"
    ALIKE = "all values are alike"
    FEW_DIFFER = "n too small: a few values make the whole spread"


Estimated = Interval | NoInterval


@dataclass(frozen=True)
class Timed:
    """Values of a metric of which runs count with a horizon where they did not get there.

    Args:
        values: of the runs, those that did not get there with the horizon.
        reached: whether each got there.
        horizon: at which all count that did not.
        certain: whether they are one run, whose share is known.
    """

    values: Sequence[float]
    reached: Sequence[bool]
    horizon: float
    certain: bool = False

    @property
    def own(self) -> list[float]:
        """Values of those that got there."""
        return [value for value, reached in zip(self.values, self.reached, strict=True) if reached]


def mean_interval(values: Sequence[float]) -> Estimated:
    """95 % interval of the mean, or why there is none.

    >>> mean_interval([1.0, 2.0, 3.0])
    <NoInterval.RARE: 'n < 30: least to largest'>
    >>> low, high = mean_interval([8.0, 9.0, 10.0, 11.0, 12.0] * 6)
    >>> round(low, 2), round(high, 2)  # no tail is longer: 10 -+ 2.045 * 1.438 / sqrt(30)
    (9.46, 10.54)
    """
    if len(values) < MANY:
        return NoInterval.RARE
    sample = np.asarray(values, dtype=float)
    spread, mean, n = float(sample.std(ddof=1)), float(sample.mean()), len(sample)
    if spread <= 1e-12 * max(1.0, abs(mean)):
        return NoInterval.ALIKE
    drawn = sample[generator().integers(0, n, (RESAMPLES, n))]
    spreads = drawn.std(axis=1, ddof=1)
    away = drawn.mean(axis=1) - mean
    steady = spreads <= STEADY * spread
    studentised = np.where(steady, np.copysign(np.inf, away), away / np.where(steady, 1.0, spreads))
    half = t_half_width(values)
    ranks = np.sort(studentised)
    beyond = round(TAIL * RESAMPLES)
    low, high, skew = mean - half, mean + half, float((((sample - mean) / spread) ** 3).sum()) / n
    if skew > STRAIGHT:
        high = max(high, mean - float(ranks[beyond]) * spread)
    elif skew < -STRAIGHT:
        low = min(low, mean - float(ranks[-1 - beyond]) * spread)
    return (low, high) if math.isfinite(low) and math.isfinite(high) else NoInterval.FEW_DIFFER


def difference_interval(differences: Sequence[float]) -> Estimated:
    """95 % interval of the mean of paired differences, or why there is none.

    >>> difference_interval([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])  # sixth of 255 means: of 1, 2, 4; of 5, 7, 8
    (2.3333333333333335, 6.666666666666667)
    """
    n = len(differences)
    if n < FEW:
        return NoInterval.TOO_FEW
    chosen = sign_flips(n) < 0.0
    sizes = chosen.sum(axis=1)
    means = np.sort((chosen @ np.asarray(differences, dtype=float))[sizes > 0] / sizes[sizes > 0])
    beyond = int((1.0 - CONFIDENCE) / 2.0 * len(chosen))
    return float(means[beyond - 1]), float(means[-beyond])


def share_interval(count: int, n: int) -> Interval:
    """95 % interval of a share that is never too short (Clopper and Pearson 1934).

    >>> tuple(round(bound, 4) for bound in share_interval(0, 10))  # 1 - 0.025 ** (1 / 10)
    (0.0, 0.3085)
    """
    found = stats.binomtest(count, n).proportion_ci(CONFIDENCE, method="exact")
    return float(found.low), float(found.high)


def restricted_interval(timed: Timed) -> Estimated:
    """95 % interval of the restricted mean, or why there is none.

    >>> low, high = restricted_interval(Timed([1.0, 1.1, 0.9, 1.2, 0.8, 1.0, 1.1, 0.9], [True] * 8, 4.0))
    >>> round(low, 2), round(high, 2)  # none of 8 did not get there: the share may be 0.37, 1 + 0.37 * (4 - 1)
    (0.89, 2.11)
    """
    n, own = len(timed.values), timed.own
    if n < FEW:
        return NoInterval.TOO_FEW
    share = 1.0 - len(own) / n
    share_low, share_high = share_interval(n - len(own), n)
    if len(own) < 2:
        return share_low * timed.horizon, timed.horizon
    bounds = mean_interval(own)
    if bounds in (NoInterval.RARE, NoInterval.ALIKE):
        bounds = _student(own)
    if isinstance(bounds, NoInterval):
        return bounds
    mean, centre = math.fsum(own) / len(own), math.fsum(timed.values) / n
    low, high = max(0.0, bounds[0]), min(timed.horizon, bounds[1])
    left = timed.horizon - mean
    return (
        centre - math.hypot((share - share_low) * left, (1.0 - share) * (mean - low)),
        centre + math.hypot((share_high - share) * left, (1.0 - share) * (high - mean)),
    )


def restricted_difference_interval(ours: Timed, theirs: Timed) -> Estimated:
    """95 % interval of the mean difference of restricted times of pairs, or why there is none.

    Three parts make it up, and are joined as above: the difference of the pairs in which both got there, and the share
    of either side that did not. The shares are taken as independent, which is too wide rather than too short where
    both sides meet the same losses.
    """
    n = len(ours.values)
    pairs = zip(ours.values, theirs.values, ours.reached, theirs.reached, strict=True)
    both = [a - b for a, b, a_reached, b_reached in pairs if a_reached and b_reached]
    if n < FEW or len(both) < 2:
        return NoInterval.TOO_FEW
    bounds = difference_interval(both)
    if isinstance(bounds, NoInterval):
        bounds = _student(both)
    centre = (math.fsum(ours.values) - math.fsum(theirs.values)) / n
    mean, weight = math.fsum(both) / len(both), len(both) / n
    up, down = _of_share(ours), _of_share(theirs)
    return (
        centre - math.hypot(weight * (mean - bounds[0]), up[0], down[1]),
        centre + math.hypot(weight * (bounds[1] - mean), up[1], down[0]),
    )


def _of_share(timed: Timed) -> Interval:
    """What the share that did not get there may take from a restricted mean, and add to it."""
    if timed.certain or not timed.own:
        return 0.0, 0.0
    n, own = len(timed.values), timed.own
    low, high = share_interval(n - len(own), n)
    share, left = 1.0 - len(own) / n, timed.horizon - math.fsum(own) / len(own)
    return (share - low) * left, (high - share) * left


def _student(values: Sequence[float]) -> Interval:
    """Student's interval: of few values that are the smaller part of a whole."""
    mean, half = math.fsum(values) / len(values), t_half_width(values)
    return mean - half, mean + half
