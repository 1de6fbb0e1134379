"""Charts of a sweep: metrics along the axis with bands, the trade-off between two metrics, the overview.

A strategy has its colour, marker, line and fill by its name, so that charts of different studies agree; series stay
apart for colour-blind readers and in a grey print. Where strategies and policies both vary, colour and marker tell the
strategy, line and fill the policy.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from missions.comparison.rows import Comparison
from visualisation import labels, style
from visualisation.runs.arrangement import POLICIES, REPEAT, STRATEGIES, Arrangement, Combination, Series, policy_place
from visualisation.sweeps.measures import MEASURES, OVERVIEW, TRADE_OFF, Measure

LEFT_IN, RIGHT_IN, TOP_IN, TITLE_IN, AXIS_IN, GAP_IN, ROW_GAP_IN = 0.58, 0.1, 0.08, 0.18, 0.38, 0.66, 0.26
BODY_IN, TRADE_OFF_BODY_IN, OVERVIEW_BODY_IN = 2.1, 2.5, 1.45
SIZE_KEY_IN = 0.17
SPREAD = 10.0
"""Ratio of the largest mean to the smallest above which an axis is logarithmic."""
BAND, MOST_INK = 0.2, 0.55
"""Opacity of a band, and of all bands together."""
HOLLOW = (1, 3, 4)
"""Looks with hollow markers, and so are all after the seventh: those of one line style differ in fill or in grey."""
SHARE_TOPS = (0.1, 0.25, 0.5, 1.0)
SIDE_BY_SIDE, MOST_ASIDE = 0.45, 0.045
"""How far the points of one place on the axis are set apart: part of the way to the next place, and of the axis."""
SIZES_PT = (2.0, 6.0)
"""Markers of the trade-off, at the low end of the axis and at the high one."""


def looks(series: Sequence[Series]) -> dict[Series, dict[str, Any]]:
    """How each series is drawn; names that are not known take the looks that are left, in their order."""
    strategies = list(dict.fromkeys(one.strategy for one in series))
    policies = sorted({one.policy for one in series}, key=policy_place)
    bases = list(dict.fromkeys(policy.removesuffix(REPEAT) for policy in policies))
    of_strategy, of_base = _numbers(strategies, STRATEGIES), _numbers(bases, POLICIES)
    found = {}
    for one in series:
        repeats = one.policy.endswith(REPEAT)
        if len(strategies) == 1 and len(policies) > 1:
            number = of_base[one.policy.removesuffix(REPEAT)]
            line, hollow = style.LINES[repeats], repeats
        else:
            number = of_strategy[one.strategy]
            line, hollow = style.look(number).line, number in HOLLOW or number >= len(style.COLOURS)
            if len(policies) > 1:
                line, hollow = style.LINES[policies.index(one.policy) % len(style.LINES)], repeats
        colour, marker = style.look(number).colour, style.look(number).marker
        found[one] = {
            "color": colour, "marker": marker, "linestyle": line, "markeredgewidth": 0.7,
            "markerfacecolor": "white" if hollow else colour, "markersize": 4.3 if marker in "PX" else 3.4,
        }  # fmt: skip
    return found


def _numbers(names: Sequence[str], known: Sequence[str]) -> dict[str, int]:
    """Number of each name's look: its place among the known, or the next that no name here has."""
    fixed = {name: known.index(name) for name in names if name in known}
    free = (number for number in itertools.count() if number not in fixed.values())
    return {name: fixed[name] if name in fixed else next(free) for name in names}


# Kinds --------------------------------------------------------------------------------------------


def metric(
    arrangement: Arrangement, combinations: Sequence[Combination], rows: Sequence[Comparison], measure: Measure
) -> Figure:
    """One metric along the axis, a panel for each combination."""
    with style.paper():
        drawn, panels = _page(arrangement, [arrangement.titles[one] for one in combinations], BODY_IN)
        shown = [arrangement.of(one, rows) for one in combinations]
        for axes, own in zip(panels, shown, strict=True):
            _curves(axes, arrangement, own, measure)
        _scale(panels, [row for own in shown for row in own], measure, "y")
        for axes in panels[:: _columns(panels)]:
            axes.set_ylabel(measure.label, labelpad=3)
    return drawn


def overview(arrangement: Arrangement, combination: Combination, rows: Mapping[str, Sequence[Comparison]]) -> Figure:
    """Six metrics of one combination under one legend; a panel whose metric has no values says so."""
    with style.paper():
        measures = [MEASURES[kind] for kind in OVERVIEW]
        titles = [measure.name for measure in measures]
        drawn, panels = _page(arrangement, titles, OVERVIEW_BODY_IN, columns=3)
        for axes, measure in zip(panels, measures, strict=True):
            own = arrangement.of(combination, rows[measure.metric])
            _curves(axes, arrangement, own, measure, 0.75)
            axes.set_ylabel(measure.label, labelpad=3)
            if own:
                _scale([axes], own, measure, "y")
            else:
                axes.text(0.5, 0.5, "no values", transform=axes.transAxes, ha="center", color=style.GREY)
                axes.set_yticks([])
    return drawn


def trade_off(
    arrangement: Arrangement, combinations: Sequence[Combination], rows: Mapping[str, Sequence[Comparison]]
) -> Figure:
    """One metric over another: the points of a series joined along the axis, whose value is the size of the marker."""
    across, up = TRADE_OFF
    shown = [[arrangement.of(one, rows[measure.metric]) for measure in TRADE_OFF] for one in combinations]
    places = sorted({arrangement.x(row) for pair in shown for own in pair for row in own})
    sizes = dict(zip(places, _sizes(len(places)), strict=True))
    with style.paper():
        titles = [arrangement.titles[one] for one in combinations]
        drawn, panels = _page(arrangement, titles, TRADE_OFF_BODY_IN, across.label, SIZE_KEY_IN)
        ends = [_crosses(axes, arrangement, own, sizes) for axes, own in zip(panels, shown, strict=True)]
        for number, (measure, along) in enumerate(((across, "x"), (up, "y"))):
            _scale(panels, [row for pair in shown for row in pair[number]], measure, along)
        for axes in panels[:: _columns(panels)]:
            axes.set_ylabel(up.label, labelpad=3)
        for axes, (named, points) in zip(panels, ends, strict=True):
            if len({label.text for label in named}) > 1:  # else the largest markers say it
                labels.place(axes, named, points)
        _size_key(drawn, arrangement.axis_label, sizes)
    return drawn


# Parts --------------------------------------------------------------------------------------------


def _curves(
    axes: Axes, arrangement: Arrangement, rows: Sequence[Comparison], measure: Measure, size: float = 1.0
) -> None:
    """Means with bands; the points of one place on the axis stand side by side, so that equal ones can be seen."""
    curves = arrangement.curves(rows)
    xs = sorted({arrangement.x(row) for row in rows})
    if arrangement.is_spaced_evenly(rows):
        places = {x: float(number) for number, x in enumerate(xs)}
    else:
        places = {x: x for x in xs}
    at_xs = list(places.values())
    step = min((b - a for a, b in itertools.pairwise(at_xs)), default=1.0)
    width = at_xs[-1] - at_xs[0] + step if xs else step
    spread = min(SIDE_BY_SIDE * step, MOST_ASIDE * width)
    drawn = looks(arrangement.series)
    opacity = min(BAND, MOST_INK / len(arrangement.series))
    for number, series in enumerate(arrangement.series):
        own = curves.get(series, [])
        aside = spread * ((number + 0.5) / len(arrangement.series) - 0.5)
        at = [places[arrangement.x(row)] + aside for row in own]
        low, high = zip(*(_bounds(row, measure) for row in own), strict=True) if own else ((), ())
        look = {**drawn[series], "markersize": size * drawn[series]["markersize"]}
        if not measure.whiskers:
            axes.fill_between(at, low, high, color=look["color"], alpha=opacity, linewidth=0)
        if measure.whiskers or len(own) == 1:
            shown = [not measure.whiskers or row.mean < 1.0 for row in own]
            bars = list(itertools.compress(zip(at, low, high, strict=True), shown))
            if bars:
                axes.vlines(*zip(*bars, strict=True), color=look["color"], linewidth=0.7)
        axes.plot(at, [row.mean * measure.scale for row in own], **look)
    if xs:
        axes.set_xlim(at_xs[0] - 0.5 * step, at_xs[-1] + 0.5 * step)
    if xs and len(xs) <= 6 and step >= 0.1 * (at_xs[-1] - at_xs[0]):
        axes.set_xticks(at_xs, [f"{x:g}" for x in xs])
    else:
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))


def _crosses(
    axes: Axes, arrangement: Arrangement, shown: Sequence[Sequence[Comparison]], sizes: Mapping[float, float]
) -> tuple[list[labels.Label], list[tuple[float, float]]]:
    """Draw the series of a trade-off; returns a label for the last point of each, and all points."""
    across, up = TRADE_OFF
    drawn = looks(arrangement.series)
    curves = [arrangement.curves(rows) for rows in shown]
    named: list[labels.Label] = []
    points: list[tuple[float, float]] = []
    for series, own in curves[0].items():
        look = dict(drawn[series])
        marker = {name: look.pop(name) for name in ("marker", "markeredgewidth", "markerfacecolor")}
        factor = look.pop("markersize") / 3.4
        above = {arrangement.x(row): row for row in curves[1].get(series, [])}
        pairs = [(row, above[arrangement.x(row)]) for row in own if arrangement.x(row) in above]
        at = [(x.mean * across.scale, y.mean * up.scale) for x, y in pairs]
        axes.plot([x for x, _ in at], [y for _, y in at], **look, linewidth=0.7, zorder=2)
        for (row, other), (x, y) in zip(pairs, at, strict=True):
            axes.hlines(y, *_bounds(row, across), color=look["color"], linewidth=0.5, alpha=0.6, zorder=1)
            axes.vlines(x, *_bounds(other, up), color=look["color"], linewidth=0.5, alpha=0.6, zorder=1)
            size = sizes[arrangement.x(row)]
            axes.plot([x], [y], color=look["color"], markersize=factor * size, **marker, zorder=3, clip_on=False)
        named += [labels.Label(f"{arrangement.x(pairs[-1][0]):g}", *at[-1])] if pairs else []
        points += at
    return named, points


def _bounds(row: Comparison, measure: Measure) -> tuple[float, float]:
    """Ends of the interval, on the scale of the axis; the mean where there is none."""
    low, high = (row.mean if bound is None else bound for bound in (row.ci95_low, row.ci95_high))
    return low * measure.scale, high * measure.scale


def _sizes(n: int) -> list[float]:
    low, high = SIZES_PT
    return [low + (high - low) * at / max(1, n - 1) for at in range(n)]


def _scale(panels: Sequence[Axes], rows: Sequence[Comparison], measure: Measure, along: str) -> None:
    """The same limits for all panels: round ones for shares, logarithmic for a large spread, from 0 if that is near.

    Intervals that are very much wider than most are cut, so that they do not flatten everything else.
    """
    means = [row.mean * measure.scale for row in rows]
    intervals = [_bounds(row, measure) for row in rows]
    reach = max(0.5 * (max(means) - min(means)), 2.0 * median(high - low for low, high in intervals))
    low = max(0.0, min(means) - reach, min(low for low, _ in intervals))
    high = min(max(means) + reach, max(high for _, high in intervals))
    log = not measure.share and min(means) > 0.0 and max(means) > SPREAD * min(means)
    if measure.share:
        top = next((top for top in SHARE_TOPS if high <= top), 1.0)
        bottom = min(math.floor(10.0 * low) / 10.0, top - 0.1) if low > 0.5 * top else 0.0
        limits = bottom - 0.03 * (top - bottom), top + 0.03 * (top - bottom)
    elif log:
        limits = 0.8 * max(low, 0.5 * min(means)), 1.2 * high
    elif low < 0.5 * high:
        limits = 0.0, 1.05 * high or 1.0
    else:
        margin = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
        limits = max(0.0, low - margin), high + margin
    for axes in panels:
        if log:
            subs = (1.0, 2.0, 5.0) if limits[1] < 300.0 * limits[0] else (1.0,)
            style.logarithmic(axes, along, subs)
        axes.set(**{f"{along}lim": limits})


# Pages --------------------------------------------------------------------------------------------


def _columns(panels: Sequence[Axes]) -> int:
    return 1 if len(panels) == 1 else 2


def _page(
    arrangement: Arrangement,
    titles: Sequence[str],
    body_in: float,
    x_label: str | None = None,
    key_in: float = 0.0,
    columns: int = 2,
) -> tuple[Figure, list[Axes]]:
    """Panels with letters and titles, the legend of all series below; one panel is as wide as a column of text.

    Args:
        key_in: height to leave below the legend.
    """
    columns = min(columns, len(titles))
    width_in = style.COLUMN_IN if columns == 1 else style.PAGE_IN
    n_rows = -(-len(titles) // columns)
    names = [style.fitted(series.label, width_in - 0.7, style.SMALL_PT) for series in arrangement.series]
    n_legend = style.legend_columns(names, width_in - 0.1)
    legend_in = style.legend_height_in(len(names), n_legend) + 0.08 if len(names) > 1 else 0.03
    top_in = TITLE_IN + TOP_IN if len(titles) > 1 else TOP_IN
    height_in = n_rows * (top_in + body_in) + (n_rows - 1) * ROW_GAP_IN + AXIS_IN + legend_in + key_in
    panel_in = (width_in - LEFT_IN - RIGHT_IN - (columns - 1) * GAP_IN) / columns
    drawn = style.blank(width_in, height_in)
    panels = []
    for number, title in enumerate(titles):
        row, column = divmod(number, columns)
        left_in = LEFT_IN + column * (panel_in + GAP_IN)
        bottom_in = height_in - row * (top_in + body_in + ROW_GAP_IN) - top_in - body_in
        box = left_in / width_in, bottom_in / height_in, panel_in / width_in, body_in / height_in
        axes = drawn.add_axes(box)
        axes.spines[["top", "right"]].set_visible(False)
        if len(titles) > 1:
            heading = style.fitted(f"({'abcdefgh'[number]}) {title}", panel_in, style.TEXT_PT)
            axes.set_title(heading, loc="left", pad=3)
        if number + columns >= len(titles):
            x_name = arrangement.axis_label if x_label is None else x_label
            axes.set_xlabel(style.fitted(x_name, panel_in, style.TEXT_PT), labelpad=2)
        panels.append(axes)
    if len(names) > 1:
        drawn_as = looks(arrangement.series)
        handles = [
            Line2D([], [], label=name, **drawn_as[series])
            for series, name in zip(arrangement.series, names, strict=True)
        ]
        place = 0.5, (0.03 + key_in) / height_in
        drawn.legend(handles=handles, loc="lower center", bbox_to_anchor=place, ncols=n_legend)
    return drawn, panels


def _size_key(drawn: Figure, name: str, sizes: Mapping[float, float]) -> None:
    """Which marker size is which place on the axis: the lowest, the middle one, the highest."""
    places = list(sizes)
    chosen = dict.fromkeys(places[at] for at in (0, len(places) // 2, -1))
    look: dict[str, Any] = {"color": style.GREY, "linestyle": "", "marker": "o"}
    shown = style.fitted(f"{name}:", 2.2, style.SMALL_PT)
    handles = [Line2D([], [], linestyle="", label=shown)]
    handles += [Line2D([], [], label=f"{place:g}", markersize=sizes[place], **look) for place in chosen]
    anchor = 0.5, 0.03 / drawn.get_figheight()
    drawn.legend(handles=handles, loc="lower center", bbox_to_anchor=anchor, ncols=len(handles), handlelength=0.8)
