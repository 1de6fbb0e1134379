"""Pairs: two treatments compared run by run of the same repeat, so that both met the same losses."""

from __future__ import annotations

import statistics as plain
from dataclasses import dataclass, replace

from missions.comparison.intervals import (
    Estimated,
    NoInterval,
    Timed,
    mean_interval,
    restricted_difference_interval,
)
from missions.comparison.treatments import Measured
from missions.statistics import effect_size, paired_p, pairing_gain

SIGNIFICANT = 0.05
"""Corrected probability below which a difference counts."""


@dataclass(frozen=True)
class Paired:
    """Differences between two treatments in one metric; None where too few pairs can say.

    Args:
        n: pairs.
        n_reached: pairs of a censored metric in which both got there; None for other metrics.
        reached: mean difference of these.
        reached_interval: of that mean.
    """

    difference: float
    interval: Estimated
    p: float | None
    effect: float | None
    gain: float | None
    n: int
    n_reached: int | None = None
    reached: float | None = None
    reached_interval: Estimated = NoInterval.TOO_FEW


def paired_with(ours: Measured, theirs: Measured) -> Paired | None:
    """The difference to a baseline over the repeats that both have.

    A treatment in which nothing was drawn is the same in all repeats, so it is paired with each of the other's.

    Args:
        ours: values of a treatment.
        theirs: of the one that it is compared with.

    Returns:
        None if they share no repeat.
    """
    if ours.constant and theirs.constant:
        (own,), (other,) = ours.values.values(), theirs.values.values()
        return Paired(own - other, NoInterval.DETERMINISTIC, None, None, None, 1)
    a, b = ours.over(theirs.values), theirs.over(ours.values)
    shared = [repeat for repeat in a.values if repeat in b.values]
    if not shared:
        return None
    mine, others = [a.values[repeat] for repeat in shared], [b.values[repeat] for repeat in shared]
    differences = [x - y for x, y in zip(mine, others, strict=True)]
    paired = Paired(
        plain.fmean(differences),
        mean_interval(differences),
        paired_p(differences),
        effect_size(mine, others),
        pairing_gain(mine, others),
        len(shared),
    )
    if a.reached is None or b.reached is None:
        return paired
    both = a.reached & b.reached
    reached = [x for x, repeat in zip(differences, shared, strict=True) if repeat in both]
    interval: Estimated = NoInterval.UNBOUNDED
    if a.horizon is not None and b.horizon is not None:
        interval = restricted_difference_interval(
            Timed(mine, [repeat in a.reached for repeat in shared], a.horizon, a.constant),
            Timed(others, [repeat in b.reached for repeat in shared], b.horizon, b.constant),
        )
    mean = plain.fmean(reached) if reached else None
    return replace(
        paired, interval=interval, n_reached=len(reached), reached=mean, reached_interval=mean_interval(reached)
    )


def least_p_holm(n_pairs: int, n_tests: int) -> float:
    """The smallest corrected probability that so many tests of so many pairs can give.

    >>> least_p_holm(5, 2)  # 2 of the 32 ways to flip the signs, twice
    0.125
    """
    return min(1.0, n_tests * (paired_p([1.0] * n_pairs) or 1.0))
