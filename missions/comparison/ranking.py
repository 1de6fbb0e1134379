"""Tests of all pairs of treatments, and the ranking based on them (``docs/statistics.md``).

For a metric, all pairs of treatments with equal conditions form one family, over all conditions of the study and over
the metric and success. Their p values are ``missions.statistics.step_down_p``.
"""

from __future__ import annotations

import itertools
import statistics as plain
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from missions.comparison.treatments import (
    SIGNIFICANT,
    SUCCESS,
    Measured,
    Outcomes,
    Treatment,
    TreatmentColumns,
    measured,
    treatments_of,
)
from missions.errors import OutputError, check_name
from missions.metric import Better, Metric
from missions.statistics import FEW, Array, least_p, step_down_p
from missions.sweeps.folder import SweepResults, is_bound

ROUNDING = 1e-9  # relative size up to which a difference is rounding


@dataclass(frozen=True, kw_only=True)
class Rank(TreatmentColumns):
    """Rank of a strategy with its policy among those with equal conditions.

    Args:
        rank: by the mean among treatments of similar success, 1 is best; ties share the mean rank (Friedman 1937).
        p_to_best: p value of equality with the best, as in ``Comparison.p_holm``; None for the best and if both are
            deterministic.
        among_best: not significantly different from the best in metric and success; if deterministic, equal to it.
        unequal_success: significantly below the highest success rate, hence ranked last: its mean is of other work.
        deterministic: a single run, not tested.
    """

    metric: str
    n: int
    success_rate: float
    mean: float
    rank: float
    p_to_best: float | None
    among_best: bool
    unequal_success: bool
    deterministic: bool = False


class Contender(NamedTuple):
    """Values in the metric, and success (1 or 0), of a ranked treatment."""

    of_metric: Measured
    of_success: Measured


Column = Mapping[Treatment, Contender]  # treatments with equal conditions


@dataclass(frozen=True)
class Family:
    """Corrected p values of pairs, in the metric and in success; none for deterministic pairs."""

    of_metric: Mapping[frozenset[Treatment], float]
    of_success: Mapping[frozenset[Treatment], float]

    def p(self, first: Treatment, other: Treatment) -> float | None:
        """p value of equality in the metric."""
        return self.of_metric.get(frozenset((first, other)))


def family_of(columns: Sequence[Column]) -> Family:
    """Test all pairs of treatments within each column of equal conditions."""
    own = {treatment: contender for column in columns for treatment, contender in column.items()}
    successes = {treatment: contender.of_success for treatment, contender in own.items()}
    repeats = sorted({repeat for sample in successes.values() if not sample.constant for repeat in sample.values})
    pairs = [
        (first, other)
        for column in columns
        for first, other in itertools.combinations(column, 2)
        if not (successes[first].constant and successes[other].constant)
    ]
    if not pairs:
        return Family({}, {})
    rows = {treatment: [sample.row(repeats) for sample in it] for treatment, it in own.items()}
    differences = [differences_of(rows[first][part], rows[other][part]) for part in (0, 1) for first, other in pairs]
    p = step_down_p(np.array(differences).T)
    # The first half of the p values is for the metric, the second for success, in the order of pairs.
    names = [frozenset(pair) for pair in pairs]
    return Family(dict(zip(names, p[: len(names)], strict=True)), dict(zip(names, p[len(names) :], strict=True)))


def differences_of(ours: Array, theirs: Array) -> Array:
    """Differences by repeat, 0 for missing ones and for rounding."""
    differences: Array = np.nan_to_num(ours - theirs)
    # Equal runs may differ by rounding, and a sign test ignores how little.
    noise = ROUNDING * float(np.nanmax(np.abs([ours, theirs]), initial=0.0))
    return np.where(np.abs(differences) > noise, differences, 0.0)


def ranks(results: SweepResults, metric: str) -> list[Rank]:
    """Rank strategies and policies under each condition; raises OutputError without results or direction."""
    declared = rankable(metric, results.metrics)
    columns = columns_of(treatments_of(results), declared, results.metrics[SUCCESS])
    family = family_of(columns)
    return [
        rank
        for column in columns
        if (contenders := without_bounds(column))
        for rank in column_ranks(contenders, family, declared)
    ]


def rankable(name: str, metrics: Mapping[str, Metric]) -> Metric:
    """Return a metric with a preferred direction; raise OutputError for another one, with the allowed names."""
    check_name("--metric", name, metrics)
    if (metric := metrics[name]).better is Better.NEITHER:
        why = "neither higher nor lower is better"
        allowed = ", ".join(name for name, known in metrics.items() if known.better is not Better.NEITHER)
        raise OutputError(f"--metric {name!r}: cannot be ranked, {why}; allowed are {allowed}")
    return metric


def columns_of(
    treatments: Mapping[Treatment, Outcomes], metric: Metric, success: Metric, setting: str = ""
) -> list[dict[Treatment, Contender]]:
    """Group treatments with values of the metric by their conditions; with a ``setting``, those that differ in it."""
    columns: dict[Treatment, dict[Treatment, Contender]] = defaultdict(dict)
    for treatment, runs in treatments.items():
        if (own := measured(runs, metric)).values:
            conditions = treatment.at(setting) if setting else replace(treatment, strategy="", policy="")
            columns[conditions][treatment] = Contender(own, measured(runs, success))
    return list(columns.values())


def without_bounds(column: Column) -> Column:
    """Return a column without upper bounds, which no strategy can reach."""
    return {treatment: own for treatment, own in column.items() if not is_bound(treatment.strategy)}


def column_ranks(column: Column, family: Family, metric: Metric, level: float = SIGNIFICANT) -> list[Rank]:
    """Ranks of one column by tests at ``level``; higher or lower values of the metric are better."""
    behind = of_less_success(column, family, level)
    scores = {
        treatment: (1.0 - success.mean if treatment in behind else -1.0, metric.sign * own.mean)
        for treatment, (own, success) in column.items()
    }
    # The first key puts treatments of less success last, by success, and leaves all others equal.
    best = min(scores, key=lambda treatment: scores[treatment])
    ranks = []
    for treatment, score in scores.items():
        (own, success), p = column[treatment], family.p(treatment, best)
        ranks.append(
            Rank(
                **treatment.columns(),
                metric=metric.name,
                n=len(own.values),
                success_rate=success.mean,
                mean=own.mean,
                rank=sum(other < score for other in scores.values())
                + (1 + sum(other == score for other in scores.values())) / 2,
                p_to_best=p,
                among_best=treatment not in behind and (score == scores[best] if p is None else p >= level),
                unequal_success=treatment in behind,
                deterministic=own.constant,
            )
        )
    return ranks


def of_less_success(column: Column, family: Family, level: float = SIGNIFICANT) -> frozenset[Treatment]:
    """Treatments significantly below the highest success rate of a column."""
    rates = {treatment: success.mean for treatment, (_, success) in column.items()}
    highest = max(rates.values())
    best = [treatment for treatment, rate in rates.items() if rate == highest]
    return frozenset(
        treatment
        for treatment, rate in rates.items()
        if rate < highest
        # Deterministic pairs are not tested: their difference is certain, hence p = 0.
        and min(family.of_success.get(frozenset((treatment, other)), 0.0) for other in best) < level
    )


def too_few(repeats: int) -> str:
    """Warning for a study with too few repeats for any significance, or empty.

    >>> too_few(5), too_few(8)
    ('5 repeats: no interval (8 needed), smallest p 0.062; 8 give 0.0078', '')
    """
    if repeats >= FEW:
        return ""
    n = f"{repeats} repeat{'s' * (repeats > 1)}"
    return f"{n}: no interval ({FEW} needed), smallest p {least_p(repeats):.2g}; {FEW} give {least_p(FEW):.2g}"


def mean_ranks(ranked: Sequence[Rank]) -> dict[tuple[str, str], float | None]:
    """Mean rank of each (strategy, policy) over all conditions; None if one is missing."""
    conditions = {(r.scenario, r.channel, r.per, tuple(r.settings.items()), r.unforeseen) for r in ranked}
    ranks_of: dict[tuple[str, str], list[float]] = defaultdict(list)
    for rank in ranked:
        ranks_of[rank.strategy, rank.policy].append(rank.rank)
    return {name: plain.fmean(places) if len(places) == len(conditions) else None for name, places in ranks_of.items()}


def are_too_few(ranked: Sequence[Rank]) -> bool:
    """True if the number of runs permits no significant difference from the best."""
    drawn = [rank.n for rank in ranked if not rank.deterministic]
    return len(drawn) > 1 and least_p(max(drawn)) >= SIGNIFICANT
