"""The page that figures over mission time share: a time axis, milestones as numbered flags, a key.

The axis has one scale and a round end, so that runs of a scenario can be laid side by side. All lengths are in
inches. In the panel, y counts downwards from the top of the body, so that whoever draws there draws in inches too, and
what is legible for two vehicles is so for sixteen.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from missions.figure import RunResults, axis_end_s
from visualisation import style, words
from visualisation.page import Box, Legend, Page
from visualisation.runs import reading
from visualisation.runs.reading import MilestoneRow

WIDE_IN = 5.0
"""Width from which a page has room for more than a column of text has."""
RIGHT_IN = 0.12
GAP_IN = 0.1
AXIS_IN = 0.4
LINE_IN = 0.135
FLAG_IN = 0.15
FLAG_HALF_IN = 0.075
FLAG = {"boxstyle": "square,pad=0.2", "facecolor": "white", "edgecolor": style.BLACK, "linewidth": 0.5}


class NumberedMark(NamedTuple):
    """Milestones reached at one time, under one number."""

    number: int
    time_s: float
    label: str


@dataclass(frozen=True)
class Sheet:
    """A page over mission time with one panel; ``top_in`` is where its body begins, ``end_s`` when the run ended."""

    page: Page
    axes: Axes
    top_in: float
    end_s: float

    @property
    def figure(self) -> Figure:
        """What is drawn."""
        return self.page.figure

    def band(self, top_in: float, high_in: float) -> None:
        """A pale band behind what is drawn, as long as the run."""
        self.axes.broken_barh([(0.0, self.end_s)], (top_in, high_in), color=style.PALE, linewidth=0, zorder=0)

    def note(self, x_in: float, y_in: float, text: str, size_pt: float, **look: str) -> None:
        """Text beside the panel: x from the left edge of the figure, y down from the top of the body."""
        self.page.text(x_in, self.top_in + y_in, text, fontsize=size_pt, **look)


def sheet(
    results: RunResults,
    left_in: float,
    body_in: float,
    legend: Sequence[Artist],
    width_in: float = style.PAGE_IN,
    above_in: float = 0.0,
    has_key: bool = True,
) -> Sheet:
    """A page with an empty panel, flags above, time axis, legend and key below.

    Args:
        results: of the run.
        left_in: room for names left of the panel.
        body_in: height of the panel.
        legend: its entries.
        width_in: of the page.
        above_in: room for something else above all this.
        has_key: whether the flags are listed below; else the caption alone says what they are.
    """
    room_in = width_in - left_in - RIGHT_IN
    marks = grouped(reading.milestones(results))
    n_rows = _n_rows(len(marks), room_in)

    key = [style.fitted(f"{m.number}  {m.label}", width_in - 0.3, style.SMALL_PT) for m in marks if has_key]
    n_key = key_columns(key, width_in)
    entries = Legend(tuple(legend), width_in - 0.2)
    key_in = LINE_IN * -(-len(key) // n_key) + 0.05
    legend_in = entries.height_in + 0.08 if legend else 0.0
    top_in = above_in + 0.08 + (FLAG_IN * n_rows + 0.06 if marks else 0.0)

    page = Page(width_in, top_in + body_in + AXIS_IN + legend_in + key_in)
    axes = page.panel(Box(left_in, top_in, room_in, body_in))
    _time_axis(axes, axis_end_s(results), reading.end_s(results), room_in, body_in)
    _flags(axes, marks, room_in, n_rows)
    middle_in = left_in + room_in / 2
    page.text(middle_in, top_in + body_in + AXIS_IN - 0.03, words.axis("time", "s"), ha="center", va="bottom")
    page.legend(entries, key_in + 0.12)
    _key(page, key, n_key, key_in)
    return Sheet(page, axes, top_in, reading.end_s(results))


def grouped(milestones: Sequence[MilestoneRow]) -> list[NumberedMark]:
    """Milestones numbered by time; those of one time share a number."""
    at: dict[float, list[str]] = defaultdict(list)
    for milestone in sorted(milestones, key=lambda milestone: milestone.time_s):
        at[milestone.time_s].append(milestone.label)
    return [
        NumberedMark(number, time_s, f"{'; '.join(labels)} ({time_s:.{0 if time_s >= 100 else 1}f} s)")
        for number, (time_s, labels) in enumerate(at.items(), start=1)
    ]


def key_columns(entries: Sequence[str], width_in: float = style.PAGE_IN) -> int:
    """How many columns of such entries fit a page of that width."""
    widest_in = max((style.width_in(entry, style.SMALL_PT) for entry in entries), default=1.0)
    return max(1, min(len(entries), int((width_in - 0.2) / (widest_in + 0.2))))


def spread(wanted_in: Sequence[float], gap_in: float, low_in: float, high_in: float) -> list[float]:
    """Ascending positions moved as little as needed to be ``gap_in`` apart, from ``low_in`` to ``high_in``.

    >>> spread([1.0, 1.0, 2.0], 0.5, 0.0, 2.0)
    [1.0, 1.5, 2.0]
    >>> spread([1.0, 2.0, 2.0], 0.5, 0.0, 2.0)
    [1.0, 1.5, 2.0]
    """
    placed: list[float] = []
    for want_in in wanted_in:
        placed.append(max(want_in, placed[-1] + gap_in if placed else low_in))
    limit_in = high_in
    for at in reversed(range(len(placed))):
        placed[at] = min(placed[at], limit_in)
        limit_in = placed[at] - gap_in
    return placed


def _n_rows(n_flags: int, width_in: float) -> int:
    per_row = max(1, int(width_in / (2 * FLAG_HALF_IN + 0.02)) - 1)
    return -(-n_flags // per_row)


def _time_axis(axes: Axes, end_s: float, run_end_s: float, width_in: float, body_in: float) -> None:
    """An axis with a scale that ends at a round time, drawn as far as the run goes."""
    axes.set_xlim(0.0, end_s)
    axes.set_ylim(body_in, 0.0)
    axes.set_yticks([])
    ticks = MaxNLocator(max(1, int(width_in / 0.5)), steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, end_s)
    shown = {}
    for tick in ticks:
        label = f"{tick:g}" if tick < 1e6 else f"{tick:.3g}"
        half_in = style.width_in(label, style.SMALL_PT) / 2
        at_in = tick / end_s * width_in
        if tick <= run_end_s and half_in - GAP_IN / 3 <= at_in <= width_in - half_in + GAP_IN / 3:
            shown[float(tick)] = label
    axes.set_xticks(list(shown), list(shown.values()))
    axes.spines["top"].set_visible(False)
    axes.spines["bottom"].set_bounds(0.0, run_end_s)
    axes.spines["right"].set_position(("data", run_end_s))


def _flags(axes: Axes, marks: Sequence[NumberedMark], width_in: float, n_rows: int) -> None:
    scale, body_in = axes.get_xlim()[1] / width_in, axes.get_ylim()[0]
    line: dict[str, Any] = {"color": style.BLACK, "linewidth": 0.5}
    for row in range(n_rows):
        chosen = marks[row::n_rows]
        wanted_in = [mark.time_s / scale for mark in chosen]
        places_in = spread(wanted_in, 2 * FLAG_HALF_IN + 0.02, FLAG_HALF_IN, width_in - FLAG_HALF_IN)
        up_in = -(0.06 + FLAG_IN * (row + 0.5))
        for mark, place_in in zip(chosen, places_in, strict=True):
            x_s = place_in * scale
            axes.plot([mark.time_s, mark.time_s], [0, body_in], linestyle=(0, (3, 2)), zorder=3, **line)
            axes.plot([mark.time_s, x_s], [0, up_in], clip_on=False, **line)
            axes.text(
                x_s, up_in, str(mark.number), fontsize=style.TINY_PT, ha="center", va="center_baseline",
                zorder=5, bbox=FLAG,
            )  # fmt: skip


def _key(page: Page, entries: Sequence[str], n_columns: int, key_in: float) -> None:
    per_column = -(-len(entries) // n_columns)
    widest_in = max((style.width_in(entry, style.SMALL_PT) for entry in entries), default=0.0)
    left_in = (page.width_in - n_columns * widest_in - (n_columns - 1) * 0.2) / 2
    for number, entry in enumerate(entries):
        column, row = divmod(number, per_column)
        x_in = left_in + column * (widest_in + 0.2)
        page.text(x_in, page.height_in - key_in + LINE_IN * (row + 0.5), entry, fontsize=style.SMALL_PT)
