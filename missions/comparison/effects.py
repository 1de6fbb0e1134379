"""Main effects of the factors of a two-level study, and interactions of two factors, paired by seed.

The effect of a factor is the mean of the runs at its high level less the mean of those at its low level; that of an
interaction takes the product of two factors for a factor. Runs of one repeat share their seed, and a design has as many
of them at each level of a factor for each level of any other: so each repeat gives a value of each effect, in which
what the seed drew is nearly the same on both sides. The values of the repeats give the mean and its interval. Source:
Box, Hunter, Hunter 2005, chapters 5 and 6.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from missions.comparison.treatments import Measured, Treatment, check_name, measured, treatments_of
from missions.errors import OutputError
from missions.metric import MetricRecord
from missions.statistics import NoInterval, difference_interval
from missions.sweeps.factorial import HIGH, FactorialDesign, Term
from missions.sweeps.folder import SweepResults
from missions.sweeps.study import factorial_of

ALL = "all"
"""Condition of the mean over all conditions."""
OWN_NAMES = {"strategy.name": "strategy", "communication.policy": "policy"}
"""Factors that are columns of a treatment."""


@dataclass(frozen=True, kw_only=True)
class MainEffect:
    """A row of ``effects``; None where too few runs can say.

    Args:
        condition: what is the same in all runs of the row; ``all`` for the mean over the conditions.
        term: the factor, or the two that are multiplied.
        low, high: levels of a factor; empty for an interaction.
        aliases: what the design cannot tell from it, main effects and interactions of two factors.
        n: repeats, of which each gives a value.
        n_missing: runs that did not reach the event of a censored metric, and count with the whole duration.
        mean: of all runs.
        effect: mean at the high level less mean at the low level.
    """

    condition: str
    metric: str
    term: str
    is_main: bool
    low: str
    high: str
    aliases: str
    n: int
    n_missing: int
    mean: float
    effect: float
    ci95_low: float | None
    ci95_high: float | None
    note: str


@dataclass(frozen=True)
class Response:
    """Values of a metric under one condition.

    Args:
        values: of each repeat, run by run of the design.
        n_missing: runs that count with the whole duration.
        constant: nothing was drawn in any of them, so repeats are one.
    """

    values: Mapping[int, Sequence[float]]
    n_missing: int
    constant: bool


def effects_of(results: SweepResults, metrics: Sequence[str] = ()) -> list[MainEffect]:
    """Effects of the factors of a study whose sampling is ``factorial``.

    Args:
        results: of the sweep, finished or not; conditions of which a run of the design is missing are left out.
        metrics: fields of the summary; those of the study if empty.

    Returns:
        Metric by metric and condition by condition, main effects first.

    Raises:
        OutputError: the study is of another design, no condition has all runs of it, or a metric is not known.
    """
    if not results.file.factors:
        raise OutputError(f'{results.folder}: effects need a study with sampling = "factorial"; see its [study]')
    names = tuple(dict.fromkeys(metrics)) or results.compared
    for name in names:
        check_name("--metric", name, results.metrics)
    design, levels = factorial_of(results.file), results.file.factors
    rows: list[MainEffect] = []
    for name in names:
        responses = _responses(results, design, results.metrics[name])
        for condition, response in responses.items():
            rows += [_row(design, levels, name, condition, response, term) for term in design.terms]
    if not rows:
        raise OutputError(f"{results.folder}: no condition has all {len(design.runs)} runs of the design yet")
    return rows


def _responses(results: SweepResults, design: FactorialDesign, metric: MetricRecord) -> dict[str, Response]:
    """Values of a metric by condition; of several conditions, their mean too."""
    levels = results.file.factors
    place = {
        tuple((key, str(levels[key][level == HIGH])) for key, level in run.items()): number
        for number, run in enumerate(design.runs)
    }
    samples: dict[str, dict[int, Measured]] = {}
    for treatment, runs in treatments_of(results).items():
        settings = dict(treatment.settings) | {key: getattr(treatment, own) for key, own in OWN_NAMES.items()}
        number = place[tuple((key, str(settings[key])) for key in design.factors)]
        samples.setdefault(_condition(treatment, design.factors), {})[number] = measured(runs, metric)
    found: dict[str, Response] = {}
    for condition, by_run in samples.items():
        if len(by_run) == len(design.runs) and all(sample.values for sample in by_run.values()):
            found[condition] = _response([by_run[number] for number in range(len(design.runs))])
    if len(found) > 1:
        found = {ALL: _mean_of(list(found.values())), **found}
    return {condition: response for condition, response in found.items() if response.values}


def _condition(treatment: Treatment, factors: Sequence[str]) -> str:
    """What is the same in all runs of a design, in words."""
    parts = [treatment.scenario]
    parts += [getattr(treatment, own) for key, own in OWN_NAMES.items() if key not in factors]
    parts += [f"{treatment.channel} per {treatment.per:g}"]
    parts += [f"{key}={value}" for key, value in treatment.settings if key not in factors]
    return ", ".join([*parts, *([treatment.unforeseen] if treatment.unforeseen else [])])


def _response(samples: Sequence[Measured]) -> Response:
    """The values of the repeats that all runs of the design have; a run in which nothing was drawn has all."""
    constant = all(sample.constant for sample in samples)
    drawn = [set(sample.values) for sample in samples if not sample.constant]
    repeats = sorted(set.intersection(*drawn)) if drawn else sorted(samples[0].values)
    everywhere = [sample.over(repeats) for sample in samples]
    values = {repeat: [sample.values[repeat] for sample in everywhere] for repeat in repeats}
    missing = sum(len(set(repeats) - sample.reached) for sample in everywhere if sample.reached is not None)
    return Response(values, missing, constant)


def _mean_of(responses: Sequence[Response]) -> Response:
    """The mean over conditions, repeat by repeat."""
    drawn = [set(response.values) for response in responses if not response.constant]
    repeats = sorted(set.intersection(*drawn)) if drawn else sorted(responses[0].values)
    of = [
        [next(iter(response.values.values())) if response.constant else response.values[repeat] for repeat in repeats]
        for response in responses
    ]
    values = {
        repeat: [statistics.fmean(column) for column in zip(*(each[number] for each in of), strict=True)]
        for number, repeat in enumerate(repeats)
    }
    return Response(values, sum(response.n_missing for response in responses), not drawn)


def _row(
    design: FactorialDesign,
    levels: Mapping[str, Sequence[object]],
    metric: str,
    condition: str,
    response: Response,
    term: Term,
) -> MainEffect:
    """One effect on one metric under one condition."""
    column = design.column(term)
    of_repeats = [
        math.fsum(sign * value for sign, value in zip(column, values, strict=True)) / (len(column) / 2)
        for values in response.values.values()
    ]
    interval = NoInterval.DETERMINISTIC if response.constant else difference_interval(of_repeats)
    low, high = (None, None) if isinstance(interval, NoInterval) else interval
    is_main = len(term) == 1
    name = design.named(term)
    return MainEffect(
        condition=condition,
        metric=metric,
        term=name,
        is_main=is_main,
        low=str(levels[name][0]) if is_main else "",
        high=str(levels[name][1]) if is_main else "",
        aliases="; ".join(map(design.named, design.aliases(term))),
        n=1 if response.constant else len(of_repeats),
        n_missing=response.n_missing,
        mean=statistics.fmean(value for values in response.values.values() for value in values),
        effect=statistics.fmean(of_repeats),
        ci95_low=low,
        ci95_high=high,
        note=interval.value if isinstance(interval, NoInterval) else "",
    )
