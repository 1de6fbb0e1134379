"""Comparison of strategies and policies with a baseline, over the runs of a sweep.

A row is about one metric of one treatment. Every treatment is compared with the one that differs from it in the
baseline's strategy (or policy) alone, run by run of the same repeat.

A run that did not reach the event of a censored metric, such as completion, is known to need longer than the mission's
duration. It stays in with that duration, and so does a run that failed. All runs of a treatment are watched as long,
so the mean of these restricted times is the integral of the Kaplan-Meier curve up to the duration. ``completed`` as a
metric is the success rate, with Wilson's interval; failed runs have not completed.
"""

from __future__ import annotations

import statistics as plain
from collections.abc import Mapping, Sequence
from dataclasses import replace

from missions.comparison.pairs import Paired, paired_with
from missions.comparison.rows import Comparison
from missions.comparison.treatments import (
    MISSION_TIME,
    SUCCESS,
    Outcomes,
    Treatment,
    check_name,
    n_reached,
    treatments_of,
    values_of,
)
from missions.metric import MetricRecord
from missions.statistics import FEW, holm, mean_interval, restricted_mean_time, wilson_interval
from missions.sweeps.folder import SweepResults

INTERVALS_OF_MEANS = f"95 % intervals of the mean (bootstrap; Student's t below {FEW} runs)"


def compare(results: SweepResults, metrics: Sequence[str] = (), baseline: str | None = None) -> list[Comparison]:
    """Compare the treatments of a sweep, finished or not.

    Args:
        results: see ``SweepResults.read``.
        metrics: fields of the summary; those of the study if empty.
        baseline: a strategy or a policy; that of the study, or its first strategy or policy, if left out.

    Returns:
        Metric by metric a row for each treatment that has values.

    Raises:
        OutputError: nothing has finished, or a name is unknown.
    """
    treatments = treatments_of(results)
    metrics = tuple(metrics) or results.compared
    for metric in metrics:
        check_name("--metric", metric, results.metrics)
    design = results.file.study
    strategies = list(dict.fromkeys([*(design.strategies or ()), *(one.strategy for one in treatments)]))
    policies = list(dict.fromkeys([*(design.policies or ()), *(one.policy for one in treatments)]))
    first = strategies[0] if len(strategies) > 1 or len(policies) == 1 else policies[0]
    baseline = baseline or design.baseline or first
    check_name("--baseline", baseline, [*strategies, *policies])
    by_strategy = baseline in strategies
    declared = results.metrics
    return [row for metric in metrics for row in _rows(treatments, declared, metric, baseline, by_strategy)]


def _rows(
    treatments: Mapping[Treatment, Outcomes],
    declared: Mapping[str, MetricRecord],
    name: str,
    baseline: str,
    by_strategy: bool,
) -> list[Comparison]:
    """Rows of one metric; its comparisons are one family for Holm's correction."""
    metric = declared[name]
    times_s = {one: values_of(runs, declared[MISSION_TIME]) for one, runs in treatments.items()}
    values = {one: found for one, runs in treatments.items() if (found := values_of(runs, metric))}
    compared: dict[Treatment, Paired] = {}
    for treatment, found in values.items():
        other = replace(treatment, strategy=baseline) if by_strategy else replace(treatment, policy=baseline)
        if other != treatment and other in values and (paired := paired_with(found, values[other])):
            compared[treatment] = paired
    tested = {treatment: paired.p for treatment, paired in compared.items() if paired.p is not None}
    corrected = dict(zip(tested, holm(list(tested.values())), strict=True))
    return [
        _row(
            treatment,
            metric,
            baseline,
            list(found.values()),
            treatments[treatment],
            times_s[treatment],
            compared.get(treatment),
            corrected.get(treatment),
        )
        for treatment, found in values.items()
    ]


def _row(
    treatment: Treatment,
    metric: MetricRecord,
    baseline: str,
    values: Sequence[float],
    runs: Outcomes,
    times_s: Mapping[int, float],
    paired: Paired | None,
    p_holm: float | None,
) -> Comparison:
    """The row of one treatment and metric; ``runs`` are all that were made, ``values`` those of the metric."""
    completed = [run.completed for run in runs.values()]
    timed = [runs[repeat].completed for repeat in times_s]
    horizon_s = max(times_s.values(), default=0.0)
    success = wilson_interval(sum(completed), len(completed))
    low, high = (success if metric.name == SUCCESS else mean_interval(values)) or (None, None)
    diff_low, diff_high = (paired.interval if paired else None) or (None, None)
    return Comparison(
        **treatment.columns(),
        metric=metric.name,
        baseline=baseline,
        n=len(values),
        n_completed=sum(completed),
        n_failed=sum(run.failed for run in runs.values()),
        n_reached=n_reached(runs, metric),
        mean=plain.fmean(values),
        ci95_low=low,
        ci95_high=high,
        median=plain.median(values),
        diff_to_baseline=paired.difference if paired else None,
        diff_ci95_low=diff_low,
        diff_ci95_high=diff_high,
        p_holm=p_holm,
        effect_size=paired.effect if paired else None,
        pairing_gain=paired.gain if paired else None,
        success_rate=sum(completed) / len(completed),
        success_ci95_low=success[0],
        success_ci95_high=success[1],
        restricted_mean_time_s=restricted_mean_time(list(times_s.values()), timed, horizon_s),
    )
