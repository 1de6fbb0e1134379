"""Main effects of a two-level study and interactions of two factors, paired by seed.

The effect of a factor is the mean at its high level less the mean at its low level; an interaction uses the product of
two factors (Box, Hunter, Hunter 2005, chapters 5 and 6). Each repeat gives a value of each effect.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from missions.comparison.treatments import Measured, Treatment, measured, treatments_of
from missions.errors import OutputError, check_name
from missions.metric import Metric
from missions.statistics import NoInterval, difference_interval
from missions.sweeps.factorial import HIGH, FactorialDesign, Term
from missions.sweeps.folder import SweepResults

ALL = "all"  # condition of the mean over all conditions
OWN_NAMES = {"strategy.name": "strategy", "communication.policy": "policy"}


@dataclass(frozen=True, kw_only=True)
class MainEffect:
    """A row of ``effects_of``; None for too few runs.

    Args:
        condition: common settings of the row's runs; ``all`` for the mean over conditions.
        term: a factor, or two multiplied ones.
        low, high: levels of a factor; empty for an interaction.
        aliases: main effects and interactions that the design confounds with it.
        n_missing: censored runs, counted with the whole duration.
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
    """Values of a metric under one condition, by repeat in design order."""

    values: Mapping[int, Sequence[float]]
    n_missing: int
    constant: bool


def effects_of(results: SweepResults, metrics: Sequence[str] = ()) -> list[MainEffect]:
    """Estimate the effects of a study with ``factorial`` sampling, main effects first.

    Conditions without all runs of the design are omitted. Raises OutputError for another design, no complete condition,
    or an unknown metric.
    """
    if not results.file.factors:
        raise OutputError(f'{results.folder}: effects need a study with sampling = "factorial"; see its [study]')
    names = tuple(dict.fromkeys(metrics)) or results.compared
    for name in names:
        check_name("--metric", name, results.metrics)
    design, levels = results.file.two_level_design, results.file.factors
    rows: list[MainEffect] = []
    for name in names:
        responses = _responses(results, design, results.metrics[name])
        for condition, response in responses.items():
            rows += [_row(design, levels, name, condition, response, term) for term in design.terms]
    if not rows:
        raise OutputError(f"{results.folder}: no condition has all {len(design.runs)} runs of the design yet")
    return rows


def _responses(results: SweepResults, design: FactorialDesign, metric: Metric) -> dict[str, Response]:
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
    responses: dict[str, Response] = {}
    for condition, by_run in samples.items():
        # Without one run the columns of the design are no longer orthogonal.
        if len(by_run) == len(design.runs) and all(sample.values for sample in by_run.values()):
            responses[condition] = _response([by_run[number] for number in range(len(design.runs))])
    if len(responses) > 1:
        responses = {ALL: _mean_of(list(responses.values())), **responses}
    return {condition: response for condition, response in responses.items() if response.values}


def _condition(treatment: Treatment, factors: Sequence[str]) -> str:
    parts = [treatment.scenario]
    parts += [getattr(treatment, own) for key, own in OWN_NAMES.items() if key not in factors]
    parts += [treatment.channel if treatment.rate is None else f"{treatment.channel} per {treatment.per:g}"]
    parts += [f"{key}={value}" for key, value in treatment.settings if key not in factors]
    return ", ".join([*parts, *([treatment.unforeseen] if treatment.unforeseen else [])])


def _response(samples: Sequence[Measured]) -> Response:
    constant = all(sample.constant for sample in samples)
    repeats = _common_repeats(samples)
    everywhere = [sample.over(repeats) for sample in samples]
    values = {repeat: [sample.values[repeat] for sample in everywhere] for repeat in repeats}
    missing = sum(len(set(repeats) - sample.reached) for sample in everywhere if sample.reached is not None)
    return Response(values, missing, constant)


def _mean_of(responses: Sequence[Response]) -> Response:
    repeats = _common_repeats(responses)
    # A deterministic condition has one value, which holds for every repeat.
    rows = [
        [next(iter(response.values.values())) if response.constant else response.values[repeat] for repeat in repeats]
        for response in responses
    ]
    values = {
        repeat: [statistics.fmean(column) for column in zip(*(each[number] for each in rows), strict=True)]
        for number, repeat in enumerate(repeats)
    }
    return Response(values, sum(response.n_missing for response in responses), all(own.constant for own in responses))


def _common_repeats(parts: Sequence[Measured] | Sequence[Response]) -> list[int]:
    drawn = [part.values.keys() for part in parts if not part.constant] or [parts[0].values.keys()]
    return sorted(set.intersection(*map(set, drawn)))


def _row(
    design: FactorialDesign,
    levels: Mapping[str, Sequence[object]],
    metric: str,
    condition: str,
    response: Response,
    term: Term,
) -> MainEffect:
    column = design.column(term)
    of_repeats = [
        # Half of the runs have each sign, so this is the difference of the two means.
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
