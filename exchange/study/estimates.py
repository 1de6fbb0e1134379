"""Means over trials with 95 % confidence intervals, from sums of constant size.

A trial reports a sum and a count per quantity: slots until the end and 1, or latencies of many items and their number.
The mean is the sum of sums over the sum of counts. Its variance, and that of the ratio to a baseline in the same
trials, follow from linearised residuals (Cochran, Sampling Techniques, 1977, chapter 6), which need only the sums of
products. Intervals are normal, for thirty trials or more.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Z_95 = 1.959964
ROUNDING = 1e-13
"""Variance, as a share of its terms, below which it is rounding."""

Moments = NDArray[np.float64]
"""Summed products of (1, sum, count, baseline sum, baseline count), shape (..., 5, 5)."""


@dataclass(frozen=True, slots=True)
class TrialMean:
    """Mean with 95 % confidence interval; the interval is None for a single trial."""

    mean: float
    ci95_low: float | None
    ci95_high: float | None


def moments(outcomes: NDArray[np.int64], baseline: NDArray[np.int64]) -> Moments:
    """Sum the products over trials; return shape (n_quantities, 5, 5).

    ``outcomes`` has shape (n_trials, n_quantities, 2 or more): sum, count; ``baseline`` the same trials under the
    baseline policy.
    """
    n_trials, n_quantities, _ = outcomes.shape
    vectors = np.empty((n_quantities, 5, n_trials))
    vectors[:, 0] = 1.0
    vectors[:, 1:3] = outcomes[:, :, :2].transpose(1, 2, 0)
    vectors[:, 3:] = baseline[:, :, :2].transpose(1, 2, 0)
    products: Moments = vectors @ vectors.transpose(0, 2, 1)
    return products


def mean(products: Moments) -> TrialMean | None:
    """Return the mean of one quantity, shape (5, 5); None if no trial counts.

    >>> trials = np.array([[[1, 1]], [[2, 1]], [[6, 1]]])
    >>> mean(moments(trials, trials)[0]).mean
    3.0
    """
    rows = products.tolist()
    _, total, count, _, _ = rows[0]
    if count == 0:
        return None
    value = total / count
    # Partial derivatives of total / count; the residuals sum to 0, so the constant term is 0.
    return _estimate(value, (0.0, 1.0 / count, -value / count, 0.0, 0.0), rows)


def relative_mean(products: Moments) -> TrialMean | None:
    """Return the mean over that of the baseline; None if no trial of either counts, or one is 0."""
    rows = products.tolist()
    _, total, count, base_total, base_count = rows[0]
    if count == 0 or base_count == 0 or total == 0 or base_total == 0:
        return None
    value = (total / count) / (base_total / base_count)
    weights = 0.0, value * (1 / total), value * (-1 / count), value * (-1 / base_total), value * (1 / base_count)
    return _estimate(value, weights, rows)


def _estimate(value: float, weights: Sequence[float], products: Sequence[Sequence[float]]) -> TrialMean:
    """Return the estimate whose residual in a trial is the weighted sum of its numbers."""
    n_trials = products[0][0]
    if n_trials < 2:
        return TrialMean(value, None, None)
    terms = [u * v * p for u, row in zip(weights, products, strict=True) for v, p in zip(weights, row, strict=True)]
    variance = math.fsum(terms) * n_trials / (n_trials - 1)
    rounding = math.fsum(map(abs, terms)) * ROUNDING
    half = Z_95 * math.sqrt(variance) if variance > rounding else 0.0
    return TrialMean(value, value - half, value + half)
