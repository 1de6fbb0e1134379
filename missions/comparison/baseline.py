"""Comparison of strategies and policies with a baseline, over the runs of a sweep.

A row is about one metric of one treatment. Every treatment is compared with the one that differs from it in the
baseline's strategy (or policy) alone, run by run of the same repeat.

A run that did not complete is censored: its mission time is known to be longer than the mission's duration. It stays
in with that duration, so the mean of ``mission_time_s`` is the restricted mean time; ``completed`` as a metric is the
success rate, with Wilson's interval.
"""

from __future__ import annotations

import statistics as plain
from collections.abc import Mapping, Sequence
from dataclasses import replace

from missions.comparison.pairs import Paired, paired_with
from missions.comparison.rows import Comparison
from missions.comparison.treatments import Summary, Treatment, check_name, treatments_of, values_of
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
    design = results.schedule.file.study
    strategies = list(dict.fromkeys([*(design.strategies or ()), *(one.strategy for one in treatments)]))
    policies = list(dict.fromkeys([*(design.policies or ()), *(one.policy for one in treatments)]))
    first = strategies[0] if len(strategies) > 1 or len(policies) == 1 else policies[0]
    baseline = baseline or design.baseline or first
    check_name("--baseline", baseline, [*strategies, *policies])
    by_strategy = baseline in strategies
    return [row for metric in metrics for row in _rows(treatments, metric, baseline, by_strategy)]


def _rows(
    treatments: Mapping[Treatment, Mapping[int, Summary]], metric: str, baseline: str, by_strategy: bool
) -> list[Comparison]:
    """Rows of one metric; its comparisons are one family for Holm's correction."""
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
            compared.get(treatment),
            corrected.get(treatment),
        )
        for treatment, found in values.items()
    ]


def _row(
    treatment: Treatment,
    metric: str,
    baseline: str,
    values: Sequence[float],
    runs: Mapping[int, Summary],
    paired: Paired | None,
    p_holm: float | None,
) -> Comparison:
    """The row of one treatment and metric; ``runs`` are all that finished, ``values`` of those that have the metric."""
    completed = [bool(run["completed"]) for run in runs.values()]
    times_s = [float(run["mission_time_s"]) for run in runs.values()]
    success = wilson_interval(sum(completed), len(completed))
    low, high = (success if metric == "completed" else mean_interval(values)) or (None, None)
    diff_low, diff_high = (paired.interval if paired else None) or (None, None)
    return Comparison(
        **treatment.columns(),
        metric=metric,
        baseline=baseline,
        n=len(values),
        n_completed=sum(completed),
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
        restricted_mean_time_s=restricted_mean_time(times_s, completed, max(times_s)),
    )
