"""Ranking of strategies and policies, among those that were run under the same conditions.

Success comes first: a treatment whose success rate is told from the highest did other work, and its mean time or
distance cannot be set against that of the others. It stands behind them; the metric decides among those of like
success. The direction comes from the declaration of the metric, which the folder of the sweep holds. A ranking also
says which treatments the runs cannot tell from the best. Both tests count all pairs of the column
(``missions/comparison/best.py``) and share one error of 5 %.
"""

from __future__ import annotations

import statistics as plain
from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from missions.comparison.best import least_p, worse_p
from missions.comparison.pairs import SIGNIFICANT
from missions.comparison.rows import Comparison, Rank
from missions.comparison.treatments import (
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
from missions.sweeps.folder import SweepResults

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
