"""Figures of a sweep, each with the numbers behind it as CSV and a caption.

Up to four combinations of scenario, channel and other settings share a figure as panels; more have a figure each, with
the combination in its name. The overview and the ranking always have one each.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from missions.comparison.baseline import compare
from missions.comparison.ranking import ranks
from missions.comparison.rows import Comparison, Rank, write_csv
from missions.metric import Better
from missions.sweeps.folder import SweepResults
from visualisation.errors import DrawingError, unknown
from visualisation.kinds import FORMATS, KINDS
from visualisation.runs.arrangement import Arrangement, Combination, arranged
from visualisation.sweeps import captions
from visualisation.sweeps.measures import COMPARISON_KINDS, MEASURES, OVERVIEW, TRADE_OFF

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PANELS = 4
RANKED = MEASURES["mission-time"].metric
"""Metric that a ranking is by if none is named."""
Rows = Mapping[str, Sequence[Comparison]]
"""Rows of the comparison by metric."""


class Drawn(NamedTuple):
    """Files written (figure, numbers, caption, the next figure, ...), and what to tell the user."""

    files: list[Path]
    notes: list[str]


@dataclass(frozen=True)
class Sheet:
    """One figure to write: the end of its file's name, its numbers, its caption, and how it is drawn."""

    title: str
    rows: Sequence[Comparison] | Sequence[Rank]
    caption: str
    figure: Callable[[], Figure]


def draw(
    results: SweepResults,
    kinds: Sequence[str],
    folder: Path,
    format: str = "png",
    metric: str = RANKED,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> Drawn:
    """Write figures of a sweep, finished or not; no kinds means all that there are numbers for.

    Args:
        kinds: names in ``COMPARISON_KINDS``.
        folder: made if it is not there.
        format: png, svg or pdf.
        metric: field of the summary that the ranking is by.
        progress: told what is done of how much.

    Raises:
        DrawingError: a kind or the format is not known, or a kind that was named has nothing to draw.
        OutputError: no run has finished, or the metric is not known.
    """
    _check(kinds, format)
    if len(results.schedule.file.sampled_keys) > 1:
        raise DrawingError(
            "a Latin hypercube of several keys has no axis along which the rest is the same; see runs.parquet"
        )
    asked = list(dict.fromkeys(kinds)) or list(COMPARISON_KINDS)
    ranked = ranks(results, metric) if "ranking" in asked else []
    metrics = list(dict.fromkeys([RANKED, *(one for kind in asked for one in _metrics(kind))]))
    steps = len(metrics) + len(asked)
    rows: dict[str, Sequence[Comparison]] = {}
    for name in metrics:
        rows[name] = compare(results, [name])
        progress(len(rows), steps)
    arrangement = arranged([row for found in rows.values() for row in found])
    missing = {kind: reason for kind in asked if (reason := _nothing(kind, arrangement, rows, ranked))}
    if kinds and missing:
        raise DrawingError("; ".join(f"{kind}: {reason}" for kind, reason in missing.items()))
    from visualisation import style

    folder.mkdir(parents=True, exist_ok=True)
    notes = [f"{kind} is left out: {reason}" for kind, reason in missing.items()]
    if remaining := results.status().remaining:
        notes.append(f"the sweep is not finished, {remaining} runs are missing in the figures")
    files: list[Path] = []
    for number, kind in enumerate(kind for kind in asked if kind not in missing):
        stem = f"ranking-{metric}" if kind == "ranking" and metric != RANKED else kind
        taken: set[str] = set()
        for sheet in _sheets(kind, arrangement, rows, ranked, metric, results.metrics[metric].better):
            name = _file_name(stem, sheet.title, taken)
            picture, table, text = (folder / f"{name}.{suffix}" for suffix in (format, "csv", "txt"))
            conditions = captions.conditions(results, arrangement, sheet.rows)
            style.save(sheet.figure(), picture, format)
            write_csv(sheet.rows, table)
            text.write_text(f"{sheet.title}{': ' * bool(sheet.title)}{sheet.caption} {conditions}\n", encoding="utf-8")
            files += [picture, table, text]
        progress(len(metrics) + number + 1, steps)
    return Drawn(files, notes)


def _check(kinds: Sequence[str], format: str) -> None:
    for kind in kinds:
        if kind in KINDS and kind not in COMPARISON_KINDS:
            known = ", ".join(COMPARISON_KINDS)
            raise DrawingError(f"{kind!r} is a figure of a single run, and this folder holds a sweep; known: {known}")
        if kind not in COMPARISON_KINDS:
            raise unknown("kind of figure of a sweep", kind, COMPARISON_KINDS)
    if format not in FORMATS:
        raise unknown("format", format, FORMATS)


def _metrics(kind: str) -> list[str]:
    """Metrics that a kind draws, without that of the ranking."""
    if kind in MEASURES:
        return [MEASURES[kind].metric]
    names = {"overview": [MEASURES[one].metric for one in OVERVIEW], "trade-off": [one.metric for one in TRADE_OFF]}
    return names.get(kind, [])


def _nothing(kind: str, arrangement: Arrangement, rows: Rows, ranked: Sequence[Rank]) -> str:
    """Why there is nothing to draw for a kind; empty if there is."""
    if kind == "ranking":
        enough = len(arrangement.series) > 1
        return "" if enough and ranked else "no values" if enough else "needs two strategies or policies"
    missing = [name for name in _metrics(kind) if not rows[name]]
    if missing and (kind != "overview" or len(missing) == len(OVERVIEW)):
        return f"no run has a value of {', '.join(missing)}"
    return ""


# Sheets -------------------------------------------------------------------------------------------


def _sheets(
    kind: str, arrangement: Arrangement, rows: Rows, ranked: Sequence[Rank], metric: str, better: Better | None
) -> Iterator[Sheet]:
    """The figures of a kind: one for all combinations, or one for each."""
    from visualisation.sweeps import charts, ranking

    combinations = list(arrangement.titles)
    together = len(combinations) <= MOST_PANELS and kind not in ("ranking", "overview")
    for group in [combinations] if together else [[one] for one in combinations]:
        title = "" if len(group) == len(combinations) else arrangement.titles[group[0]]
        numbers = _numbers(arrangement, group, [rows[name] for name in _metrics(kind)])
        if kind == "ranking":
            own = arrangement.of(group[0], ranked)
            figure = partial(ranking.figure, arrangement, own, captions.named(metric))
            if own:
                yield Sheet(title, own, captions.ranking(arrangement, metric, better, own), figure)
        elif not numbers:
            continue
        elif kind == "overview":
            text = captions.overview(arrangement, numbers)
            yield Sheet(title, numbers, text, partial(charts.overview, arrangement, group[0], rows))
        elif kind == "trade-off":
            text = captions.trade_off(arrangement, group)
            yield Sheet(title, numbers, text, partial(charts.trade_off, arrangement, group, rows))
        else:
            measure = MEASURES[kind]
            text = captions.metric(arrangement, group, numbers, measure)
            yield Sheet(title, numbers, text, partial(charts.metric, arrangement, group, numbers, measure))


def _numbers(
    arrangement: Arrangement, group: Sequence[Combination], tables: Sequence[Sequence[Comparison]]
) -> list[Comparison]:
    """Rows that a figure draws, once each."""
    found = (row for table in tables for one in group for row in arrangement.of(one, table))
    return list({id(row): row for row in found}.values())


def _file_name(stem: str, title: str, taken: set[str]) -> str:
    """A name of letters, digits and ``._=-`` that no figure of this kind has yet."""
    short = re.sub(r"[^A-Za-z0-9._=-]+", "-", title.replace(" = ", "=")).strip("-")[:80]
    name = stem = f"{stem}-{short}" if short else stem
    number = 2
    while name in taken:
        name, number = f"{stem}-{number}", number + 1
    taken.add(name)
    return name
