"""Ranking of strategies, and multiple comparison with the best.

The winner of a column wins by luck, too. A test of each against the winner of the same data, corrected for k - 1 tests,
tells one of ten equal treatments from the best in 14 % of studies. Here all ordered pairs are one family:

    T(i, j) = mean of (x_i - x_j) over the repeats / its standard error,    M = the largest T(i, j) of all pairs.

Treatments that are equal could have had each other's values of a repeat. So M is compared with itself after the values
of every repeat were dealt anew, at random, among the treatments (max-T, Westfall and Young 1993): the probability that
anybody is told from anybody where all are equal is exact, whatever the distribution and however few repeats there are.
With studentised differences it also holds, as repeats grow, where means are equal and spreads are not (Chung and Romano
2013). Hsu's multiple comparisons with the best (1984) have smaller bounds, but say "not the only best" of a tie.

Success comes first: a treatment whose success rate is told from the highest did other work, and its mean time or
distance cannot be set against that of the others. It stands behind them; the metric decides among those of like
success. The direction comes from the declaration of the metric, which the folder of the sweep holds. A ranking also
says which treatments the runs cannot tell from the best. Both tests count all pairs of the column
(``missions/comparison/ranking.py``) and share one error of 5 %.
"""

from __future__ import annotations

import itertools
import math
import statistics as plain
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from missions.comparison.rows import Comparison, Rank
from missions.comparison.treatments import (
    SIGNIFICANT,
    SUCCESS,
    Outcomes,
    Treatment,
    check_name,
    measured,
    treatments_of,
    values_of,
)
from missions.errors import OutputError
from missions.metric import Better, MetricRecord
from missions.statistics import RESAMPLES, Array, generator
from missions.sweeps.folder import SweepResults

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


SHARE_OF_SUCCESS = 0.3
"""Part of the error that the test of success has; the test of the metric has the rest."""
Conditions = tuple[str, str, float, tuple[tuple[str, str], ...], str]
"""Scenario, channel, loss rate, settings and what is unforeseen, which those that are ranked with each other share."""


@dataclass(frozen=True)
class Contender:
    """A treatment in a column of a ranking.

    Args:
        values: of the metric, by repeat.
        success: 1 if its run of a repeat completed, else 0; failed runs have not.
        constant: True if nothing was drawn: it is the same in all repeats.
    """

    values: Mapping[int, float]
    success: Mapping[int, float]
    constant: bool = False

    @property
    def success_rate(self) -> float:
        """Share of the runs that completed."""
        return plain.fmean(self.success.values())


def ranks(results: SweepResults, metric: str) -> list[Rank]:
    """Rank strategies and policies under each of the conditions (scenario, channel, loss rate, settings).

    Args:
        results: see ``SweepResults.read``.
        metric: field of the summary, of which one value is better than another.

    Raises:
        OutputError: nothing has finished, the metric is unknown, or its direction is.
    """
    check_name("--metric", metric, results.metrics)
    declared = results.metrics[metric]
    better = declared.better
    if better is None or better is Better.NEITHER:
        why = "neither higher nor lower is better" if better else "this folder does not say which direction is better"
        raise OutputError(f"--metric {metric!r}: cannot be ranked, {why}; allowed are {', '.join(results.ranked)}")
    columns = columns_of(treatments_of(results), declared, results.metrics[SUCCESS], results.bounds)
    return [rank for column in columns for rank in column_ranks(column, metric, better)]


def columns_of(
    treatments: Mapping[Treatment, Outcomes], metric: MetricRecord, success: MetricRecord, bounds: Collection[str]
) -> list[dict[Treatment, Contender]]:
    """Contenders that share their conditions; a bound is none, for nobody can be as good.

    Args:
        treatments: with their runs.
        metric: of whose values they have some.
        success: the metric of success.
        bounds: strategies that are bounds.
    """
    columns: dict[Treatment, dict[Treatment, Contender]] = defaultdict(dict)
    for treatment, runs in treatments.items():
        if treatment.strategy not in bounds and (own := measured(runs, metric)).values:
            contender = Contender(own.values, values_of(runs, success), own.constant)
            columns[replace(treatment, strategy="", policy="")][treatment] = contender
    return list(columns.values())


def column_ranks(column: Mapping[Treatment, Contender], metric: str, better: Better) -> list[Rank]:
    """Ranks of one column of a table.

    Args:
        column: what was run under the same conditions.
        metric: its name.
        better: HIGHER or LOWER.
    """
    sign = -1.0 if better is Better.HIGHER else 1.0
    means = {treatment: plain.fmean(own.values.values()) for treatment, own in column.items()}
    behind = of_less_success(column)
    scores = {
        treatment: (1.0 - own.success_rate if treatment in behind else -1.0, sign * means[treatment])
        for treatment, own in column.items()
    }
    best = min(scores, key=lambda treatment: scores[treatment])
    values = {treatment: own.values for treatment, own in column.items()}
    p = _worse_p(column, values, sign, [treatment not in behind for treatment in column])
    drawn = any(not own.constant for own in column.values())
    ranks = []
    for treatment, score in scores.items():
        to_best = None if treatment == best or p is None else min(1.0, p[treatment] / (1.0 - SHARE_OF_SUCCESS))
        like_best = (to_best is None or to_best >= SIGNIFICANT) if drawn else score == scores[best]
        ranks.append(
            Rank(
                **treatment.columns(),
                metric=metric,
                n=len(column[treatment].values),
                success_rate=column[treatment].success_rate,
                mean=means[treatment],
                rank=sum(other < score for other in scores.values())
                + (1 + sum(other == score for other in scores.values())) / 2,
                p_to_best=to_best,
                among_best=treatment not in behind and like_best,
                unequal_success=treatment in behind,
                deterministic=column[treatment].constant,
            )
        )
    return ranks


def of_less_success(column: Mapping[Treatment, Contender]) -> frozenset[Treatment]:
    """Those of a column whose success rate is told from the highest."""
    if len({value for own in column.values() for value in own.success.values()}) == 1:
        return frozenset()
    success = {treatment: own.success for treatment, own in column.items()}
    p = _worse_p(column, success, -1.0, [True] * len(column))
    if p is None:
        if any(not own.constant for own in column.values()):
            return frozenset()
        highest = max(own.success_rate for own in column.values())
        return frozenset(treatment for treatment, own in column.items() if own.success_rate < highest)
    return frozenset(treatment for treatment in column if p[treatment] / SHARE_OF_SUCCESS < SIGNIFICANT)


def _worse_p(
    column: Mapping[Treatment, Contender],
    values: Mapping[Treatment, Mapping[int, float]],
    sign: float,
    rivals: Sequence[bool],
) -> dict[Treatment, float] | None:
    """See ``worse_p``, over the repeats that all have; None if these are fewer than two, or nothing was drawn."""
    known = [set(values[treatment]) for treatment, own in column.items() if not own.constant]
    shared = sorted(set.intersection(*known)) if known else []
    if len(shared) < 2:
        return None
    across = [
        list(values[treatment].values()) * len(shared) if own.constant else [values[treatment][r] for r in shared]
        for treatment, own in column.items()
    ]
    return dict(zip(column, worse_p(sign * np.array(across, dtype=float).T, rivals), strict=True))


def of_unequal_work(rows: Sequence[Comparison]) -> list[Comparison]:
    """Rows whose success rate is told from the highest under the same conditions."""
    return [row for row in rows if row.unequal_success]


def mean_ranks(ranked: Sequence[Rank]) -> dict[tuple[str, str], float | None]:
    """Mean rank of each (strategy, policy) over all conditions; None if it lacks a value under one of them."""
    conditions = {_conditions(rank) for rank in ranked}
    ranks_of: dict[tuple[str, str], list[float]] = defaultdict(list)
    for rank in ranked:
        ranks_of[rank.strategy, rank.policy].append(rank.rank)
    return {name: plain.fmean(places) if len(places) == len(conditions) else None for name, places in ranks_of.items()}


def are_too_few(ranked: Sequence[Rank]) -> bool:
    """True if no strategy could be told from the best of its column, because there are so few runs."""
    columns = Counter(_conditions(rank) for rank in ranked if not rank.deterministic)
    most = max((rank.n for rank in ranked if not rank.deterministic), default=0)
    tested = [k for k in columns.values() if k > 1]
    return bool(tested) and all(least_p(most, k) / (1.0 - SHARE_OF_SUCCESS) >= SIGNIFICANT for k in tested)


def _conditions(row: Rank) -> Conditions:
    return row.scenario, row.channel, row.per, tuple(row.settings.items()), row.unforeseen
