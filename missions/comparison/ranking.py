"""Ranking of strategies and policies, among those that were run under the same conditions.

Success comes first: a treatment whose success rate is below the highest by more than their intervals did other work,
and its mean time or distance cannot be set against that of the others. It stands behind them; the metric decides among
those of like success. The direction comes from the declaration of the metric, which the folder of the sweep holds. A
ranking also says which treatments the runs cannot tell from the best.
"""

from __future__ import annotations

import statistics as plain
from collections import Counter, defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from missions.comparison.pairs import SIGNIFICANT, least_p_holm, paired_with
from missions.comparison.rows import Comparison, Rank
from missions.comparison.treatments import Treatment, check_name, treatments_of, values_of
from missions.errors import OutputError
from missions.metric import Better
from missions.statistics import Interval, holm, wilson_interval
from missions.sweeps.folder import SweepResults

Conditions = tuple[str, str, float, tuple[tuple[str, str], ...], str]
"""Scenario, channel, loss rate, settings and what is unforeseen, which those that are ranked with each other share."""


@dataclass(frozen=True)
class Contender:
    """A treatment in a column of a ranking.

    Args:
        values: of the metric, by repeat.
        success: whether each of its runs completed; failed runs have not.
    """

    values: Mapping[int, float]
    success: Sequence[bool]

    @property
    def success_rate(self) -> float:
        """Share of the runs that completed."""
        return sum(self.success) / len(self.success)

    @property
    def success_interval(self) -> Interval:
        """Wilson's interval of the success rate."""
        return wilson_interval(sum(self.success), len(self.success))


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
    columns: dict[Treatment, dict[Treatment, Contender]] = defaultdict(dict)
    for treatment, runs in treatments_of(results).items():
        if treatment.strategy in results.bounds:
            continue  # nobody can be as good, so it is no contender
        if values := values_of(runs, declared):
            contender = Contender(values, [run.completed for run in runs.values()])
            columns[replace(treatment, strategy="", policy="")][treatment] = contender
    return [rank for column in columns.values() for rank in column_ranks(column, metric, better)]


def column_ranks(column: Mapping[Treatment, Contender], metric: str, better: Better) -> list[Rank]:
    """Ranks of one column of a table; the tests against its best are one family for Holm's correction.

    Args:
        column: what was run under the same conditions.
        metric: its name.
        better: HIGHER or LOWER.
    """
    sign = -1.0 if better is Better.HIGHER else 1.0
    means = {treatment: plain.fmean(one.values.values()) for treatment, one in column.items()}
    tiers = _tiers(column)
    scores = {treatment: (tiers[treatment], sign * means[treatment]) for treatment in column}
    best = min(scores, key=lambda treatment: scores[treatment])
    others = {treatment: one for treatment, one in column.items() if treatment != best}
    paired = {treatment: paired_with(one.values, column[best].values) for treatment, one in others.items()}
    tested = {treatment: found.p for treatment, found in paired.items() if found and found.p is not None}
    corrected = dict(zip(tested, holm(list(tested.values())), strict=True))
    return [
        Rank(
            **treatment.columns(),
            metric=metric,
            n=len(column[treatment].values),
            success_rate=column[treatment].success_rate,
            mean=means[treatment],
            rank=sum(other < score for other in scores.values())
            + (1 + sum(other == score for other in scores.values())) / 2,
            p_holm_to_best=corrected.get(treatment),
            among_best=not tiers[treatment] and corrected.get(treatment, 1.0) >= SIGNIFICANT,
            unequal_success=tiers[treatment] > 0,
        )
        for treatment, score in scores.items()
    ]


def _tiers(column: Mapping[Treatment, Contender]) -> dict[Treatment, int]:
    """Number of the tier of success of each: 0 for those whose interval meets that of the highest rate, and so on."""
    left = sorted(column, key=lambda treatment: -column[treatment].success_rate)
    found: dict[Treatment, int] = {}
    tier = 0
    while left:
        least = column[left[0]].success_interval[0]
        found |= {one: tier for one in left if column[one].success_interval[1] >= least}
        left = [one for one in left if one not in found]
        tier += 1
    return found


def of_unequal_work(rows: Sequence[Comparison], bounds: Collection[str] = ()) -> list[Comparison]:
    """Rows whose success rate is below the best under the same conditions by more than their intervals.

    Args:
        rows: of one metric.
        bounds: strategies that are not compared.
    """
    best: dict[Conditions, Comparison] = {}
    rows = [row for row in rows if row.strategy not in bounds]
    for row in rows:
        first = best.setdefault(_conditions(row), row)
        if row.success_rate > first.success_rate:
            best[_conditions(row)] = row
    return [row for row in rows if row.success_ci95_high < best[_conditions(row)].success_ci95_low]


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


def _conditions(row: Rank | Comparison) -> Conditions:
    return row.scenario, row.channel, row.per, tuple(row.settings.items()), row.unforeseen
