"""Intervals of means and of differences, or the reason why there is none.

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
from scipy import stats

from missions.statistics import CONFIDENCE, RESAMPLES, Interval, generator, sign_flips, t_half_width

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
