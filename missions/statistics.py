"""Statistics of repeated runs: confidence intervals, paired tests, effect sizes.

**Means.** Suppose one run in ten is slow. A sample of n runs contains no slow run with probability 0.9^n: 0.43 at n =
8, 0.12 at 20. It then looks like a sample without slow runs, so no interval covers both means in 95 % of cases (Bahadur
and Savage 1956). Below ``MANY`` = 30 runs (0.9^30 = 0.04) a mean therefore has no interval, and tables print the range.
From 30 on it is Student's. On the side of a long tail it ends at the farther of Student's bound and the bootstrap-t
bound at ``TAIL`` (Hall 1988; Efron and Tibshirani 1993, section 12.5). This share was fitted to normal, lognormal and
exponential values.

**Paired differences.** The paired difference of two treatments that differ by a shift is symmetric about it, even with
one slow run in ten. The interval holds all shifts that sign flips do not reject at 5 %: the means of all subsets of the
differences without 2.5 % at either end (Hartigan 1969). It is exact for symmetric differences from ``FEW`` pairs on and
agrees with ``missions.statistics.step_down_p`` of a single comparison.

**Censored times.** Let p be the share of runs that do not complete, m the mean of the others, H the horizon. The
restricted mean is (1 - p) m + p H. Without incomplete runs its range or interval is that of any mean, of runs that
complete. Else each part has an interval: Clopper and Pearson (1934) for p, the above for m, or Student's below 30 runs.
They are combined by variance estimates recovery (Zou and Donner 2008): the distance to a bound is the root of the
summed squares of the parts' contributions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt
from scipy import optimize, stats

RESAMPLES = 2000
CONFIDENCE = 0.95
SEED = 20110901

Interval = tuple[float, float]
Array = npt.NDArray[np.float64]


def generator() -> np.random.Generator:
    """Return the seeded generator at its start."""
    return np.random.Generator(np.random.Philox(SEED))


def t_half_width(values: Sequence[float]) -> float:
    """Half-width of Student's 95 % interval of the mean, for stopping rules.

    >>> round(t_half_width([1.0, 2.0, 3.0, 4.0]), 4)  # 3.18245 * 1.29099 / 2
    2.0543
    """
    spread = float(np.std(values, ddof=1))
    return float(stats.t.ppf((1.0 + CONFIDENCE) / 2.0, len(values) - 1)) * spread / math.sqrt(len(values))


def wilson_interval(successes: int, n: int) -> Interval:
    """95 % interval of a success rate (Wilson 1927), also at 0 and n successes.

    >>> tuple(round(bound, 4) for bound in wilson_interval(8, 10))  # Brown, Cai and DasGupta 2001, equation 4
    (0.4902, 0.9433)
    """
    low, high = stats.binomtest(successes, n).proportion_ci(CONFIDENCE, method="wilson")
    return float(low), float(high)


def sign_flips(n: int) -> Array:
    """Sign flips of n pairs, one per row: all for n <= 12, else the identity and seeded draws."""
    if n <= 12:
        return np.where((np.arange(2**n)[:, None] >> np.arange(n)) & 1, -1.0, 1.0)
    drawn = generator().random((2 * RESAMPLES, n))
    # With the identity among the draws, p is never 0 and the test keeps its level.
    drawn[0] = 1.0
    return np.where(drawn < 0.5, -1.0, 1.0)


def step_down_p(differences: npt.ArrayLike) -> list[float]:
    """Two-sided p values of mean paired differences, corrected for multiple comparisons.

    For equal treatments the sign of a difference is random in each repeat (Fisher 1935). The statistic ``|sum d| /
    sqrt(sum d^2)`` is a monotone function of Student's t. Step-down (Romano and Wolf 2005, algorithm 1; p values as in
    Romano and Wolf 2016) compares each difference with the largest of those no clearer than itself, so clear
    differences cost the others nothing. ``differences`` has shape (repeats, comparisons); 0 where a repeat has no pair.

    >>> step_down_p([[1.0], [2.0], [3.0], [4.0]])  # of 16 flips only + + + + and - - - - reach the sum
    [0.125]
    >>> step_down_p([[9.0, 1.0], [9.1, 2.0], [9.2, 3.0], [9.0, -2.5]])  # 2 / 16; then the second by itself, 8 / 16
    [0.125, 0.5]
    """
    sample = np.asarray(differences, dtype=float)
    # Flips do not change this scale, so the comparison of sums is that of the statistics.
    scale = np.sqrt((sample**2).sum(axis=0))
    sample = sample / np.where(scale > 0.0, scale, 1.0)
    observed = np.abs(sample.sum(axis=0))
    order = np.argsort(-observed, kind="stable")
    flips, reached = sign_flips(len(sample)), np.zeros(len(order))
    for part in np.array_split(flips, 1 + len(flips) // 256):  # in blocks: all at once take 1 GB for 10,000 comparisons
        # All differences of a repeat are flipped together, which keeps their dependence.
        flipped = np.abs(part @ sample[:, order])
        # Each column competes with itself and all later ones, which are no clearer.
        largest = np.maximum.accumulate(flipped[:, ::-1], axis=1)[:, ::-1]
        # The tolerance counts flips that equal the observed sum but for rounding.
        reached += (largest >= observed[order] * (1.0 - 1e-9)).sum(axis=0)
    corrected = np.empty(len(order))
    # A difference gets no smaller p than a clearer one.
    corrected[order] = np.maximum.accumulate(reached / len(flips))
    return [float(value) for value in corrected]


def least_p(n: int) -> float:
    """Smallest p that ``step_down_p`` can give for n pairs, such as 0.0625 for 5."""
    return 2.0 / 2**n if 1 <= n <= 12 else 0.5 / RESAMPLES if n else 1.0


POWER = 0.8  # probability of detection


def detectable(spread: float, n: int) -> float:
    """Smallest mean of ``n`` paired differences of standard deviation ``spread`` that Student's test at 5 % detects.

    The test is of a single two-sided comparison, with ``POWER``.

    >>> round(detectable(1.0, 10), 2), round(detectable(2.0, 34), 2)  # Cohen 1988, as computed by G*Power: 1.00, 0.50
    (1.0, 0.99)
    """
    bound = float(stats.t.ppf((1.0 + CONFIDENCE) / 2.0, n - 1))

    def missing(shift: float) -> float:
        return POWER - float(stats.nct.sf(bound, n - 1, shift))  # the other tail is negligible at this power

    return spread / math.sqrt(n) * float(optimize.brentq(missing, 0.0, 2.0 * bound + 4.0))


def effect_size(values: Sequence[float], baseline: Sequence[float]) -> float | None:
    """Cohen's d with the mean variance (Lakens 2013, equation 10); None without spread.

    >>> round(effect_size([2.0, 3.0, 4.0], [1.0, 2.0, 3.0]), 4)
    1.0
    """
    a, b = np.asarray(values, dtype=float), np.asarray(baseline, dtype=float)
    spread = math.sqrt((a.var(ddof=1) + b.var(ddof=1)) / 2.0) if len(a) > 1 else 0.0
    return float(a.mean() - b.mean()) / spread if spread > 0.0 else None


def pairing_gain(values: Sequence[float], baseline: Sequence[float]) -> float | None:
    """Factor of runs saved by pairing: unpaired over paired variance of the difference.

    >>> pairing_gain([1.0, 2.0, 3.0], [2.0, 4.0, 6.0])  # (1 + 4) / 1
    5.0
    """
    a, b = np.asarray(values, dtype=float), np.asarray(baseline, dtype=float)
    paired = float((a - b).var(ddof=1)) if len(a) > 1 else 0.0
    return float(a.var(ddof=1) + b.var(ddof=1)) / paired if paired > 0.0 else None


FEW = 8  # fewest pairs, or runs with censoring, for an interval
MANY = 30  # fewest values for an interval of a mean
TAIL = 0.0125  # share of resamples beyond the bound at the long tail
STEADY = 0.05  # relative spread below which a resample counts as constant, with infinite studentised mean
STRAIGHT = 1e-9  # skewness up to which values have no long tail (rounding)
INTERVALS_OF_MEANS = "95 % confidence intervals of the mean (Student's t, bootstrap-t for long tails)"
INTERVALS_OF_DIFFERENCES = "95 % confidence intervals of the mean difference (sign-flip test)"


class NoInterval(Enum):
    """Reason for a missing interval."""

    DETERMINISTIC = "deterministic, n = 1"
    TOO_FEW = "n too small"
    RARE = "n < 30: least to largest"
    ALIKE = "all values are equal"
    FEW_REACHED = "fewer than 2 pairs completed on both sides"
    FEW_DIFFER = "n too small: a few values cause all spread"


Estimated = Interval | NoInterval


@dataclass(frozen=True)
class Timed:
    """Metric values with censored runs at ``horizon``; ``certain``: deterministic replicates."""

    values: Sequence[float]
    reached: Sequence[bool]
    horizon: float
    certain: bool = False

    @property
    def own(self) -> list[float]:
        """Values of the completed runs."""
        return [value for value, reached in zip(self.values, self.reached, strict=True) if reached]


def mean_interval(values: Sequence[float]) -> Estimated:
    """95 % interval of the mean, or the reason for none.

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
    # Resampling studentised means (bootstrap-t) follows a long tail that Student's interval misses.
    drawn = sample[generator().integers(0, n, (RESAMPLES, n))]
    spreads = drawn.std(axis=1, ddof=1)
    away = drawn.mean(axis=1) - mean
    steady = spreads <= STEADY * spread
    # A resample of nearly equal values has no scale: its mean counts as infinitely far away.
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
    """95 % interval of the mean paired difference, or the reason for none.

    >>> difference_interval([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])  # sixth of 255 means: of 1, 2, 4; of 5, 7, 8
    (2.3333333333333335, 6.666666666666667)
    """
    n = len(differences)
    if n < FEW:
        return NoInterval.TOO_FEW
    chosen = sign_flips(n) < 0.0
    sizes = chosen.sum(axis=1)
    # Means of all non-empty subsets are the shifts at which the flip test changes its answer (Hartigan 1969).
    means = np.sort((chosen @ np.asarray(differences, dtype=float))[sizes > 0] / sizes[sizes > 0])
    beyond = int((1.0 - CONFIDENCE) / 2.0 * len(chosen))
    return float(means[beyond - 1]), float(means[-beyond])


def share_interval(count: int, n: int) -> Interval:
    """Conservative 95 % interval of a share (Clopper and Pearson 1934).

    >>> tuple(round(bound, 4) for bound in share_interval(0, 10))  # 1 - 0.025 ** (1 / 10)
    (0.0, 0.3085)
    """
    low, high = stats.binomtest(count, n).proportion_ci(CONFIDENCE, method="exact")
    return float(low), float(high)


def restricted_interval(timed: Timed) -> Estimated:
    """95 % interval of the restricted mean, or the reason for none.

    >>> low, high = restricted_interval(Timed([1.0, 1.1, 0.9, 1.2, 0.8, 1.0, 1.1, 0.9], [True] * 8, 4.0))
    >>> round(low, 2), round(high, 2)  # none of 8 did not get there: the share may be 0.37, 1 + 0.37 * (4 - 1)
    (0.89, 2.11)
    """
    n, own = len(timed.values), timed.own
    if n < FEW:
        return NoInterval.TOO_FEW
    share = 1.0 - len(own) / n
    share_low, share_high = share_interval(n - len(own), n)
    # The mean of so few completed runs may be anywhere from 0 to the horizon.
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
    """95 % interval of the mean difference of restricted times: pairs completed on both sides, shares of either."""
    n = len(ours.values)
    pairs = zip(ours.values, theirs.values, ours.reached, theirs.reached, strict=True)
    both = [a - b for a, b, a_reached, b_reached in pairs if a_reached and b_reached]
    if n < FEW:
        return NoInterval.TOO_FEW
    if len(both) < 2:
        return NoInterval.FEW_REACHED
    bounds = difference_interval(both)
    if isinstance(bounds, NoInterval):
        bounds = _student(both)
    centre = (math.fsum(ours.values) - math.fsum(theirs.values)) / n
    mean, weight = math.fsum(both) / len(both), len(both) / n
    # As if independent: conservative, since both sides meet the same losses.
    up, down = _of_share(ours), _of_share(theirs)
    return (
        centre - math.hypot(weight * (mean - bounds[0]), up[0], down[1]),
        centre + math.hypot(weight * (bounds[1] - mean), up[1], down[0]),
    )


def _of_share(timed: Timed) -> Interval:
    if timed.certain or not timed.own:
        return 0.0, 0.0
    n, own = len(timed.values), timed.own
    low, high = share_interval(n - len(own), n)
    share, left = 1.0 - len(own) / n, timed.horizon - math.fsum(own) / len(own)
    return (share - low) * left, (high - share) * left


def _student(values: Sequence[float]) -> Interval:
    mean, half = math.fsum(values) / len(values), t_half_width(values)
    return mean - half, mean + half
