"""Comparison of strategies and policies over the runs of a sweep.

A row is about one metric of one configuration. Every configuration is compared with the one that differs from it in the
baseline's strategy (or policy) alone, run by run of the same repeat, so that both met the same losses.

A run that did not complete is censored: its mission time is known to be longer than the mission's duration. It stays
in with that duration, so the mean of ``mission_time_s`` is the restricted mean time; ``completed`` as a metric is the
success rate, with Wilson's interval.

A ranking orders those that were run under the same conditions, and says which of them the runs cannot tell from the
best.
"""

from __future__ import annotations

import csv
import json
import statistics as plain
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from missions.errors import OutputError
from missions.statistics import (
    FEW,
    Interval,
    effect_size,
    holm,
    mean_interval,
    paired_p,
    pairing_gain,
    restricted_mean_time,
    wilson_interval,
)
from missions.sweeps.execution import DONE
from missions.sweeps.runlog import Line, SweepResults
from missions.sweeps.study_file import METRICS, flattened

CELL_FIELDS = ("scenario", "strategy", "policy", "channel", "per")
OWN_COLUMNS = ("strategy.name", "communication.policy", "channel.name", "channel.per")
"""Settings that have a column of their own."""
HIGHER_IS_BETTER = frozenset({"completed", "coverage_fraction", "delivery_ratio"})
SIGNIFICANT = 0.05
"""Corrected probability below which a difference to the best counts."""
INTERVALS_OF_MEANS = f"95 % intervals of the mean (bootstrap; Student's t below {FEW} runs)"


@dataclass(frozen=True)
class Cell:
    """What was run: a configuration without its repeat."""

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float
    settings: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Comparison:
    """A row of ``compare``; the names are those of the contract. None where too few runs can say."""

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float
    settings: dict[str, str]
    metric: str
    baseline: str
    n: int
    n_completed: int
    mean: float
    ci95_low: float | None
    ci95_high: float | None
    median: float
    diff_to_baseline: float | None
    diff_ci95_low: float | None
    diff_ci95_high: float | None
    p_holm: float | None
    effect_size: float | None
    pairing_gain: float | None
    success_rate: float
    success_ci95_low: float
    success_ci95_high: float
    restricted_mean_time_s: float


@dataclass(frozen=True)
class Rank:
    """How a strategy with its policy stands among those run under the same conditions.

    Args:
        rank: by the mean, 1 is best; those with equal means share the mean of their ranks (Friedman 1937).
        p_holm_to_best: of the paired differences to the best, corrected over those conditions; None for the best
            itself, and where there are fewer than two pairs.
        among_best: the best, or not significantly different from it.
    """

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float
    settings: dict[str, str]
    metric: str
    n: int
    mean: float
    rank: float
    p_holm_to_best: float | None
    among_best: bool


@dataclass(frozen=True)
class Paired:
    """Differences to the baseline of one configuration and metric."""

    difference: float
    interval: Interval | None
    p: float | None
    effect: float | None
    gain: float | None


def compare(results: SweepResults, metrics: Sequence[str] = (), baseline: str | None = None) -> list[Comparison]:
    """Compare the configurations of a sweep, finished or not.

    Args:
        metrics: fields of the summary; those of the study if empty.
        baseline: a strategy or a policy; that of the study, or its first strategy or policy, if left out.

    Raises:
        OutputError: nothing has finished, or a name is unknown.
    """
    cells = _finished(results)
    design = results.schedule.file.study
    metrics = tuple(metrics) or design.metrics
    _check_metrics(metrics)
    strategies = list(dict.fromkeys([*(design.strategies or ()), *(cell.strategy for cell in cells)]))
    policies = list(dict.fromkeys([*(design.policies or ()), *(cell.policy for cell in cells)]))
    first = strategies[0] if len(strategies) > 1 or len(policies) == 1 else policies[0]
    baseline = baseline or design.baseline or first
    _one_of("--baseline", baseline, [*strategies, *policies])
    by_strategy = baseline in strategies
    return [row for metric in metrics for row in _rows(cells, metric, baseline, by_strategy)]


def ranks(results: SweepResults, metric: str) -> list[Rank]:
    """Rank strategies and policies under each of the conditions (scenario, channel, loss rate, settings).

    Raises:
        OutputError: nothing has finished, or the metric is unknown.
    """
    _check_metrics([metric])
    columns: dict[Cell, dict[Cell, dict[int, float]]] = defaultdict(dict)
    for cell, runs in _finished(results).items():
        if values := _values(runs, metric):
            columns[replace(cell, strategy="", policy="")][cell] = values
    return [rank for column in columns.values() for rank in _column_ranks(column, metric)]


def _column_ranks(column: Mapping[Cell, Mapping[int, float]], metric: str) -> list[Rank]:
    """Ranks of one column of a table; the tests against its best are one family for Holm's correction."""
    sign = -1.0 if metric in HIGHER_IS_BETTER else 1.0
    scores = {cell: sign * plain.fmean(values.values()) for cell, values in column.items()}
    best = min(scores, key=lambda cell: scores[cell])
    paired = {cell: paired_with(values, column[best]) for cell, values in column.items() if cell != best}
    tested = {cell: found.p for cell, found in paired.items() if found and found.p is not None}
    corrected = dict(zip(tested, holm(list(tested.values())), strict=True))
    return [
        Rank(
            **{**vars(cell), "settings": dict(cell.settings)},
            metric=metric,
            n=len(column[cell]),
            mean=sign * score,
            rank=sum(other < score for other in scores.values())
            + (1 + sum(other == score for other in scores.values())) / 2,
            p_holm_to_best=corrected.get(cell),
            among_best=corrected.get(cell, 1.0) >= SIGNIFICANT,
        )
        for cell, score in scores.items()
    ]


def mean_ranks(ranked: Sequence[Rank]) -> dict[tuple[str, str], float | None]:
    """Mean rank of each (strategy, policy) over all conditions; None if it lacks a value under one of them."""
    conditions = {_conditions(rank) for rank in ranked}
    found: dict[tuple[str, str], list[float]] = defaultdict(list)
    for rank in ranked:
        found[rank.strategy, rank.policy].append(rank.rank)
    return {name: plain.fmean(own) if len(own) == len(conditions) else None for name, own in found.items()}


def _conditions(rank: Rank) -> tuple[str, str, float, tuple[tuple[str, str], ...]]:
    return rank.scenario, rank.channel, rank.per, tuple(rank.settings.items())


def write_csv(rows: Sequence[Comparison | Rank], path: Path) -> None:
    """Rows of one kind as a table, settings as JSON; without rows a table of comparisons that is empty."""
    columns = [field.name for field in fields(rows[0] if rows else Comparison)]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows({**asdict(row), "settings": json.dumps(row.settings)} for row in rows)


def least_p_holm(n_pairs: int, n_tests: int) -> float:
    """The smallest corrected probability that so many tests of so many pairs can give.

    >>> least_p_holm(5, 2)  # 2 of the 32 ways to flip the signs, twice
    0.125
    """
    return min(1.0, n_tests * (paired_p([1.0] * n_pairs) or 1.0))


def are_too_few(ranked: Sequence[Rank]) -> bool:
    """Are there so few runs that no strategy could be told from the best of its column?"""
    columns = Counter(_conditions(rank) for rank in ranked)
    most = max((rank.n for rank in ranked), default=0)
    return all(least_p_holm(most, n - 1) >= SIGNIFICANT for n in columns.values() if n > 1)


def _check_metrics(metrics: Iterable[str]) -> None:
    for metric in metrics:
        _one_of("--metric", metric, METRICS)


def _one_of(option: str, name: str, known: Sequence[str]) -> None:
    if name not in known:
        nearest = get_close_matches(name, known, n=1)
        hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
        raise OutputError(f"{option} {name!r}: allowed are {', '.join(known)}{hint}")


def _finished(results: SweepResults) -> dict[Cell, dict[int, Mapping[str, Any]]]:
    constant = dict(flattened(results.schedule.file.set))
    cells = _cells(results.lines.values(), {*OWN_COLUMNS, *constant})
    if not cells:
        raise OutputError(f"{results.folder}: no run has finished yet, there is nothing to compare")
    return cells


def _cells(lines: Iterable[Line], left_out: Collection[str]) -> dict[Cell, dict[int, Mapping[str, Any]]]:
    """Summaries of the runs that did not fail, by configuration and repeat, in a fixed order."""
    found: dict[Cell, dict[int, Mapping[str, Any]]] = {}
    for line in lines:
        summary = line["summary"]
        settings = tuple((key, str(value)) for key, value in sorted(line["settings"].items()) if key not in left_out)
        if line["status"] == DONE:
            scenario, strategy, policy, channel, per = (summary[key] for key in CELL_FIELDS)
            cell = Cell(scenario, strategy, policy, channel, per, settings)
            found.setdefault(cell, {})[line["repeat"]] = summary
    ordered = sorted(found, key=_in_order)
    return {cell: dict(sorted(found[cell].items())) for cell in ordered}


def _in_order(cell: Cell) -> tuple[Any, ...]:
    """Settings that are numbers go by their value: 4 vehicles come before 16."""
    settings = tuple((key, _number(value), value) for key, value in cell.settings)
    return cell.scenario, cell.channel, cell.per, settings, cell.strategy, cell.policy


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def _values(runs: Mapping[int, Mapping[str, Any]], metric: str) -> dict[int, float]:
    """Values of a metric by repeat; runs in which it has none (a latency without a packet) are left out."""
    return {repeat: float(run[metric]) for repeat, run in runs.items() if run.get(metric) is not None}


def _rows(
    cells: Mapping[Cell, Mapping[int, Mapping[str, Any]]], metric: str, baseline: str, by_strategy: bool
) -> list[Comparison]:
    """Rows of one metric; its comparisons are one family for Holm's correction."""
    values = {cell: found for cell, runs in cells.items() if (found := _values(runs, metric))}
    compared: dict[Cell, Paired] = {}
    for cell, own in values.items():
        other = replace(cell, strategy=baseline) if by_strategy else replace(cell, policy=baseline)
        if other != cell and other in values and (paired := paired_with(own, values[other])):
            compared[cell] = paired
    tested = [cell for cell, paired in compared.items() if paired.p is not None]
    corrected = dict(zip(tested, holm([compared[cell].p or 0.0 for cell in tested]), strict=True))
    return [
        _row(cell, metric, baseline, list(found.values()), cells[cell], compared.get(cell), corrected.get(cell))
        for cell, found in values.items()
    ]


def paired_with(values: Mapping[int, float], baseline: Mapping[int, float]) -> Paired | None:
    """The difference to a baseline over the repeats that both have."""
    shared = [repeat for repeat in values if repeat in baseline]
    if not shared:
        return None
    own, others = [values[r] for r in shared], [baseline[r] for r in shared]
    differences = [a - b for a, b in zip(own, others, strict=True)]
    return Paired(
        plain.fmean(differences),
        mean_interval(differences),
        paired_p(differences),
        effect_size(own, others),
        pairing_gain(own, others),
    )


def _row(
    cell: Cell,
    metric: str,
    baseline: str,
    values: Sequence[float],
    runs: Mapping[int, Mapping[str, Any]],
    paired: Paired | None,
    p_holm: float | None,
) -> Comparison:
    completed = [bool(run["completed"]) for run in runs.values()]
    times_s = [float(run["mission_time_s"]) for run in runs.values()]
    success = wilson_interval(sum(completed), len(completed))
    low, high = (success if metric == "completed" else mean_interval(values)) or (None, None)
    diff_low, diff_high = (paired.interval if paired else None) or (None, None)
    return Comparison(
        **{**vars(cell), "settings": dict(cell.settings)},
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
