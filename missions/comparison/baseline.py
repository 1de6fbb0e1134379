"""Comparison of strategies and policies with a baseline, over the runs of a sweep (``docs/statistics.md``).

Each treatment is compared, per repeat, with the one that differs only in the baseline's strategy, policy or setting.
"""

from __future__ import annotations

import csv
import io
import json
import statistics as plain
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from missions.comparison.ranking import Rank, columns_of, family_of, of_less_success, without_bounds
from missions.comparison.treatments import (
    SUCCESS,
    Measured,
    Outcomes,
    Paired,
    Treatment,
    TreatmentColumns,
    measured,
    paired_with,
    treatments_of,
)
from missions.errors import check_name
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
from missions.sweeps.study_file import level_name

if TYPE_CHECKING:
    from missions.comparison.effects import MainEffect


@dataclass(frozen=True, kw_only=True)
class Comparison(TreatmentColumns):
    """A row of ``compare``; None for too few runs.

    Args:
        n: runs of the mean; failed runs included for success and censored metrics.
        n_completed: runs with a completed mission; ``n_failed`` raised or killed their process.
        n_reached: runs with the event of a censored metric; None for other metrics.
        p_holm: p value of equality with the baseline, step-down corrected, see ``missions/comparison/ranking.py``.
        ci95_low: of the restricted mean if runs are censored, see ``missions/statistics.py``.
        deterministic: repeats are one run: no interval, no p value.
        ci95_note: reason for a missing interval, or empty; ``diff_note`` is for the difference.
        reached_mean: mean of the uncensored runs; its interval does not cover the others.
        n_pairs: compared pairs; ``n_pairs_reached`` are uncensored on both sides; ``diff_spread`` is the standard
            deviation of their differences.
        diff_reached: mean difference of the latter; its interval does not cover the others.
        unequal_success: significantly below the highest success rate, see ``Rank``.
    """

    metric: str
    baseline: str
    n: int
    n_completed: int
    n_failed: int
    n_reached: int | None
    mean: float
    ci95_low: float | None
    ci95_high: float | None
    median: float
    least: float
    largest: float
    diff_to_baseline: float | None = None
    diff_ci95_low: float | None = None
    diff_ci95_high: float | None = None
    p_holm: float | None = None
    effect_size: float | None = None
    pairing_gain: float | None = None
    success_rate: float
    success_ci95_low: float | None
    success_ci95_high: float | None
    deterministic: bool = False
    ci95_note: str = ""
    diff_note: str = ""
    reached_mean: float | None = None
    reached_ci95_low: float | None = None
    reached_ci95_high: float | None = None
    n_pairs: int = 0
    diff_spread: float | None = None
    n_pairs_reached: int | None = None
    diff_reached: float | None = None
    diff_reached_ci95_low: float | None = None
    diff_reached_ci95_high: float | None = None
    unequal_success: bool = False

    @property
    def is_incomplete(self) -> bool:
        """True if a run did not reach the event of a censored metric."""
        return self.n_reached is not None and self.n_reached < self.n

    @property
    def has_range(self) -> bool:
        """True if least and largest value are shown for want of an interval."""
        return self.ci95_low is None and self.least < self.largest


def compare(
    results: SweepResults, metrics: Sequence[str | Metric] = (), baseline: str | None = None
) -> list[Comparison]:
    """Compare the treatments of a sweep, finished or not: one row per metric and treatment.

    Args:
        metrics: summary fields, or custom metrics (``package.module:object``, ``file.py:object`` or objects) of runs
            with stored tables; empty for those of the study.
        baseline: strategy, policy, or ``KEY=VALUE`` of a varied key, such as ``per=0``; None for that of the study,
            else its first strategy or policy.

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
    strategies, policies = _named(results, treatments)
    # The default baseline is of the kind that the study varies.
    first = strategies[0] if len(strategies) > 1 or len(policies) == 1 else policies[0]
    side = side_of(results, treatments, baseline or design.baseline or first, "--baseline")
    declared = results.metrics
    return [row for metric in names for row in _rows(treatments, declared, metric, side)]


@dataclass(frozen=True)
class Side:
    """Named treatment of a comparison; ``kind`` is ``strategy``, ``policy``, or empty for a level of ``key``."""

    name: str
    kind: str

    @property
    def key(self) -> str:
        """Varied key, or empty."""
        return "" if self.kind else self.name.partition("=")[0]

    @property
    def level(self) -> str:
        """Name without the key."""
        return self.name if self.kind else self.name.partition("=")[2]

    def of(self, treatment: Treatment) -> Treatment:
        """Return the treatment that differs only in this strategy, policy or level."""
        change: dict[str, Any] = {self.kind: self.name}
        return replace(treatment, **change) if self.kind else treatment.at(self.name)


def _named(results: SweepResults, treatments: Iterable[Treatment]) -> tuple[list[str], list[str]]:
    design, treated = results.file.study, list(treatments)
    strategies = dict.fromkeys([*(design.strategies or ()), *(treatment.strategy for treatment in treated)])
    return list(strategies), list(dict.fromkeys([*(design.policies or ()), *(one.policy for one in treated)]))


def side_of(results: SweepResults, treatments: Iterable[Treatment], name: str, option: str) -> Side:
    """Return the strategy, policy or level ``KEY=VALUE`` of this name; raise OutputError for an unknown one."""
    treated = list(treatments)
    strategies, policies = _named(results, treated)
    name, levels = level_name(name), dict.fromkeys(level for treatment in treated for level in treatment.levels)
    check_name(option, name, [*strategies, *policies, *levels])
    return Side(name, "strategy" if name in strategies else "policy" if name in policies else "")


def _rows(
    treatments: Mapping[Treatment, Outcomes], declared: Mapping[str, Metric], name: str, side: Side
) -> list[Comparison]:
    metric = declared[name]
    values = {treated: sample for treated, runs in treatments.items() if (sample := measured(runs, metric)).values}
    columns = columns_of(treatments, metric, declared[SUCCESS])
    family = family_of(columns)
    tested = family_of(columns_of(treatments, metric, declared[SUCCESS], side.name)) if side.key else family
    # No strategy reaches an upper bound, so none is measured by its success.
    contenders = [own for column in columns if (own := without_bounds(column))]
    behind = {treatment for own in contenders for treatment in of_less_success(own, family)}
    compared: dict[Treatment, Paired] = {}
    p: dict[Treatment, float | None] = {}
    for treatment, sample in values.items():
        other = side.of(treatment)
        if other != treatment and other in values and (paired := paired_with(sample, values[other])):
            compared[treatment], p[treatment] = paired, tested.p(treatment, other)
    return [
        replace(
            _row(treatment, metric, side.name, sample, treatments[treatment], compared.get(treatment)),
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
        n_reached=None if sample.reached is None else len(sample.reached),
        mean=sample.mean,
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
        diff_spread=paired.spread,
        n_pairs_reached=paired.n_reached,
        diff_reached=paired.reached,
        **_bounds("diff_ci95", paired.interval),
        **_bounds("diff_reached_ci95", paired.reached_interval),
    )


def _interval(sample: Measured) -> Estimated:
    values = list(sample.values.values())
    if sample.constant:
        return NoInterval.DETERMINISTIC
    # Without incomplete runs, a time is a metric like others: see ``missions.statistics``.
    if sample.reached is None or len(sample.reached) == len(values):
        return mean_interval(values)
    return restricted_interval(Timed(values, [repeat in sample.reached for repeat in sample.values], sample.horizon))


def _bounds(columns: str, interval: Estimated) -> dict[str, Any]:
    low, high = (None, None) if isinstance(interval, NoInterval) else interval
    return {f"{columns}_low": low, f"{columns}_high": high}


def _note(interval: Estimated) -> str:
    return interval.value if isinstance(interval, NoInterval) else ""


def csv_of(rows: Sequence[Comparison] | Sequence[Rank] | Sequence[MainEffect]) -> bytes:
    """Encode rows of one kind as CSV, settings as JSON; without rows the header of a comparison."""
    text = io.StringIO()
    writer = csv.DictWriter(
        text, [field.name for field in fields(rows[0] if rows else Comparison)], lineterminator="\n"
    )
    writer.writeheader()
    for values in map(asdict, rows):
        settings = {"settings": json.dumps(values["settings"])} if "settings" in values else {}
        writer.writerow(values | settings)
    return text.getvalue().encode()
