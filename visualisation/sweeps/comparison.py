"""Figures of a sweep, each with its data as CSV and a caption; factorial studies have figures of effects.

Up to six combinations of scenario, channel, other settings and unforeseen case share a figure as panels; more have a
figure each, with the combination in its name. Overview and ranking always have one per combination.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

from missions.comparison import Comparison, Rank
from missions.comparison.baseline import compare, csv_of
from missions.comparison.effects import MainEffect, effects_of
from missions.comparison.ranking import ranks as ranked_by_metric
from missions.errors import check_name
from missions.files import dotted
from missions.metric import Better, Metric
from missions.sweeps.folder import SweepResults
from visualisation.output import (
    FACTORIAL_KINDS,
    KINDS,
    SWEEP_KINDS,
    DrawingError,
    Drawn,
    check_format,
    check_kinds,
    check_width,
    write_folder,
)
from visualisation.sweeps import captions
from visualisation.sweeps.arrangement import (
    MOST_IN_OVERVIEW,
    RANKED,
    TRADE_OFF,
    Arrangement,
    Measure,
    PanelSettings,
    arranged,
    by_kind,
    measure,
    of_differences,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from visualisation.page import DrawnPage

    DrawOfWidth = Callable[[float | None], Figure]

MOST_PANELS = 6
MOST_FIGURES = 8  # maximum number of figures if the user names none


class Numbers:
    """Data of the figures of a sweep, computed for the first figure that needs them.

    ``kinds`` are metrics by figure kind; ``ranked_by`` is the metric of ranking, differences and effects. Raises
    DrawingError if two metrics share a kind, OutputError for an unknown ranking metric.
    """

    def __init__(self, results: SweepResults, ranked: str) -> None:
        self.results = results
        self.kinds = by_kind(list(results.metrics.values()))
        check_name("--metric", ranked, results.metrics)
        self.ranked_by = results.metrics[ranked]
        self.overview = tuple(results.compared)[:MOST_IN_OVERVIEW]
        self._rows: dict[str, Sequence[Comparison]] = {}

    def rows(self, name: str) -> Sequence[Comparison]:
        """Return the comparison of all configurations by a metric."""
        if name not in self._rows:  # a metric is in several figures
            self._rows[name] = compare(self.results, [name])
        return self._rows[name]

    def measure(self, name: str) -> Measure:
        """Return a metric on its axis."""
        return measure(self.results.metrics[name], self.rows(name))

    @cached_property  # asked for each figure
    def arrangement(self) -> Arrangement:
        """Arrangement of all configurations."""
        # By a metric that every run has, so that no configuration is missing.
        return arranged(self.rows(RANKED))

    @cached_property  # asked for each figure
    def ranks(self) -> Sequence[Rank]:
        """Ranks of all combinations."""
        return ranked_by_metric(self.results, self.ranked_by.name)

    def drawn_by(self, kind: str) -> tuple[str, ...]:
        """Return the names of the metrics in a kind of figure; none for ranking and effects."""
        several = {"overview": self.overview, "trade-off": TRADE_OFF, "differences": (self.ranked_by.name,)}
        several |= dict.fromkeys(("ranking", *FACTORIAL_KINDS), ())
        return several[kind] if kind in several else (self.kinds[kind].name,)

    def lacking(self, kind: str) -> str:
        """Return the reason why a kind cannot be drawn; empty if it can."""
        if kind == "ranking":
            if self.ranked_by.better is Better.NEITHER:
                return f"{self.ranked_by.name} has no best value"
            if not self.ranks and len(self.arrangement.series) > 1:
                return "no values"
            contenders = {(rank.strategy, rank.policy) for rank in self.ranks}
            return "" if len(contenders) > 1 else "needs two strategies or policies besides bounds"
        if kind == "differences" and all(row.diff_to_baseline is None for row in self.rows(self.ranked_by.name)):
            return "no runs can be paired" if len(self.arrangement.series) > 1 else "needs two strategies or policies"
        missing = [name for name in self.drawn_by(kind) if not self.rows(name)]
        if missing and (kind != "overview" or len(missing) == len(self.overview)):
            return f"no run has a value of {', '.join(missing)}"
        return ""


@dataclass(frozen=True)
class SweepChart:
    """Figure to write: suffix of its file name, data, whole caption, drawing function of a width."""

    title: str
    rows: Sequence[Comparison] | Sequence[Rank] | Sequence[MainEffect]
    caption: str
    figure: DrawOfWidth


def sweep_pictures(
    results: SweepResults, kind: str, ranked: str = RANKED, width_in: float | None = None
) -> dict[str, Callable[[], DrawnPage]]:
    """Return functions that draw a kind of figure in memory, by title; arguments as in ``draw_sweep_figures``."""
    from visualisation.page import DrawnPage

    numbers, (asked,), notes = _prepared(results, [kind], ranked, width_in)

    def drawn(chart: SweepChart) -> DrawnPage:
        return DrawnPage(chart.figure(width_in), chart.caption, tuple(notes))

    return {chart.title: partial(drawn, chart) for chart in _charts(asked, numbers)}


def sweep_picture(results: SweepResults, kind: str, ranked: str = RANKED, width_in: float | None = None) -> DrawnPage:
    """Draw one figure of a sweep in memory; arguments as in ``draw_sweep_figures``. DrawingError if it has several."""
    drawn = sweep_pictures(results, kind, ranked, width_in)
    if len(drawn) != 1:
        titles = "; ".join(drawn)
        raise DrawingError(f"{kind}: this sweep has {len(drawn)} of it ({titles}); `remoras plot` writes them all")
    return next(iter(drawn.values()))()


def draw_sweep_figures(
    results: SweepResults,
    kinds: Sequence[str],
    folder: Path,
    format: str = "png",
    ranked: str = RANKED,
    progress: Callable[[float, float], None] = lambda done, total: None,
    width_in: float | None = None,
    draw_all: bool = False,
) -> Drawn:
    """Write figures of a finished or unfinished sweep, each with its data and caption; return the files and notes.

    Without kinds, these are at most ``MOST_FIGURES``: the overview, ranking and differences if strategies or policies
    are compared, the trade-off if policies are, and the metrics of the study in their order.

    Args:
        kinds: names in ``SWEEP_KINDS``, or metrics by the name of their chart or of their field.
        ranked: name of the metric of ranking, differences and effects.
        width_in: of all figures; None for a column or a page of a paper.
        draw_all: without kinds, draw all kinds with data.

    Raises DrawingError for an unknown kind or format, or a named kind without data; OutputError without a finished run,
    or for an unknown metric of the ranking.
    """
    numbers, asked, notes = _prepared(results, kinds, ranked, width_in, progress, format, draw_all)
    files: list[Path] = []
    left, left_out = (None if kinds or draw_all else MOST_FIGURES), 0
    for number, kind in enumerate(asked):
        charts = list(_charts(kind, numbers))
        files += _written(kind, charts[:left], numbers, folder, format, width_in)
        if left is not None:
            left, left_out = max(0, left - len(charts)), left_out + max(0, len(charts) - left)
        progress(len(asked) + number + 1, 2 * len(asked))
    others = left is not None and len(numbers.kinds) + len(SWEEP_KINDS) > len(asked)
    if left_out or others:
        notes.append(f"at most {MOST_FIGURES} figures are drawn by default; --all draws all, KIND a single kind")
    return Drawn(files, notes)


def _prepared(
    results: SweepResults,
    kinds: Sequence[str],
    ranked: str,
    width_in: float | None,
    progress: Callable[[float, float], None] = lambda done, total: None,
    format: str = "png",
    draw_all: bool = False,
) -> tuple[Numbers, list[str], list[str]]:
    numbers = Numbers(results, ranked)
    asked = _asked(kinds, numbers.kinds) if kinds or draw_all else _telling(results, numbers.kinds)
    if results.file.factors and not kinds:
        asked = list(FACTORIAL_KINDS)
    check_format(format)
    check_width(width_in)
    if len([*dotted(results.file.latin)]) > 1:
        raise DrawingError(
            "a Latin hypercube of several keys has no axis along which all other keys are constant; see runs.parquet"
        )
    notes: list[str] = []
    drawable: list[str] = []
    for number, kind in enumerate(asked):
        if reason := numbers.lacking(kind):
            notes.append(f"{kind} is left out: {reason}")
        else:
            drawable.append(kind)
        progress(number + 1, 2 * len(asked))
    if kinds and notes:
        raise DrawingError("; ".join(note.replace(" is left out", "", 1) for note in notes))
    if remaining := results.status().remaining:
        notes.append(f"the sweep is not finished, {remaining} runs are missing in the figures")
    return numbers, drawable, notes


def _telling(results: SweepResults, charts: Mapping[str, Metric]) -> list[str]:
    """Return the default kinds of the study, most informative first."""
    design = results.file.study
    strategies, policies = len(design.strategies or ()) > 1, len(design.policies or ()) > 1
    kinds = {metric.name: kind for kind, metric in charts.items()}
    compared = [kinds[name] for name in results.compared if name in kinds]
    compared_by_level = "=" in (design.baseline or "")
    general = ["overview", *(["ranking"] if strategies or policies else [])]
    general += ["differences"] if strategies or policies or compared_by_level else []
    general += ["trade-off"] if policies else []
    return list(dict.fromkeys([*general, *compared]))


def _asked(kinds: Sequence[str], charts: Mapping[str, Metric]) -> list[str]:
    usual = (*charts, *SWEEP_KINDS)
    known = (*usual, *FACTORIAL_KINDS)
    fields = {metric.name: kind for kind, metric in charts.items()}
    chosen = [fields.get(kind, kind) for kind in kinds]
    check_kinds(chosen, known, "kind of figure of a sweep", KINDS, "a single run, and this folder holds a sweep")
    return list(dict.fromkeys(chosen)) or list(usual)


def _written(
    kind: str,
    drawn_charts: Sequence[SweepChart],
    numbers: Numbers,
    folder: Path,
    format: str,
    width_in: float | None,
) -> list[Path]:
    from visualisation import output, style

    source = output.of_sweep(numbers.results)
    ranked = numbers.ranked_by.name
    stem = f"{kind}-{ranked}" if kind in ("ranking", "differences", *FACTORIAL_KINDS) and ranked != RANKED else kind
    taken: set[str] = set()
    charts = {_file_name(stem, chart.title, taken): chart for chart in drawn_charts}
    contents: list[tuple[str, bytes]] = []
    for name, chart in charts.items():
        contents.append((f"{name}.{format}", style.rendered(chart.figure(width_in), format, source)))
        contents.append((f"{name}.csv", csv_of(chart.rows)))
        contents.append((f"{name}.txt", f"{chart.caption}\n".encode()))
    return write_folder(folder, contents)


def _charts(kind: str, numbers: Numbers) -> Iterator[SweepChart]:
    if kind in FACTORIAL_KINDS:
        from visualisation.sweeps import charts

        by, effects = numbers.ranked_by, effects_of(numbers.results, [numbers.ranked_by.name])
        text = f"{captions.effects_caption(effects, by)} {captions.effects_conditions(numbers.results)}"
        yield SweepChart("", effects, text, partial(charts.effects_figure, effects, by))
        return
    arrangement = numbers.arrangement
    combinations = list(arrangement.titles)
    together = len(combinations) <= MOST_PANELS and kind not in ("ranking", "overview")
    for group in [combinations] if together else [[combination] for combination in combinations]:
        drawn = _ranking(group[0], numbers) if kind == "ranking" else _chart(kind, group, numbers)
        if drawn is not None:
            rows, text, figure = drawn
            title = "" if len(group) == len(combinations) else arrangement.titles[group[0]]
            conditions = captions.sweep_conditions(numbers.results, arrangement, rows)
            yield SweepChart(title, rows, f"{title}{': ' * bool(title)}{text} {conditions}", figure)


def _ranking(combination: PanelSettings, numbers: Numbers) -> tuple[Sequence[Rank], str, DrawOfWidth] | None:
    from visualisation.sweeps import ranking

    arrangement, by = numbers.arrangement, numbers.ranked_by
    if not (own := arrangement.of(combination, numbers.ranks)):
        return None
    return own, captions.ranking(arrangement, by, own), partial(ranking.figure, arrangement, own, by.label)


def _chart(
    kind: str, group: Sequence[PanelSettings], numbers: Numbers
) -> tuple[Sequence[Comparison], str, DrawOfWidth] | None:
    """Return the data, caption and drawing function of combinations; None without any point."""
    from visualisation.sweeps import charts

    arrangement, drawn = numbers.arrangement, [numbers.measure(name) for name in numbers.drawn_by(kind)]
    rows = {shown.metric.name: numbers.rows(shown.metric.name) for shown in drawn}
    of_metrics = [[row for c in group for row in arrangement.of(c, of_metric)] for of_metric in rows.values()]
    own = [row for of_metric in of_metrics for row in of_metric]
    # Panels of an overview may be empty, the axes of a trade-off not.
    if not (any(of_metrics) if kind == "overview" else all(of_metrics)):
        return None
    if kind == "differences" and all(row.diff_to_baseline is None for row in own):
        return None
    if kind == "overview":
        text = captions.overview_caption(arrangement, own, drawn)
        return own, text, partial(charts.overview, arrangement, group[0], drawn, rows)
    if kind == "trade-off":
        across, up = drawn
        text = captions.trade_off_caption(arrangement, group, own, across, up)
        return own, text, partial(charts.trade_off, arrangement, group, across, up, rows)
    if kind == "differences":
        compared, differences = of_differences(drawn[0], rows[drawn[0].metric.name])
        text = captions.differences_caption(arrangement, group, own, drawn[0])
        return own, text, partial(charts.metric, arrangement, group, differences, compared)
    text = captions.metric_caption(arrangement, group, own, drawn[0])
    return own, text, partial(charts.metric, arrangement, group, own, drawn[0])


def _file_name(stem: str, title: str, taken: set[str]) -> str:
    # File systems allow names of 255 bytes, stem and ending included.
    short = re.sub(r"[^A-Za-z0-9._=-]+", "-", title.replace(" = ", "=")).strip("-")[:80]
    name = stem = f"{stem}-{short}" if short else stem
    number = 2
    while name in taken:
        name, number = f"{stem}-{number}", number + 1
    taken.add(name)
    return name
