"""Ranking of a sweep as a table: series down, axis values across, the best shaded."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from missions.comparison import Rank
from missions.comparison.ranking import are_too_few, mean_ranks
from visualisation import page, style
from visualisation.output import DrawingError
from visualisation.sweeps.arrangement import Arrangement, Series

ROW_IN, LONGEST_NAME_IN = 0.19, 1.9
LEAST_IN = 0.2
NONE = "\u2013"
MEAN = "mean"
BEST = style.tint(style.BLUE, 0.25)
TOO_FEW = "too few runs for significant differences"
NOTE = "shaded: best, or no significant difference"
ONE_RUN = "deterministic, n = 1: no test"
UNEQUAL, NOTE_OF_UNEQUAL = "*", "; *: unequal work"
"""Mark of a rank with a significantly lower success rate, and its explanation."""


def ordered(arrangement: Arrangement, shown: Sequence[Rank]) -> list[tuple[Series, float | None]]:
    """Return series by mean rank, best first, those without one last."""
    means = mean_ranks(shown)
    named = {series[:2]: series for series in arrangement.series}
    pairs = [(named[pair], mean) for pair, mean in means.items()]
    return sorted(pairs, key=lambda ranked: (ranked[1] is None, ranked[1] or 0.0, arrangement.series.index(ranked[0])))


def figure(arrangement: Arrangement, shown: Sequence[Rank], measured: str, width_in: float | None = None) -> Figure:
    """Draw the table of one combination, ranked by the metric named ``measured``; DrawingError if it is too wide."""
    rows = ordered(arrangement, shown)
    places = sorted({arrangement.x(rank) for rank in shown})
    names = [style.fitted(series.label, LONGEST_NAME_IN, style.SMALL_PT) for series, _ in rows]
    heads = [f"{place:g}" for place in places]
    names_in = max(style.width_in(name, style.SMALL_PT) for name in names)
    least_in = max(LEAST_IN, *(style.width_in(head, style.TINY_PT) + 0.06 for head in heads))
    needed_in = names_in + least_in * len(heads) + style.width_in(MEAN, style.TINY_PT) + 0.2
    if width_in is not None and needed_in > width_in:
        raise DrawingError(f"ranking: needs a width of {needed_in:.1f} in for {len(heads)} columns; {width_in:g} given")
    page_in = width_in or (style.COLUMN_IN if needed_in <= style.COLUMN_IN else style.PAGE_IN)
    ranks = {(rank.strategy, rank.policy, arrangement.x(rank)): rank for rank in shown}
    with style.paper():
        drawn = page.opened(page_in, ROW_IN * len(rows))
        (axes,) = page.panels(drawn, 1, 1, framed=True)
        axes.spines[["left", "right"]].set_visible(False)
        heading = f"Rank by mean {measured.removeprefix('mean ')}"
        drawn.suptitle(style.fitted(heading, page_in - 0.1, style.TEXT_PT), x=0.02, ha="left", fontsize=style.TEXT_PT)
        axes.xaxis.tick_top()
        axes.xaxis.set_label_position("top")
        axes.set_xticks(range(len(heads) + 1), [*heads, MEAN], fontsize=style.TINY_PT)
        axes.set_yticks(range(len(rows)), names)
        axes.tick_params(length=0)
        axes.set_xlabel(arrangement.axis_label, fontsize=style.SMALL_PT, labelpad=4.0)
        axes.set(xlim=(-0.5, len(heads) + 0.5), ylim=(len(rows) - 0.5, -0.5))
        for row, (series, mean) in enumerate(rows):
            for number, place in enumerate(places):
                _entry(axes, number, row, ranks.get((series.strategy, series.policy, place)))
            _write(axes, len(places), row, NONE if mean is None else f"{mean:.1f}")
        one_run = all(rank.deterministic for rank in shown)
        note = ONE_RUN if one_run else TOO_FEW if are_too_few(shown) else NOTE
        note += NOTE_OF_UNEQUAL if any(rank.unequal_success for rank in shown) else ""
        drawn.supxlabel(note, x=0.02, ha="left", fontsize=style.TINY_PT)
        page.lay_out(drawn, [axes], ROW_IN * len(rows))
    return drawn


def _write(axes: Axes, column: int, row: int, text: str, weight: str = "normal") -> None:
    axes.text(column, row, text, ha="center", va="center_baseline", fontsize=style.SMALL_PT, weight=weight)


def _entry(axes: Axes, column: int, row: int, rank: Rank | None) -> None:
    best = rank is not None and rank.among_best and not rank.deterministic
    if best:
        axes.add_patch(Rectangle((column - 0.47, row - 0.45), 0.94, 0.9, facecolor=BEST, linewidth=0))
    text = NONE if rank is None else f"{rank.rank:g}{UNEQUAL if rank.unequal_success else ''}"
    _write(axes, column, row, text, "bold" if best else "normal")
