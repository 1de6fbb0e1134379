"""Ranking of a sweep as a table: series down, places on the axis across, the best shaded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from missions.comparison.ranking import are_too_few, mean_ranks
from missions.comparison.rows import Rank
from visualisation import style
from visualisation.output import DrawingError
from visualisation.page import Box, Page
from visualisation.sweeps.arrangement import Arrangement, Series

EDGE_IN, ROW_IN, GAP_IN, TITLE_IN, HEAD_IN, NOTE_IN = 0.06, 0.19, 0.08, 0.2, 0.4, 0.24
LEAST_IN = 0.2
"""Width of a column."""
MEAN = "mean"
BEST = style.tint(style.BLUE, 0.25)
TOO_FEW = "too few runs to tell any from the best"
NOTE = "bold, shaded: best, or not told from it"
ONE_RUN = "deterministic, n = 1: nothing was tested"
UNEQUAL, NOTE_OF_UNEQUAL = "*", "; *: unequal work"
"""Mark of a rank behind those of like success."""


def ordered(arrangement: Arrangement, shown: Sequence[Rank]) -> list[tuple[Series, float | None]]:
    """Series from the best mean rank to the worst, those without one last."""
    means = mean_ranks(shown)
    named = {series[:2]: series for series in arrangement.series}
    found = [(named[pair], mean) for pair, mean in means.items()]
    return sorted(found, key=lambda ranked: (ranked[1] is None, ranked[1] or 0.0, arrangement.series.index(ranked[0])))


@dataclass(frozen=True)
class RankTable:
    """The lengths of a table, in inches from its upper left corner, and the axes that it is written on."""

    axes: Axes
    names_in: float
    column_in: float
    first_in: float
    end_in: float
    right_in: float

    def write(self, x_in: float, y_in: float, text: str, **look: Any) -> None:
        """Text in the middle of x."""
        look = {"ha": "center", "fontsize": style.SMALL_PT, **look}
        self.axes.text(x_in, y_in, text, va="center_baseline", **look)

    def rule(self, y_in: float, linewidth: float) -> None:
        """A line from edge to edge."""
        self.axes.plot([EDGE_IN, self.right_in], [y_in, y_in], color=style.BLACK, linewidth=linewidth)

    def middle_in(self, number: int) -> float:
        """Middle of a column."""
        return self.first_in + (number + 0.5) * self.column_in

    @property
    def mean_in(self) -> float:
        """Middle of the column of means."""
        return (self.end_in + self.right_in) / 2


def figure(arrangement: Arrangement, shown: Sequence[Rank], measured: str, width_in: float | None = None) -> Figure:
    """The table of one combination.

    Args:
        arrangement: of the sweep.
        shown: ranks of the combination.
        measured: what the ranks are by, for the heading.
        width_in: of the page; a column of text if left out, or a page where the table needs it.
    """
    rows = ordered(arrangement, shown)
    places = sorted({arrangement.x(rank) for rank in shown})
    with style.paper():
        page, table = _table([series.label for series, _ in rows], [f"{place:g}" for place in places], width_in)
        _head(table, arrangement.axis_label, places, measured)
        top_in = TITLE_IN + HEAD_IN - 0.02
        of = {(rank.strategy, rank.policy, arrangement.x(rank)): rank for rank in shown}
        for at, (series, mean) in enumerate(rows):
            y_in = top_in + (at + 0.5) * ROW_IN + 0.02
            name = style.fitted(series.label, table.names_in, style.SMALL_PT)
            table.write(EDGE_IN, y_in, name, ha="left")
            table.write(table.mean_in, y_in, "\u2013" if mean is None else f"{mean:.1f}")
            for number, place in enumerate(places):
                _entry(table, number, y_in, of.get((series.strategy, series.policy, place)))
        bottom_in = top_in + len(rows) * ROW_IN + 0.04
        table.rule(bottom_in, 0.8)
        one_run = all(rank.deterministic for rank in shown)
        note = ONE_RUN if one_run else TOO_FEW if are_too_few(shown) else NOTE
        note += NOTE_OF_UNEQUAL if any(rank.unequal_success for rank in shown) else ""
        table.write(EDGE_IN, bottom_in + 0.12, note, ha="left", fontsize=style.TINY_PT)
    return page.figure


def _table(names: Sequence[str], heads: Sequence[str], wanted_in: float | None) -> tuple[Page, RankTable]:
    """A page for that many rows and columns, as wide as a column of text if they have room there.

    Raises:
        DrawingError: it is wanted narrower than the table can be.
    """
    names_in = min(1.9, max(style.width_in(name, style.SMALL_PT) for name in names))
    least_in = max(LEAST_IN, *(style.width_in(head, style.TINY_PT) + 0.06 for head in heads))
    mean_in = style.width_in(MEAN, style.SMALL_PT) + 0.06
    fixed_in = 2 * EDGE_IN + names_in + GAP_IN + mean_in
    needed_in = fixed_in + least_in * len(heads)
    width_in = wanted_in or (style.COLUMN_IN if needed_in <= style.COLUMN_IN else style.PAGE_IN)
    if wanted_in is not None and needed_in > wanted_in:
        raise DrawingError(
            f"ranking: needs a width of {needed_in:.1f} in for {len(heads)} columns; {wanted_in:g} given"
        )
    column_in = (width_in - fixed_in) / len(heads)
    page = Page(width_in, TITLE_IN + HEAD_IN + len(names) * ROW_IN + NOTE_IN)
    axes = page.panel(Box(0.0, 0.0, page.width_in, page.height_in))
    axes.set(xlim=(0.0, page.width_in), ylim=(page.height_in, 0.0))
    axes.set_axis_off()
    first_in = EDGE_IN + names_in + GAP_IN
    end_in = first_in + len(heads) * column_in
    return page, RankTable(axes, names_in, column_in, first_in, end_in, end_in + mean_in)


def _head(table: RankTable, axis_label: str, places: Sequence[float], measured: str) -> None:
    """The heading, and the places on the axis above their columns."""
    heading = style.fitted(f"Rank by mean {measured.removeprefix('mean ')}", table.right_in - EDGE_IN, style.TEXT_PT)
    table.write(EDGE_IN, 0.1, heading, ha="left", fontsize=style.TEXT_PT)
    head_in = TITLE_IN + 0.27
    label = style.fitted(axis_label, table.end_in - table.first_in, style.SMALL_PT)
    table.write((table.first_in + table.end_in) / 2, TITLE_IN + 0.1, label)
    table.write(table.mean_in, head_in, MEAN)
    for number, place in enumerate(places):
        table.write(table.middle_in(number), head_in, f"{place:g}", fontsize=style.TINY_PT)
    table.rule(TITLE_IN, 0.8)
    table.rule(TITLE_IN + HEAD_IN - 0.02, 0.5)


def _entry(table: RankTable, number: int, y_in: float, rank: Rank | None) -> None:
    """One rank, bold and shaded if it is among the best; a dash where there is none."""
    best = rank is not None and rank.among_best and not rank.deterministic
    if best:
        left_in = table.first_in + number * table.column_in
        box = (left_in + 0.01, y_in - ROW_IN / 2 + 0.01), table.column_in - 0.02, ROW_IN - 0.02
        table.axes.add_patch(Rectangle(*box, facecolor=BEST, linewidth=0))
    text = "\u2013" if rank is None else f"{rank.rank:g}{UNEQUAL if rank.unequal_success else ''}"
    table.write(table.middle_in(number), y_in, text, weight="bold" if best else "normal")
