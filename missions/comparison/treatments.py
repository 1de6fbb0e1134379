"""Treatments of a study (configurations without their repeat), and their paired differences."""

from __future__ import annotations

import statistics as plain
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from missions.errors import OutputError
from missions.files import dotted
from missions.metric import Metric
from missions.statistics import (
    Array,
    Estimated,
    NoInterval,
    Timed,
    difference_interval,
    effect_size,
    pairing_gain,
    restricted_difference_interval,
)
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import DONE, Line
from missions.sweeps.plan import DRAWN, UNFORESEEN, outcome
from missions.sweeps.study_file import FAULT, KEY_OF_PER, OWN_COLUMNS, PER, StudyFile, level_name

SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Paired:
    """Differences between two treatments over ``n`` pairs; None for too few. ``reached`` is for uncensored pairs.

    ``spread`` is the standard deviation of the differences.
    """

    difference: float
    interval: Estimated
    effect: float | None
    gain: float | None
    n: int
    spread: float | None = None
    n_reached: int | None = None
    reached: float | None = None
    reached_interval: Estimated = NoInterval.TOO_FEW


def paired_with(ours: Measured, theirs: Measured) -> Paired | None:
    """Difference to a baseline over common repeats (all, if deterministic); None without any."""
    if ours.constant and theirs.constant:
        (own,), (other,) = ours.values.values(), theirs.values.values()
        return Paired(own - other, NoInterval.DETERMINISTIC, None, None, 1)
    a, b = ours.over(theirs.values), theirs.over(ours.values)
    shared = [repeat for repeat in a.values if repeat in b.values]
    if not shared:
        return None
    mine, others = [a.values[repeat] for repeat in shared], [b.values[repeat] for repeat in shared]
    differences = [x - y for x, y in zip(mine, others, strict=True)]
    paired = Paired(
        plain.fmean(differences),
        difference_interval(differences),
        effect_size(mine, others),
        pairing_gain(mine, others),
        len(shared),
        plain.stdev(differences) if len(shared) > 1 else None,
    )
    if a.reached is None or b.reached is None:
        return paired
    both = a.reached & b.reached
    reached = [x for x, repeat in zip(differences, shared, strict=True) if repeat in both]
    if len(reached) == len(shared):
        return replace(paired, n_reached=len(shared), reached=paired.difference, reached_interval=paired.interval)
    interval = restricted_difference_interval(
        Timed(mine, [repeat in a.reached for repeat in shared], a.horizon, a.constant),
        Timed(others, [repeat in b.reached for repeat in shared], b.horizon, b.constant),
    )
    mean = plain.fmean(reached) if reached else None
    return replace(
        paired, interval=interval, n_reached=len(reached), reached=mean, reached_interval=difference_interval(reached)
    )


FIELDS = ("scenario", "strategy", "policy", "channel", "per")
SUCCESS, MISSION_TIME = "completed", "mission_time_s"  # metrics that failed runs have too: they have not completed

Summary = Mapping[str, Any]


@dataclass(frozen=True)
class Treatment:
    """A configuration; ``settings`` are further varied keys, ``unforeseen`` the case or empty.

    ``rate`` is the loss rate that the study sets; None if the mean loss rate ``per`` follows from the rest.
    """

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float = field(compare=False)
    settings: tuple[tuple[str, str], ...]
    unforeseen: str = ""
    rate: float | None = None

    def columns(self) -> dict[str, Any]:
        """Columns of a row that identify the treatment."""
        columns = {**vars(self), "settings": dict(self.settings)}
        del columns["rate"]
        return columns

    @property
    def levels(self) -> tuple[str, ...]:
        """Loss rate and settings, each as ``KEY=VALUE``."""
        return level_name(f"{PER}={self.per}"), *(f"{key}={value}" for key, value in self.settings)

    def at(self, baseline: str) -> Treatment:
        """Return the treatment with a setting ``KEY=VALUE``, or loss rate ``per=VALUE``, in place of its own."""
        key, _, value = baseline.partition("=")
        if key == PER:
            return replace(self, per=float(value), rate=float(value))
        settings = tuple((own, value if own == key else level) for own, level in self.settings)
        return replace(self, settings=settings)


@dataclass(frozen=True, kw_only=True)
class TreatmentColumns:
    """Columns of a row that identify its treatment."""

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float
    settings: dict[str, str]
    unforeseen: str


@dataclass(frozen=True)
class RunOutcome:
    """Outcome of a run; ``summary`` lacks metrics after a failure, a ``constant`` run stands for all repeats."""

    summary: Summary
    failed: bool
    duration_s: float
    constant: bool = False

    @property
    def completed(self) -> bool:
        """True if the mission completed."""
        return not self.failed and bool(self.summary["completed"])


Outcomes = Mapping[int, RunOutcome]  # outcomes of a treatment by repeat


def treatments_of(results: SweepResults) -> dict[Treatment, dict[int, RunOutcome]]:
    """Outcomes by treatment and repeat in a fixed order; raises OutputError if no run has finished."""
    file = results.file
    place = {case.name: number for number, case in enumerate(file.unforeseen)}
    grouped: dict[Treatment, dict[int, RunOutcome]] = {}
    left_out = settings_alike(file)
    for line in results.lines.values():
        outcome = RunOutcome(line["summary"], line["status"] != DONE, line["duration_s"])
        grouped.setdefault(treatment_of(line, left_out), {})[line["repeat"]] = outcome
    if not grouped:
        raise OutputError(f"{results.folder}: no run has finished yet, there is nothing to compare")
    in_order = sorted(
        grouped, key=lambda treatment: (place.get(treatment.unforeseen, len(place)), *_in_order(treatment))
    )
    of_sample = {metric.name for metric in results.measured.values()}
    return {treatment: _distinct(dict(sorted(grouped[treatment].items())), of_sample) for treatment in in_order}


def _distinct(runs: dict[int, RunOutcome], of_sample: Collection[str]) -> dict[int, RunOutcome]:
    """Return the runs, or the first of deterministic replicates, compared without ``of_sample``."""
    if not is_one_run(runs, of_sample):
        return runs
    first = next(iter(runs))
    return {first: replace(runs[first], constant=True)}


def is_one_run(runs: Outcomes, of_sample: Collection[str] = ()) -> bool:
    """Return True if the repeats of a treatment are deterministic replicates."""
    # A run records whether it used random draws; without any, its seed has no effect.
    drawn_in = [run.summary.get(DRAWN) for run in runs.values()]
    if any(run.failed for run in runs.values()) or any(drawn is True for drawn in drawn_in):
        return False
    # Custom code may leave this unknown: then at least two repeats must agree in the whole summary.
    if any(drawn is not False for drawn in drawn_in) and len(drawn_in) < 2:
        return False
    first, *others = (outcome(run.summary, of_sample) for run in runs.values())
    return all(other == first for other in others)


def settings_alike(file: StudyFile) -> set[str]:
    """Settings that do not distinguish treatments: own columns, those common to all runs, those of a case."""
    cases = {key for case in file.unforeseen for key, _ in (*dotted(case.set), (FAULT, None))}
    return {*OWN_COLUMNS, *(key for key, _ in dotted(file.set)), *cases, UNFORESEEN}


def treatment_of(line: Line, left_out: Collection[str]) -> Treatment:
    """Return the treatment of a run; ``left_out`` are the ``settings_alike`` of its study."""
    settings = tuple((key, str(value)) for key, value in sorted(line["settings"].items()) if key not in left_out)
    scenario, strategy, policy, channel, per = (line["summary"][key] for key in FIELDS)
    case = line["settings"].get(UNFORESEEN, "")
    return Treatment(scenario, strategy, policy, channel, per, settings, case, line["settings"].get(KEY_OF_PER))


def _in_order(treatment: Treatment) -> tuple[Any, ...]:
    settings = tuple((key, _number(value), value) for key, value in treatment.settings)
    return treatment.scenario, treatment.channel, treatment.per, settings, treatment.strategy, treatment.policy


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def values_of(runs: Outcomes, metric: Metric) -> dict[int, float]:
    """Values of a metric by repeat; failed runs have not completed.

    For metrics without censoring, runs without a value (a latency without a packet) or without meaning are omitted.
    """
    if metric.name == SUCCESS:
        return {repeat: float(run.completed) for repeat, run in runs.items()}
    applies = any(metric.name in run.summary for run in runs.values()) or all(run.failed for run in runs.values())
    values: dict[int, float] = {}
    for repeat, run in runs.items():
        value = run.summary.get(metric.name)
        # All runs have the same limit, so this mean is the integral of the Kaplan-Meier curve. A failed run has no
        # metrics: whether this one applies follows from the others.
        if value is None and metric.censored and (metric.name in run.summary or (run.failed and applies)):
            value = run.duration_s
        if value is not None:
            values[repeat] = float(value)
    return values


@dataclass(frozen=True)
class Measured:
    """Values by repeat, ``horizon`` if censored; ``reached`` are uncensored repeats, None without censoring."""

    values: Mapping[int, float]
    reached: frozenset[int] | None = None
    horizon: float = 0.0
    constant: bool = False

    @property
    def mean(self) -> float:
        """Mean over the repeats."""
        return plain.fmean(self.values.values())

    def row(self, repeats: Sequence[int]) -> Array:
        """Return the values in these repeats, NaN for a missing one; a constant value stands for all."""
        values = self.over(repeats).values
        return np.array([values.get(repeat, np.nan) for repeat in repeats])

    def over(self, repeats: Collection[int]) -> Measured:
        """Return a constant value repeated over ``repeats``, else itself."""
        if not self.constant:
            return self
        (value,) = self.values.values()
        reached = self.reached if self.reached is None else frozenset(repeats if self.reached else ())
        return replace(self, values=dict.fromkeys(repeats, value), reached=reached)


def measured(runs: Outcomes, metric: Metric) -> Measured:
    """Values of a metric, see ``values_of``, with censoring."""
    values = values_of(runs, metric)
    constant = any(run.constant for run in runs.values())
    if not metric.censored:
        return Measured(values, constant=constant)
    reached = frozenset(repeat for repeat in values if _has_reached(runs[repeat], metric))
    horizon = max([*(runs[repeat].duration_s for repeat in values), *values.values()], default=0.0)
    return Measured(values, reached, horizon, constant)


def _has_reached(run: RunOutcome, metric: Metric) -> bool:
    return run.completed if metric.name == MISSION_TIME else run.summary.get(metric.name) is not None
