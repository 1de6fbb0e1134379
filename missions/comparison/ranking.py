"""Ranking of strategies and policies, among those that were run under the same conditions.

The direction comes from the declaration of the metric, which the folder of the sweep holds. A ranking also says which
treatments the runs cannot tell from the best.
"""

from __future__ import annotations

import statistics as plain
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

from missions.comparison.pairs import SIGNIFICANT, least_p_holm, paired_with
from missions.comparison.rows import Rank
from missions.comparison.treatments import Treatment, check_name, treatments_of, values_of
from missions.errors import OutputError
from missions.metric import Better
from missions.statistics import holm
from missions.sweeps.folder import SweepResults

Conditions = tuple[str, str, float, tuple[tuple[str, str], ...]]
"""Scenario, channel, loss rate and other settings, which those that are ranked with each other share."""


def ranks(results: SweepResults, metric: str) -> list[Rank]:
    """Rank strategies and policies under each of the conditions (scenario, channel, loss rate, settings).

    Args:
        results: see ``SweepResults.read``.
        metric: field of the summary, of which one value is better than another.

    Raises:
        OutputError: nothing has finished, the metric is unknown, or its direction is.
    """
    check_name("--metric", metric, results.metrics)
    better = results.metrics[metric].better
    if better is None or better is Better.NEITHER:
        why = "neither higher nor lower is better" if better else "this folder does not say which direction is better"
        raise OutputError(f"--metric {metric!r}: cannot be ranked, {why}; allowed are {', '.join(results.ranked)}")
    columns: dict[Treatment, dict[Treatment, dict[int, float]]] = defaultdict(dict)
    for treatment, runs in treatments_of(results).items():
        if values := values_of(runs, metric):
            columns[replace(treatment, strategy="", policy="")][treatment] = values
    return [rank for column in columns.values() for rank in column_ranks(column, metric, better)]


def column_ranks(column: Mapping[Treatment, Mapping[int, float]], metric: str, better: Better) -> list[Rank]:
    """Ranks of one column of a table; the tests against its best are one family for Holm's correction.

    Args:
        column: values by treatment and repeat, under the same conditions.
        metric: its name.
        better: HIGHER or LOWER.
    """
    sign = -1.0 if better is Better.HIGHER else 1.0
    scores = {treatment: sign * plain.fmean(values.values()) for treatment, values in column.items()}
    best = min(scores, key=lambda treatment: scores[treatment])
    paired = {treatment: paired_with(values, column[best]) for treatment, values in column.items() if treatment != best}
    tested = {treatment: found.p for treatment, found in paired.items() if found and found.p is not None}
    corrected = dict(zip(tested, holm(list(tested.values())), strict=True))
    return [
        Rank(
            **treatment.columns(),
            metric=metric,
            n=len(column[treatment]),
            mean=sign * score,
            rank=sum(other < score for other in scores.values())
            + (1 + sum(other == score for other in scores.values())) / 2,
            p_holm_to_best=corrected.get(treatment),
            among_best=corrected.get(treatment, 1.0) >= SIGNIFICANT,
        )
        for treatment, score in scores.items()
    ]


def mean_ranks(ranked: Sequence[Rank]) -> dict[tuple[str, str], float | None]:
    """Mean rank of each (strategy, policy) over all conditions; None if it lacks a value under one of them."""
    conditions = {_conditions(rank) for rank in ranked}
    found: dict[tuple[str, str], list[float]] = defaultdict(list)
    for rank in ranked:
        found[rank.strategy, rank.policy].append(rank.rank)
    return {name: plain.fmean(places) if len(places) == len(conditions) else None for name, places in found.items()}


def are_too_few(ranked: Sequence[Rank]) -> bool:
    """True if no strategy could be told from the best of its column, because there are so few runs."""
    columns = Counter(_conditions(rank) for rank in ranked)
    most = max((rank.n for rank in ranked), default=0)
    return all(least_p_holm(most, n - 1) >= SIGNIFICANT for n in columns.values() if n > 1)


def _conditions(rank: Rank) -> Conditions:
    return rank.scenario, rank.channel, rank.per, tuple(rank.settings.items())
