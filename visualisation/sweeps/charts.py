"""Charts of a sweep: metrics along the axis with intervals, trade-off of two metrics, overview, effects.

A strategy's name determines its colour, marker, line and fill, so charts of different studies agree. Series stay
distinguishable for colour-blind readers and in grey print. If strategies and policies both vary, colour and marker
denote the strategy, line and fill the policy.
"""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

from missions import words
from missions.comparison import Comparison
from missions.comparison.effects import ALL, MainEffect
from missions.metric import Metric
from missions.words import REPEAT
from visualisation import page, style
from visualisation.sweeps.arrangement import (
    POLICIES,
    STRATEGIES,
    Arrangement,
    Measure,
    PanelSettings,
    Series,
    policy_place,
)

BODY_IN, TRADE_OFF_BODY_IN, OVERVIEW_BODY_IN = 2.1, 2.5, 1.45
LEAST_PANEL_IN = 2.3  # minimum width of a panel with its label; limits panels per row on pages of other widths
SPREAD = 10.0  # minimum ratio of the largest to the smallest mean for a logarithmic axis
HOLLOW = (1, 3, 4)  # looks with hollow markers, as all from the eighth on, to separate looks of one line style
SIDE_BY_SIDE, MOST_ASIDE = 0.45, 0.045
"""Maximum spread of points of one axis value, as share of the step and of the axis."""
RIM_IN, MOST_RIM, LEAST_LABEL_IN = 0.17, 0.5, 0.11
"""Height of a row of arrows at the rim, maximum share of a panel for all of them, minimum height with labels."""
SIZES_PT = (2.0, 6.0)  # sizes of trade-off markers at the low and the high end of the axis


def looks(series: Sequence[Series]) -> dict[Series, dict[str, Any]]:
    """Return the look of each series; unknown names take the remaining looks in order."""
    strategies = list(dict.fromkeys(key.strategy for key in series))
    policies = sorted({key.policy for key in series}, key=policy_place)
    bases = list(dict.fromkeys(policy.removesuffix(REPEAT) for policy in policies))
    of_strategy, of_base = _numbers(strategies, STRATEGIES), _numbers(bases, POLICIES)
    chosen = {}
    for key in series:
        repeats = key.policy.endswith(REPEAT)
        if len(strategies) == 1 and len(policies) > 1:
            number = of_base[key.policy.removesuffix(REPEAT)]
            line, hollow = style.LINES[repeats], repeats
        else:
            number = of_strategy[key.strategy]
            line, hollow = style.look(number).line, number in HOLLOW or number >= len(style.COLOURS)
            if len(policies) > 1:
                line, hollow = style.LINES[policies.index(key.policy) % len(style.LINES)], repeats
        colour, marker = style.look(number).colour, style.look(number).marker
        chosen[key] = {
            "color": colour, "marker": marker, "linestyle": line, "markeredgewidth": 0.7,
            "markerfacecolor": "white" if hollow else colour, "markersize": 4.3 if marker in "PX" else 3.4,
        }  # fmt: skip
    return chosen


def _numbers(names: Sequence[str], known: Sequence[str]) -> dict[str, int]:
    fixed = {name: known.index(name) for name in names if name in known}
    free = (number for number in itertools.count() if number not in fixed.values())
    return {name: fixed[name] if name in fixed else next(free) for name in names}


def metric(
    arrangement: Arrangement,
    combinations: Sequence[PanelSettings],
    rows: Sequence[Comparison],
    measure: Measure,
    width_in: float | None = None,
) -> Figure:
    """Draw one metric along the axis, a panel for each combination."""
    with style.paper():
        titles = [arrangement.titles[combination] for combination in combinations]
        figure, panels = _page(arrangement, titles, width_in, rows=rows)
        shown = [row for combination in combinations for row in arrangement.of(combination, rows)]
        rim = Rim.of(arrangement, shown, measure, BODY_IN)
        for axes, combination in zip(panels, combinations, strict=True):
            _curves(axes, arrangement, arrangement.of(combination, rows), measure, rim)
        _scale(panels, shown, measure, "y", rim)
        _finish(figure, panels, BODY_IN, measure.label)
    return figure


def overview(
    arrangement: Arrangement,
    combination: PanelSettings,
    measures: Sequence[Measure],
    rows: Mapping[str, Sequence[Comparison]],
    width_in: float | None = None,
) -> Figure:
    """Draw metrics of one combination under one legend; a panel without values is labelled so.

    ``rows`` are of all combinations, by metric name; ``width_in`` None is the default, as in the other functions.
    """
    with style.paper():
        figure, panels = _page(arrangement, [measure.name for measure in measures], width_in, columns=3)
        for axes, measure in zip(panels, measures, strict=True):
            own = arrangement.of(combination, rows[measure.metric.name])
            rim = Rim.of(arrangement, own, measure, OVERVIEW_BODY_IN)
            _curves(axes, arrangement, own, measure, rim, 0.75)
            axes.set_ylabel(measure.unit)  # the title has the name
            if own:
                _scale([axes], own, measure, "y", rim)
            else:
                axes.text(0.5, 0.5, "no values", transform=axes.transAxes, ha="center", color=style.GREY)
                axes.set_yticks([])
        _finish(figure, panels, OVERVIEW_BODY_IN)
    return figure


def trade_off(
    arrangement: Arrangement,
    combinations: Sequence[PanelSettings],
    across: Measure,
    up: Measure,
    rows: Mapping[str, Sequence[Comparison]],
    width_in: float | None = None,
) -> Figure:
    """Draw one metric over another, a panel per combination; lines join a series, marker size shows the axis value."""
    shown = [
        [arrangement.of(combination, rows[measure.metric.name]) for measure in (across, up)]
        for combination in combinations
    ]
    places = sorted({arrangement.x(row) for pair in shown for own in pair for row in own})
    sizes = dict(zip(places, _sizes(len(places)), strict=True))
    with style.paper():
        titles = [arrangement.titles[combination] for combination in combinations]
        figure, panels = _page(arrangement, titles, width_in, across.label)
        across_rows, up_rows = ([row for pair in shown for row in pair[number]] for number in (0, 1))
        rim = Rim.of(arrangement, up_rows, up, TRADE_OFF_BODY_IN)
        for axes, own in zip(panels, shown, strict=True):
            _crosses(axes, arrangement, own, (across, up), sizes, rim)
        _scale(panels, across_rows, across, "x")
        _scale(panels, up_rows, up, "y", rim)
        _size_key(figure, arrangement.axis_label, sizes)
        _finish(figure, panels, TRADE_OFF_BODY_IN, up.label)
    return figure


class Places(NamedTuple):
    """Positions of axis values, their minimum distance, and the width over which points of one value are spread."""

    at: Mapping[float, float]
    step: float
    spread: float


def _places(arrangement: Arrangement, rows: Sequence[Comparison]) -> Places:
    xs = sorted({arrangement.x(row) for row in rows})
    evenly = arrangement.is_spaced_evenly(rows)
    positions = {x: float(number) if evenly else x for number, x in enumerate(xs)}
    along = list(positions.values())
    step = min((b - a for a, b in itertools.pairwise(along)), default=1.0)
    width = along[-1] - along[0] + step if xs else step
    return Places(positions, step, min(SIDE_BY_SIDE * step, MOST_ASIDE * width))


class Rim(NamedTuple):
    """Rows of arrows at the rim, one per series with points off the scale; height of a row (in) and of the panel."""

    rows: tuple[tuple[str, str], ...] = ()
    row_in: float = RIM_IN
    body_in: float = BODY_IN

    @classmethod
    def of(cls, arrangement: Arrangement, rows: Sequence[Comparison], measure: Measure, body_in: float) -> Rim:
        """Return the rim of a figure of ``rows``; without any if all points are off the scale."""
        off = {(row.strategy, row.policy) for row in rows if measure.is_off_scale(row)}
        if all(map(measure.is_off_scale, rows)):
            return cls()
        series = tuple(key[:2] for key in arrangement.series if key[:2] in off)
        return cls(series, min(RIM_IN, MOST_RIM * body_in / max(1, len(series))), body_in)

    def holds(self, row: Comparison, measure: Measure) -> bool:
        """True if the point of a row is an arrow at the rim."""
        return bool(self.rows) and measure.is_off_scale(row)

    @property
    def share(self) -> float:
        """Share of the panel for the arrows on one side."""
        return len(self.rows) * self.row_in / self.body_in

    def draw(
        self, axes: Axes, points: Sequence[tuple[float, Comparison]], look: Mapping[str, Any], labelled: bool = True
    ) -> None:
        """Draw an arrow at each x, ``labelled`` with completed/all runs where these differ from the arrow before."""
        before = ""
        for x, row in points:
            number, up = self.rows.index((row.strategy, row.policy)), row.mean > 0.0
            edge, inward = (1.0, -1.0) if up else (0.0, 1.0)
            tail, tip = (
                axes.get_xaxis_transform()
                + ScaledTranslation(0.0, inward * self.row_in * (number + part), axes.figure.dpi_scale_trans)
                for part in (0.8, 0.1)
            )
            arrow = {"arrowstyle": "->", "color": look["color"], "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", (x, edge), (x, edge), tip, tail, arrowprops={**arrow, "mutation_scale": 5.0})
            axes.plot([x], [edge], transform=tail, **{**look, "markerfacecolor": "white", "linestyle": ""})
            text = f"{row.n_reached}/{row.n}"
            if labelled and text != before and self.row_in >= LEAST_LABEL_IN:
                axes.annotate(text, (x, edge), (4.0, 0.0), tail, "offset points", fontsize=style.TINY_PT, va="center")
            before = text


def _curves(
    axes: Axes, arrangement: Arrangement, rows: Sequence[Comparison], measure: Measure, rim: Rim, size: float = 1.0
) -> None:
    curves = arrangement.curves(rows)
    places = _places(arrangement, rows)
    drawn = looks(arrangement.series)
    for number, series in enumerate(arrangement.series):
        own = curves.get(series, [])
        # By the place among all series, so that one without values leaves its gap.
        aside = places.spread * ((number + 0.5) / len(arrangement.series) - 0.5)
        xs = [places.at[arrangement.x(row)] + aside for row in own]
        look = {**drawn[series], "markersize": size * drawn[series]["markersize"]}
        if arrangement.cases:  # they are no scale, so nothing lies between them
            look["linestyle"] = ""
        off = [rim.holds(row, measure) for row in own]
        for x, row in itertools.compress(zip(xs, own, strict=True), map(operator.not_, off)):
            axes.vlines(x, *measure.bounds(row), color=look["color"], linewidth=0.7)
        means = [math.nan if is_off else row.mean * measure.scale for row, is_off in zip(own, off, strict=True)]
        axes.plot(xs, means, **look, clip_on=False)
        rim.draw(axes, list(itertools.compress(zip(xs, own, strict=True), off)), look)
    _place_ticks(axes, places, arrangement)


def _place_ticks(axes: Axes, places: Places, arrangement: Arrangement) -> None:
    along, width_in = list(places.at.values()), axes.bbox.width / axes.figure.dpi
    if along:
        axes.set_xlim(along[0] - 0.5 * places.step, along[-1] + 0.5 * places.step)
    if along and len(along) <= 6 and places.step >= 0.1 * (along[-1] - along[0]):
        axes.set_xticks(along, arrangement.tick_labels(places.at, width_in), fontsize=arrangement.tick_pt)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))


def _crosses(
    axes: Axes,
    arrangement: Arrangement,
    shown: Sequence[Sequence[Comparison]],
    measures: tuple[Measure, Measure],
    sizes: Mapping[float, float],
    rim: Rim,
) -> None:
    across, up = measures
    drawn = looks(arrangement.series)
    curves = [arrangement.curves(rows) for rows in shown]
    for series, own in curves[0].items():
        look = dict(drawn[series])
        marker = {name: look.pop(name) for name in ("marker", "markeredgewidth", "markerfacecolor")}
        factor = look.pop("markersize") / 3.4
        above = {arrangement.x(row): row for row in curves[1].get(series, [])}
        pairs = [(row, above[arrangement.x(row)]) for row in own if arrangement.x(row) in above]
        off = [(x.mean * across.scale, y) for x, y in pairs if rim.holds(y, up)]
        pairs = [pair for pair in pairs if not rim.holds(pair[1], up)]
        rim.draw(axes, off, {**marker, "color": look["color"]}, labelled=False)
        centres = [(x.mean * across.scale, y.mean * up.scale) for x, y in pairs]
        axes.plot([x for x, _ in centres], [y for _, y in centres], **look, linewidth=0.7, zorder=2)
        for (row, other), (x, y) in zip(pairs, centres, strict=True):
            axes.hlines(y, *across.bounds(row), color=look["color"], linewidth=0.5, alpha=0.6, zorder=1)
            axes.vlines(x, *up.bounds(other), color=look["color"], linewidth=0.5, alpha=0.6, zorder=1)
            size = sizes[arrangement.x(row)]
            axes.plot([x], [y], color=look["color"], markersize=factor * size, **marker, zorder=3, clip_on=False)


def _sizes(n: int) -> list[float]:
    low, high = SIZES_PT
    return [low + (high - low) * number / max(1, n - 1) for number in range(n)]


def _scale(
    panels: Sequence[Axes], rows: Sequence[Comparison], measure: Measure, along: str, rim: Rim | None = None
) -> None:
    """Scale the axis to the points that are no arrows at the rim."""
    off = [row for row in rows if rim is not None and rim.holds(row, measure)]
    rows = [row for row in rows if row not in off]
    means = [row.mean * measure.scale for row in rows]
    ends = [*means, *(end for row in rows for end in measure.bounds(row))]
    log = not measure.share and not measure.signed and min(ends) > 0.0 and max(means) > SPREAD * min(means)
    limits = (0.8 * min(ends), 1.2 * max(ends)) if log else _limits(ends, measure)
    for axes in panels:
        if measure.signed:
            axes.plot(axes.get_xlim(), [0.0, 0.0], color=style.GREY, linewidth=0.7, zorder=0, scalex=False)
        if log:
            # Over more than about two decades, labels at 2 and 5 would overlap.
            subs = (1.0, 2.0, 5.0) if limits[1] < 300.0 * limits[0] else (1.0,)
            style.logarithmic(axes, along, subs)
        axes.set(**{f"{along}lim": limits})
        if rim is not None and off:
            # The axis ends before the arrows, which have no value on it.
            if not log:
                axes.yaxis.set_major_locator(MaxNLocator(5))
            axes.set_yticks([tick for tick in axes.get_yticks() if limits[0] <= tick <= limits[1]])
            axes.spines["left"].set_bounds(*limits)
            below, above = (rim.share * any((row.mean > 0.0) is up for row in off) for up in (False, True))
            shown = 1.0 - below - above
            whole = [(0.0, -below / shown), (0.0, 1.0 + above / shown)]
            axes.set_ylim(*(axes.transScale + axes.transLimits).inverted().transform(whole)[:, 1])


def _limits(ends: Sequence[float], measure: Measure) -> tuple[float, float]:
    low, high = min(ends), max(ends)
    with_0 = measure.signed or 0.0 <= low < 0.5 * high
    span = max(high, 0.0) - min(low, 0.0) if with_0 else high - low
    margin = 0.05 * span or 0.05 * abs(high) or 1.0
    low, high = low - margin, high + margin
    if measure.share:
        high = min(high, max(1.0, *ends))
    return (min(low, 0.0), max(high, 0.0)) if with_0 else (low, high)


def _page(
    arrangement: Arrangement,
    titles: Sequence[str],
    wanted_in: float | None,
    x_label: str = "",
    columns: int = 2,
    rows: Sequence[Comparison] = (),
) -> tuple[Figure, list[Axes]]:
    """Create panels with letters and titles, and a legend of all series below.

    ``wanted_in`` is the page width, None for a column or page of a paper; an empty ``x_label`` is that of the axis.
    With ``rows``, the legend omits series without rows, such as the baseline of differences.
    """
    columns = min(columns, len(titles), *([] if wanted_in is None else [max(1, int(wanted_in / LEAST_PANEL_IN))]))
    figure = page.opened(wanted_in or (style.COLUMN_IN if columns == 1 else style.PAGE_IN), len(titles) * BODY_IN)
    panels = page.panels(figure, len(titles), columns, titles if len(titles) > 1 else ())
    for axes in panels[-columns:]:
        axes.set_xlabel(x_label or arrangement.axis_label)
    drawn_as = looks(arrangement.series)
    drawn = arrangement.curves(rows) or arrangement.series
    if len(arrangement.series) > 1:
        page.legend(figure, [Line2D([], [], label=series.label, **drawn_as[series]) for series in drawn])
    return figure, panels


def _finish(figure: Figure, panels: Sequence[Axes], body_in: float, y_label: str = "") -> None:
    first = [axes for axes in panels if (place := axes.get_subplotspec()) and place.is_first_col()]
    for axes in first if y_label else ():
        axes.set_ylabel(y_label)
    page.lay_out(figure, first, body_in)


def _size_key(figure: Figure, name: str, sizes: Mapping[float, float]) -> None:
    places = list(sizes)
    chosen = dict.fromkeys(places[index] for index in (0, len(places) // 2, -1))
    look: dict[str, Any] = {"color": style.GREY, "linestyle": "", "marker": "o"}
    entries = [Line2D([], [], linestyle="", label=f"{name}:")]
    entries += [Line2D([], [], label=f"{place:g}", markersize=sizes[place], **look) for place in chosen]
    page.legend(figure, entries, "outside upper center", ncols=len(entries), handlelength=0.8)


ROW_IN, LABEL_IN = 0.34, 1.8
EFFECT_COLUMNS = 2


def short_label(term: str) -> str:
    """Return the last part of a factor's key."""
    return term.rpartition(".")[2]


def titles(conditions: Sequence[str]) -> list[str]:
    """Return a title per condition: the parts that differ between conditions.

    >>> titles(["all", "patches, bernoulli per 0.4", "patches, bernoulli per 0.8"])
    ['all', 'bernoulli per 0.4', 'bernoulli per 0.8']
    """
    parts = [condition.split(", ") for condition in conditions if condition != ALL]
    shared = set(parts[0]).intersection(*parts[1:]) if parts else set()
    return [", ".join(part for part in condition.split(", ") if part not in shared) for condition in conditions]


def effects_figure(rows: Sequence[MainEffect], metric: Metric, width_in: float | None = None) -> Figure:
    """Draw main effects on one metric under all conditions, the first factor on top."""
    conditions = list(dict.fromkeys(row.condition for row in rows))
    main = [row for row in rows if row.is_main]
    levels = {row.term: f"{row.low} to {row.high}" for row in main}
    page_in = style.PAGE_IN if width_in is None else width_in
    columns = min(EFFECT_COLUMNS if page_in > style.COLUMN_IN else 1, len(conditions))
    body_in = ROW_IN * len(levels) + 0.1
    ends = [end for row in main for end in (row.effect, row.ci95_low, row.ci95_high, 0.0) if end is not None]
    spare = 0.06 * ((max(ends) - min(ends)) or 1.0)
    with style.paper():
        figure = page.opened(page_in, len(conditions) * body_in)
        panels = page.panels(figure, len(conditions), columns, titles(conditions) if len(conditions) > 1 else ())
        for number, (axes, condition) in enumerate(zip(panels, conditions, strict=True)):
            axes.axvline(0.0, color=style.GREY, linewidth=0.6, zorder=1)
            for row in (row for row in main if row.condition == condition):
                place = list(levels).index(row.term)
                if row.ci95_low is not None and row.ci95_high is not None:
                    axes.plot([row.ci95_low, row.ci95_high], [place, place], color=style.BLUE, linewidth=1.2, zorder=2)
                axes.plot([row.effect], [place], marker="o", color=style.BLUE, linestyle="none", zorder=3)
            axes.set_xlim(min(ends) - spare, max(ends) + spare)
            axes.set_ylim(len(levels) - 0.5, -0.5)
            axes.xaxis.set_major_locator(MaxNLocator(5))
            axes.set_yticks(range(len(levels)), labels=[])
            if number % columns == 0:
                named = ((short_label(factor), between) for factor, between in levels.items())
                fitted = ([style.fitted(text, LABEL_IN, style.SMALL_PT) for text in texts] for texts in named)
                axes.set_yticks(range(len(levels)), labels=["\n".join(texts) for texts in fitted])
            axes.set_xlabel(f"effect on {words.axis(words.within(metric.label), metric.unit)}")
        page.lay_out(figure, panels[::columns], body_in)
    return figure
