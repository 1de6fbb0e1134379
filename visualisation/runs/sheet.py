"""Page of figures over mission time: time axis, milestones as numbered flags, key.

The axis ends at a round number that all runs of a scenario share. In the panel, y is in inches down from its top, so
text stays legible for any fleet size.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from missions.figure import RunResults, axis_end_s
from visualisation import page, run_records, style, words
from visualisation.run_records import MilestoneRow

WIDE_IN = 5.0
"""Minimum width of a page wider than a column of text."""
TALLEST_IN = 9.0
"""Height of a paper's page."""
AROUND_IN, LINE_IN = 0.95, 0.137
"""Approximate height of axis and legend, and height of a line of the key."""
FLAG_IN = 0.15
FLAG_HALF_IN = 0.075
FLAG = {"boxstyle": "square,pad=0.2", "facecolor": "white", "edgecolor": style.BLACK, "linewidth": 0.5}

STAFF = {"arrowstyle": "-", "linewidth": 0.5, "shrinkA": 0.0, "shrinkB": 0.0}


class NumberedMark(NamedTuple):
    """Milestones of one time, under one number."""

    number: int
    time_s: float
    label: str


class Name(NamedTuple):
    """Text beside the panel: left end relative to the panel, or right end at ``BESIDE_IN``."""

    left_in: float
    down_in: float
    text: str
    size_pt: float = style.TINY_PT
    weight: str = "normal"


BESIDE_IN = -0.06
"""Right end of right-aligned names beside the panel."""


@dataclass(frozen=True)
class Sheet:
    """Page over mission time with one panel.

    Args:
        above: extra panel above the flags, or None.
        heights_in: of the panels, from the top.
    """

    figure: Figure
    above: Axes | None
    axes: Axes
    heights_in: Sequence[float]
    end_s: float

    @property
    def inch_s(self) -> float:
        """Duration of an inch of the time axis."""
        return float(self.axes.get_xlim()[1] / page.panel_in(self.axes)[0])

    def band(self, top_in: float, high_in: float) -> None:
        """Draw a pale background band over the duration of the run."""
        self.axes.broken_barh([(0.0, self.end_s)], (top_in, high_in), color=style.PALE, linewidth=0, zorder=0)

    def finished(self) -> Figure:
        """Lay out the page and return it."""
        page.lay_out(self.figure, [self.above, self.axes] if self.above else [self.axes], self.heights_in)
        return self.figure


def sheet(
    results: RunResults,
    names: Sequence[Name],
    body_in: float,
    legend: Sequence[Artist],
    width_in: float = style.PAGE_IN,
    above_in: float = 0.0,
    has_key: bool = True,
) -> Sheet:
    """Create a page: empty panel, names beside it, flags above, legend on top, key below.

    Args:
        body_in: height of the panel.
        above_in: height of an extra panel on top, 0 for none.
        has_key: whether the flags are listed below; else only the caption explains them.
    """
    marks = grouped(run_records.milestones(results))
    heights_in = [above_in, body_in] if above_in else [body_in]
    figure = page.opened(width_in, sum(heights_in) + LINE_IN * len(marks))
    *above, axes = page.panels(figure, len(heights_in), 1, framed=True)
    for extra in above:
        extra.set_axis_off()
    for name in names:
        axes.annotate(
            name.text, (0.0, name.down_in), (72.0 * name.left_in, 0.0), axes.get_yaxis_transform(), "offset points",
            annotation_clip=False, fontsize=name.size_pt, weight=name.weight, va="center_baseline",
            ha="right" if name.left_in == BESIDE_IN else "left",
        )  # fmt: skip
    page.legend(figure, legend, "outside upper center")
    key = [Line2D([], [], linestyle="", label=f"{mark.number}  {mark.label}") for mark in marks if has_key]
    page.legend(figure, key, room_in=width_in, handlelength=0.0, handletextpad=0.0)
    axes.set(xlim=(0.0, axis_end_s(results)), ylim=(body_in, 0.0), xlabel=words.axis("time", "s"))
    axes.set_yticks([])
    engine = figure.get_layout_engine()
    assert engine is not None
    engine.execute(figure)  # now the panel has its width
    room_in, _ = page.panel_in(axes)
    _time_axis(axes, run_records.end_s(results), room_in)
    _flags(axes, marks, room_in, _n_rows(len(marks), room_in))
    return Sheet(figure, above[0] if above else None, axes, heights_in, run_records.end_s(results))


def room_in(results: RunResults, width_in: float, has_key: bool = True) -> float:
    """Return the approximate maximum height of a body on a paper's page."""
    marks = grouped(run_records.milestones(results))
    columns = style.legend_columns([f"{mark.number}  {mark.label}" for mark in marks], width_in - 0.1)
    n_lines = -(-len(marks) // columns) if has_key else 0
    return TALLEST_IN - AROUND_IN - LINE_IN * n_lines - FLAG_IN * _n_rows(len(marks), 0.5 * width_in)


def grouped(milestones: Sequence[MilestoneRow]) -> list[NumberedMark]:
    """Number milestones by time; those of one time share a number."""
    by_time: dict[float, list[str]] = defaultdict(list)
    for milestone in sorted(milestones, key=lambda milestone: milestone.time_s):
        by_time[milestone.time_s].append(milestone.label)
    return [
        NumberedMark(number, time_s, f"{'; '.join(labels)} ({time_s:.{0 if time_s >= 100 else 1}f} s)")
        for number, (time_s, labels) in enumerate(by_time.items(), start=1)
    ]


def spread(wanted_in: Sequence[float], gap_in: float, low_in: float, high_in: float) -> list[float]:
    """Move ascending positions minimally to be ``gap_in`` apart within the limits.

    >>> spread([1.0, 1.0, 2.0], 0.5, 0.0, 2.0)
    [1.0, 1.5, 2.0]
    >>> spread([1.0, 2.0, 2.0], 0.5, 0.0, 2.0)
    [1.0, 1.5, 2.0]
    """
    placed: list[float] = []
    for want_in in wanted_in:
        placed.append(max(want_in, placed[-1] + gap_in if placed else low_in))
    limit_in = high_in
    for index in reversed(range(len(placed))):
        placed[index] = min(placed[index], limit_in)
        limit_in = placed[index] - gap_in
    return placed


def _n_rows(n_flags: int, width_in: float) -> int:
    per_row = max(1, int(width_in / (2 * FLAG_HALF_IN + 0.02)) - 1)
    return -(-n_flags // per_row)


def _time_axis(axes: Axes, run_end_s: float, width_in: float) -> None:
    """Set the ticks and end the axis lines at the end of the run."""
    end_s = axes.get_xlim()[1]
    ticks = MaxNLocator(max(1, int(width_in / 0.5)), steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, end_s)
    shown = {}
    for tick in ticks:
        label = f"{tick:g}" if tick < 1e6 else f"{tick:.3g}"
        half_in = style.width_in(label, style.SMALL_PT) / 2
        at_in = tick / end_s * width_in
        if tick <= run_end_s and half_in - 0.035 <= at_in <= width_in - half_in + 0.035:
            shown[float(tick)] = label
    axes.set_xticks(list(shown), list(shown.values()))
    axes.spines["top"].set_visible(False)
    axes.spines["bottom"].set_bounds(0.0, run_end_s)
    axes.spines["right"].set_position(("data", run_end_s))


def _flags(axes: Axes, marks: Sequence[NumberedMark], width_in: float, n_rows: int) -> None:
    scale = axes.get_xlim()[1] / width_in
    for row in range(n_rows):
        chosen = marks[row::n_rows]
        wanted_in = [mark.time_s / scale for mark in chosen]
        places_in = spread(wanted_in, 2 * FLAG_HALF_IN + 0.02, FLAG_HALF_IN, width_in - FLAG_HALF_IN)
        up_in = 0.06 + FLAG_IN * (row + 0.5)
        for mark, at_in, place_in in zip(chosen, wanted_in, places_in, strict=True):
            axes.axvline(mark.time_s, color=style.BLACK, linewidth=0.5, linestyle=(0, (3, 2)), zorder=3)
            axes.annotate(
                str(mark.number), (mark.time_s, 0.0), (72.0 * (place_in - at_in), 72.0 * up_in),
                textcoords="offset points", fontsize=style.TINY_PT, ha="center", va="center_baseline",
                bbox=FLAG, arrowprops=STAFF, annotation_clip=False, zorder=5 + n_rows - row,
            )  # fmt: skip
