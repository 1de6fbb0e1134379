"""Tests of all pairs of treatments, and the ranking that rests on them.

For a metric, all pairs of treatments under the same conditions form one family, over all conditions of the study, in
the metric and in success (``family_of``). Their p values are ``missions.statistics.step_down_p``: step-down sign flips
of paired differences (Romano and Wolf 2005). So of equal treatments one is told from another in at most 5 % of studies,
whatever the spreads and however far others are behind (measured in ``benchmarks/intervals.py``). ``compare`` prints the
p of a treatment and its baseline, a ranking that of a treatment and the best: both read the same family.

Success comes first: a treatment whose success rate is told from the highest did other work, and its mean time or
distance cannot be set against that of the others. It stands behind them; the metric decides among those of like
success. The direction comes from the declaration of the metric, which the folder of the sweep holds.
"""

from __future__ import annotations

import itertools
import statistics as plain
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from missions.comparison.rows import Rank
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
from missions.statistics import FEW, Array, least_p, step_down_p
from missions.sweeps.folder import SweepResults

ROUNDING = 1e-9
"""Part of the values up to which a difference is of rounding."""
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


Column = Mapping[Treatment, Contender]
"""What was run under the same conditions."""


@dataclass(frozen=True)
class Family:
    """Corrected p values of pairs, in the metric and in success; none of a pair in which nothing was drawn."""

    of_metric: Mapping[frozenset[Treatment], float]
    of_success: Mapping[frozenset[Treatment], float]

    def p(self, one: Treatment, other: Treatment) -> float | None:
        """That two treatments are alike in the metric."""
        return self.of_metric.get(frozenset((one, other)))


def family_of(columns: Sequence[Column]) -> Family:
    """Test all pairs of all columns."""
    own = {treatment: contender for column in columns for treatment, contender in column.items()}
    repeats = sorted({repeat for contender in own.values() if not contender.constant for repeat in contender.success})
    pairs = [
        (one, other)
        for column in columns
        for one, other in itertools.combinations(column, 2)
        if not (own[one].constant and own[other].constant)
    ]
    if not pairs:
        return Family({}, {})
    of_metric = {treatment: _across(it.values, it.constant, repeats) for treatment, it in own.items()}
    of_success = {treatment: _across(it.success, it.constant, repeats) for treatment, it in own.items()}
    differences = [_differences(of[one], of[other]) for of in (of_metric, of_success) for one, other in pairs]
    p = step_down_p(np.array(differences).T)
    names = [frozenset(pair) for pair in pairs]
    return Family(dict(zip(names, p[: len(names)], strict=True)), dict(zip(names, p[len(names) :], strict=True)))


def _across(values: Mapping[int, float], constant: bool, repeats: Sequence[int]) -> Array:
    """Values by repeat, NaN where there is none; a constant one holds for all."""
    return np.array([*values.values()] * len(repeats) if constant else [values.get(at, np.nan) for at in repeats])


def _differences(ours: Array, theirs: Array) -> Array:
    """Differences by repeat, 0 where a side has no value."""
    differences: Array = np.nan_to_num(ours - theirs)
    noise = ROUNDING * float(np.nanmax(np.abs([ours, theirs]), initial=0.0))
    return np.where(np.abs(differences) > noise, differences, 0.0)


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
    if better is Better.NEITHER:
        why = "neither higher nor lower is better"
        raise OutputError(f"--metric {metric!r}: cannot be ranked, {why}; allowed are {', '.join(results.ranked)}")
    columns = columns_of(treatments_of(results), declared, results.metrics[SUCCESS])
    family = family_of(columns)
    return [
        rank
        for column in columns
        if (contenders := without(column, results.bounds))
        for rank in column_ranks(contenders, family, metric, better)
    ]


def columns_of(
    treatments: Mapping[Treatment, Outcomes], metric: MetricRecord, success: MetricRecord
) -> list[dict[Treatment, Contender]]:
    """Treatments that share their conditions.

    Args:
        treatments: with their runs.
        metric: of whose values they have some.
        success: the metric of success.
    """
    columns: dict[Treatment, dict[Treatment, Contender]] = defaultdict(dict)
    for treatment, runs in treatments.items():
        if (own := measured(runs, metric)).values:
            contender = Contender(own.values, values_of(runs, success), own.constant)
            columns[replace(treatment, strategy="", policy="")][treatment] = contender
    return list(columns.values())


def without(column: Column, bounds: Collection[str]) -> Column:
    """Contenders of a column: a bound is none, since no strategy can be as good."""
    return {treatment: own for treatment, own in column.items() if treatment.strategy not in bounds}


def column_ranks(column: Column, family: Family, metric: str, better: Better) -> list[Rank]:
    """Ranks of one column of a table.

    Args:
        column: what was run under the same conditions.
        family: with the tests of its pairs.
        metric: its name.
        better: HIGHER or LOWER.
    """
    sign = -1.0 if better is Better.HIGHER else 1.0
    means = {treatment: plain.fmean(own.values.values()) for treatment, own in column.items()}
    behind = of_less_success(column, family)
    scores = {
        treatment: (1.0 - own.success_rate if treatment in behind else -1.0, sign * means[treatment])
        for treatment, own in column.items()
    }
    best = min(scores, key=lambda treatment: scores[treatment])
    ranks = []
    for treatment, score in scores.items():
        p = family.p(treatment, best)
        ranks.append(
            Rank(
                **treatment.columns(),
                metric=metric,
                n=len(column[treatment].values),
                success_rate=column[treatment].success_rate,
                mean=means[treatment],
                rank=sum(other < score for other in scores.values())
                + (1 + sum(other == score for other in scores.values())) / 2,
                p_to_best=p,
                among_best=treatment not in behind and (score == scores[best] if p is None else p >= SIGNIFICANT),
                unequal_success=treatment in behind,
                deterministic=column[treatment].constant,
            )
        )
    return ranks


def of_less_success(column: Column, family: Family) -> frozenset[Treatment]:
    """Those of a column whose success rate is told from the highest."""
    highest = max(own.success_rate for own in column.values())
    best = [treatment for treatment, own in column.items() if own.success_rate == highest]
    return frozenset(
        treatment
        for treatment, own in column.items()
        if own.success_rate < highest
        and min(family.of_success.get(frozenset((treatment, other)), 0.0) for other in best) < SIGNIFICANT
    )


def too_few(repeats: int) -> str:
    """Warning for a study with too few repeats to tell two treatments apart; empty if they are enough.

    >>> too_few(5)
    '5 repeats: no interval (8 needed), smallest p 0.062; 8 give 0.0078'
    >>> too_few(8)
    ''
    """
    if repeats >= FEW:
        return ""
    n = f"{repeats} repeat{'s' * (repeats > 1)}"
    return f"{n}: no interval ({FEW} needed), smallest p {least_p(repeats):.2g}; {FEW} give {least_p(FEW):.2g}"


def mean_ranks(ranked: Sequence[Rank]) -> dict[tuple[str, str], float | None]:
    """Mean rank of each (strategy, policy) over all conditions; None if it lacks a value under one of them."""
    conditions = {_conditions(rank) for rank in ranked}
    ranks_of: dict[tuple[str, str], list[float]] = defaultdict(list)
    for rank in ranked:
        ranks_of[rank.strategy, rank.policy].append(rank.rank)
    return {name: plain.fmean(places) if len(places) == len(conditions) else None for name, places in ranks_of.items()}


def are_too_few(ranked: Sequence[Rank]) -> bool:
    """True if no strategy could be told from the best of its column, because there are so few runs."""
    drawn = [rank.n for rank in ranked if not rank.deterministic]
    return len(drawn) > 1 and least_p(max(drawn)) >= SIGNIFICANT


def _conditions(row: Rank) -> Conditions:
    return row.scenario, row.channel, row.per, tuple(row.settings.items()), row.unforeseen
