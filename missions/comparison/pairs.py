"""Pairs: two treatments compared run by run of the same repeat, so that both met the same losses."""

from __future__ import annotations

import statistics as plain
from collections.abc import Mapping
from dataclasses import dataclass

from missions.statistics import Interval, effect_size, mean_interval, paired_p, pairing_gain

SIGNIFICANT = 0.05
"""Corrected probability below which a difference counts."""


@dataclass(frozen=True)
class Paired:
    """Differences between two treatments in one metric; None where too few pairs can say."""

    difference: float
    interval: Interval | None
    p: float | None
    effect: float | None
    gain: float | None


def paired_with(values: Mapping[int, float], baseline: Mapping[int, float]) -> Paired | None:
    """The difference to a baseline over the repeats that both have.

    Args:
        values: of a treatment, by repeat.
        baseline: of the one that it is compared with, by repeat.

    Returns:
        None if they share no repeat.
    """
    shared = [repeat for repeat in values if repeat in baseline]
    if not shared:
        return None
    ours, theirs = [values[repeat] for repeat in shared], [baseline[repeat] for repeat in shared]
    differences = [a - b for a, b in zip(ours, theirs, strict=True)]
    return Paired(
        plain.fmean(differences),
        mean_interval(differences),
        paired_p(differences),
        effect_size(ours, theirs),
        pairing_gain(ours, theirs),
    )


def least_p_holm(n_pairs: int, n_tests: int) -> float:
    """The smallest corrected probability that so many tests of so many pairs can give.

    >>> least_p_holm(5, 2)  # 2 of the 32 ways to flip the signs, twice
    0.125
    """
    return min(1.0, n_tests * (paired_p([1.0] * n_pairs) or 1.0))
