"""Comparison of strategies and policies with a baseline, over the runs of a sweep.

A row is for one metric of one treatment. Each treatment is compared, per repeat, with the one that differs only in the
baseline's strategy (or policy).

A run without the event of a censored metric, such as completion, or a failed run, counts with the mission's duration.
All runs of a treatment have the same duration, so the mean of these restricted times is the integral of the
Kaplan-Meier curve up to it. ``completed`` is the success rate with Wilson's interval; failed runs have not completed.
"""

from __future__ import annotations

import statistics as plain
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from missions.comparison.ranking import columns_of, family_of, of_less_success, without
from missions.comparison.rows import Comparison
from missions.comparison.treatments import (
    SUCCESS,
    Measured,
    Outcomes,
    Paired,
    Treatment,
    check_name,
    measured,
    n_reached,
    paired_with,
    treatments_of,
)
from missions.metric import Metric
from missions.statistics import (
    Estimated,
    NoInterval,
    Timed,
    mean_interval,
    restricted_interval,
    wilson_interval,
)
from missions.sweeps.folder import SweepResults


def compare(
    results: SweepResults, metrics: Sequence[str | Metric] = (), baseline: str | None = None
) -> list[Comparison]:
    """Compare the treatments of a sweep, finished or not: one row per metric and treatment.

    Args:
        metrics: summary fields; or custom metrics (``package.module:object``, ``file.py:object`` or objects), computed
            from stored tables; empty: those of the study.
        baseline: strategy or policy; None: that of the study, else its first strategy or policy.

    Raises:
        OutputError: nothing has finished, a name is unknown, or tables are missing.
        PluginError: a custom metric cannot be loaded, or fails.
    """
    results, names = results.naming(metrics)
    treatments = treatments_of(results)
    names = tuple(dict.fromkeys(names)) or results.compared
    for metric in names:
        check_name("--metric", metric, results.metrics)
    design = results.file.study
    strategies = list(dict.fromkeys([*(design.strategies or ()), *(treated.strategy for treated in treatments)]))
    policies = list(dict.fromkeys([*(design.policies or ()), *(treated.policy for treated in treatments)]))
    first = strategies[0] if len(strategies) > 1 or len(policies) == 1 else policies[0]
    baseline = baseline or design.baseline or first
    check_name("--baseline", baseline, [*strategies, *policies])
    by_strategy = baseline in strategies
    declared = results.metrics
    return [
        row for metric in names for row in _rows(treatments, declared, metric, baseline, by_strategy, results.bounds)
    ]


def _rows(
    treatments: Mapping[Treatment, Outcomes],
    declared: Mapping[str, Metric],
    name: str,
    baseline: str,
    by_strategy: bool,
    bounds: Collection[str],
) -> list[Comparison]:
    metric = declared[name]
    values = {treated: sample for treated, runs in treatments.items() if (sample := measured(runs, metric)).values}
    columns = columns_of(treatments, metric, declared[SUCCESS])
    family = family_of(columns)
    contenders = [own for column in columns if (own := without(column, bounds))]
    behind = {treatment for own in contenders for treatment in of_less_success(own, family)}
    compared: dict[Treatment, Paired] = {}
    p: dict[Treatment, float | None] = {}
    for treatment, sample in values.items():
        other = replace(treatment, strategy=baseline) if by_strategy else replace(treatment, policy=baseline)
        if other != treatment and other in values and (paired := paired_with(sample, values[other])):
            compared[treatment], p[treatment] = paired, family.p(treatment, other)
    return [
        replace(
            _row(treatment, metric, baseline, sample, treatments[treatment], compared.get(treatment)),
            p_holm=p.get(treatment),
            unequal_success=treatment in behind,
        )
        for treatment, sample in values.items()
    ]


def _row(
    treatment: Treatment,
    metric: Metric,
    baseline: str,
    sample: Measured,
    runs: Outcomes,
    paired: Paired | None,
) -> Comparison:
    """Row of one treatment and metric; ``runs`` are all runs, ``sample`` those with the metric."""
    values = list(sample.values.values())
    completed = [run.completed for run in runs.values()]
    success = NoInterval.DETERMINISTIC if sample.constant else wilson_interval(sum(completed), len(completed))
    interval = success if metric.name == SUCCESS else _interval(sample)
    reached = [sample.values[repeat] for repeat in sample.reached or ()]
    of_reached = NoInterval.DETERMINISTIC if sample.constant else mean_interval(reached)
    row = Comparison(
        **treatment.columns(),
        metric=metric.name,
        baseline=baseline,
        n=len(values),
        n_completed=sum(completed),
        n_failed=sum(run.failed for run in runs.values()),
        n_reached=n_reached(runs, metric),
        mean=plain.fmean(values),
        median=plain.median(values),
        least=min(values),
        largest=max(values),
        success_rate=sum(completed) / len(completed),
        deterministic=sample.constant,
        ci95_note=_note(interval),
        reached_mean=plain.fmean(reached) if reached else None,
        **_bounds("ci95", interval),
        **_bounds("success_ci95", success),
        **_bounds("reached_ci95", of_reached),
    )
    if paired is None:
        return row
    return replace(
        row,
        diff_to_baseline=paired.difference,
        diff_note=_note(paired.interval),
        effect_size=paired.effect,
        pairing_gain=paired.gain,
        n_pairs=paired.n,
        n_pairs_reached=paired.n_reached,
        diff_reached=paired.reached,
        **_bounds("diff_ci95", paired.interval),
        **_bounds("diff_reached_ci95", paired.reached_interval),
    )


def _interval(sample: Measured) -> Estimated:
    """Interval of the mean; restricted for a censored metric."""
    values = list(sample.values.values())
    if sample.constant:
        return NoInterval.DETERMINISTIC
    if sample.reached is None:
        return mean_interval(values)
    return restricted_interval(Timed(values, [repeat in sample.reached for repeat in sample.values], sample.horizon))


def _bounds(columns: str, interval: Estimated) -> dict[str, Any]:
    low, high = (None, None) if isinstance(interval, NoInterval) else interval
    return {f"{columns}_low": low, f"{columns}_high": high}


def _note(interval: Estimated) -> str:
    return interval.value if isinstance(interval, NoInterval) else ""
