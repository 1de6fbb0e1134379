"""Ranking of a sweep as a table: series down, places on the axis across, the best shaded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from missions.comparison.ranking import are_too_few, mean_ranks
from missions.comparison.rows import Rank
from visualisation import style
from visualisation.runs.arrangement import Arrangement, Series

EDGE_IN, ROW_IN, GAP_IN, TITLE_IN, HEAD_IN, NOTE_IN = 0.06, 0.19, 0.08, 0.2, 0.4, 0.24
LEAST_IN = 0.2
"""Width of a column."""
MEAN = "mean"
BEST = style.tint(style.BLUE, 0.25)
TOO_FEW = "too few runs to tell any from the best"
NOTE = "bold, shaded: best, or not significantly different from it"


def ordered(arrangement: Arrangement, shown: Sequence[Rank]) -> list[tuple[Series, float | None]]:
    """Series from the best mean rank to the worst, those without one last."""
    means = mean_ranks(shown)
    named = {series[:2]: series for series in arrangement.series}
    found = [(named[pair], mean) for pair, mean in means.items()]
    return sorted(found, key=lambda one: (one[1] is None, one[1] or 0.0, arrangement.series.index(one[0])))


def figure(arrangement: Arrangement, shown: Sequence[Rank], measured: str) -> Figure:
    """The table of one combination.

    Args:
        measured: what the ranks are by, for the heading.
    """
    rows = ordered(arrangement, shown)
    places = sorted({arrangement.x(rank) for rank in shown})
    heads = [f"{place:g}" for place in places]
    names_in = min(1.9, max(style.width_in(series.label, style.SMALL_PT) for series, _ in rows))
    column_in = max(LEAST_IN, *(style.width_in(head, style.TINY_PT) + 0.06 for head in heads))
    mean_in = style.width_in(MEAN, style.SMALL_PT) + 0.06
    fixed_in = 2 * EDGE_IN + names_in + GAP_IN + mean_in
    width_in = style.COLUMN_IN if fixed_in + column_in * len(places) <= style.COLUMN_IN else style.PAGE_IN
    column_in = (width_in - fixed_in) / len(places)
    height_in = TITLE_IN + HEAD_IN + len(rows) * ROW_IN + NOTE_IN
    with style.paper():
        drawn = style.blank(width_in, height_in)
        axes = drawn.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width_in), ylim=(height_in, 0.0))
        axes.set_axis_off()

        def write(x_in: float, y_in: float, text: str, **look: Any) -> None:
            look = {"ha": "center", "fontsize": style.SMALL_PT, **look}
            axes.text(x_in, y_in, text, va="center_baseline", **look)

        def rule(y_in: float, linewidth: float) -> None:
            axes.plot([EDGE_IN, right_in], [y_in, y_in], color=style.BLACK, linewidth=linewidth)

        first_in = EDGE_IN + names_in + GAP_IN
        end_in = first_in + len(places) * column_in
        right_in = end_in + mean_in
        heading = style.fitted(f"Rank by mean {measured.removeprefix('mean ')}", right_in - EDGE_IN, style.TEXT_PT)
        write(EDGE_IN, 0.1, heading, ha="left", fontsize=style.TEXT_PT)
        label_in, head_in, top_in = TITLE_IN + 0.1, TITLE_IN + 0.27, TITLE_IN + HEAD_IN - 0.02
        label = style.fitted(arrangement.axis_label, end_in - first_in, style.SMALL_PT)
        write((first_in + end_in) / 2, label_in, label)
        write((end_in + right_in) / 2, head_in, MEAN)
        for number, head in enumerate(heads):
            write(first_in + (number + 0.5) * column_in, head_in, head, fontsize=style.TINY_PT)
        rule(TITLE_IN, 0.8)
        rule(top_in, 0.5)
        of = {(rank.strategy, rank.policy, arrangement.x(rank)): rank for rank in shown}
        for at, (series, mean) in enumerate(rows):
            y_in = top_in + (at + 0.5) * ROW_IN + 0.02
            write(EDGE_IN, y_in, style.fitted(series.label, names_in, style.SMALL_PT), ha="left")
            write((end_in + right_in) / 2, y_in, "\u2013" if mean is None else f"{mean:.1f}")
            for number, place in enumerate(places):
                rank = of.get((series.strategy, series.policy, place))
                best = rank is not None and rank.among_best
                left_in = first_in + number * column_in
                if best:
                    box = (left_in + 0.01, y_in - ROW_IN / 2 + 0.01), column_in - 0.02, ROW_IN - 0.02
                    axes.add_patch(Rectangle(*box, facecolor=BEST, linewidth=0))
                text = "\u2013" if rank is None else f"{rank.rank:g}"
                write(left_in + column_in / 2, y_in, text, weight="bold" if best else "normal")
        bottom_in = top_in + len(rows) * ROW_IN + 0.04
        rule(bottom_in, 0.8)
        note = TOO_FEW if are_too_few(shown) else NOTE
        write(EDGE_IN, bottom_in + 0.12, note, ha="left", fontsize=style.TINY_PT)
    return drawn
