"""Pages over mission time: time axis, milestones as numbered flags with their key, bands of named rows.

The axis ends with the run. In the panel, y is in inches down from its top, so text stays legible for any fleet size.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Generic, NamedTuple, TypeVar

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from missions import words
from missions.figure import RunResults, run_end_s
from missions.spans import Span
from visualisation import page, run_records, style
from visualisation.run_records import MilestoneRow

TALLEST_IN = 9.0
AROUND_IN, LINE_IN = 1.1, 0.137  # approximate height of axis, flags and legend, and height of a line of the key
TITLE_IN, GAP_IN, INDENT_IN = 0.14, 0.06, 0.08
"""Height of the title of a band, gap between bands, indent of a name for each level."""
NAME_SHARE = 0.38  # maximum share of a page for names of rows
OF_ALIKE = 1 / 3  # of a shortened name, share of its beginning if another row would be named alike
FLAG = {"boxstyle": "square,pad=0.2", "facecolor": "white", "edgecolor": style.BLACK, "linewidth": 0.5}

Content = TypeVar("Content")


class NumberedMark(NamedTuple):
    """Milestones of one time, under one number."""

    number: int
    time_s: float
    label: str


class Row(NamedTuple, Generic[Content]):
    """Row of a band, with the level of indent and the weight of its name."""

    name: str
    high_in: float
    level: int
    content: Content
    weight: str = "normal"

    @property
    def name_in(self) -> float:
        """Width of the name with its indent."""
        return INDENT_IN * self.level + style.width_in(self.name, style.TINY_PT, self.weight)

    def fitted(self, names_in: float, share: float = 1.0) -> str:
        """Shorten the name to a column of names."""
        return style.fitted(self.name, names_in - INDENT_IN * self.level, style.TINY_PT, self.weight, share)


Band = Sequence[Row[Content]]


@dataclass(frozen=True)
class Sheet:
    """Page over mission time with one panel, ``body_in`` high."""

    figure: Figure
    axes: Axes
    body_in: float
    marks: Sequence[NumberedMark]
    end_s: float

    def inch_s(self) -> float:
        """Return the duration of an inch of the time axis, once the names beside it are drawn."""
        engine = self.figure.get_layout_engine()
        assert engine is not None
        engine.execute(self.figure)
        return float(self.axes.get_xlim()[1] / page.panel_in(self.axes)[0])

    def along(self, spans: Iterable[Span]) -> list[tuple[float, float]]:
        """Return start and duration of bars for these spans of the run."""
        return [(span.start_s, min(span.end_s, self.end_s) - span.start_s) for span in spans]

    def shade(self, top_in: float, high_in: float) -> None:
        """Draw a pale background over the duration of the run."""
        self.axes.broken_barh([(0.0, self.end_s)], (top_in, high_in), color=style.PALE, linewidth=0, zorder=0)

    def rows(self, bands: Sequence[Band[Content]]) -> Iterator[tuple[Row[Content], float]]:
        """Shade every second band, name its rows, and yield each row with its top."""
        most_in = NAME_SHARE * float(self.figure.get_figwidth())
        names_in = min(most_in, max((row.name_in for band in bands for row in band), default=0.0))
        for number, (band, (top_in, end_in)) in enumerate(zip(bands, pairwise(ends_in(bands)), strict=True)):
            if number % 2 == 0:
                self.shade(top_in, end_in - top_in)
            tops_in = accumulate((row.high_in for row in band), initial=top_in + GAP_IN / 2)
            cut = [row.fitted(names_in) for row in band]
            for row, name, at_in in zip(band, cut, tops_in, strict=False):
                left_in = INDENT_IN * row.level - names_in
                self.axes.annotate(
                    row.fitted(names_in, OF_ALIKE) if cut.count(name) > 1 else name, (0.0, at_in + row.high_in / 2),
                    (72.0 * left_in - 4.0, 0.0), self.axes.get_yaxis_transform(), "offset points",
                    annotation_clip=False, fontsize=style.TINY_PT, weight=row.weight, va="center_baseline",
                )  # fmt: skip
                yield row, at_in

    def finished(self) -> Figure:
        """Add time axis and flags, lay out the page and return it."""
        inch_s = self.inch_s()
        _time_axis(self.axes, self.end_s, inch_s)
        _flags(self.axes, self.marks, inch_s)
        page.lay_out(self.figure, [self.axes], self.body_in)
        return self.figure


def sheet(results: RunResults, body_in: float, legend: Sequence[Artist], width_in: float) -> Sheet:
    """Create a page: empty panel ``body_in`` high, legend on top, key of the flags below."""
    marks = grouped(run_records.milestones(results))
    figure = page.opened(width_in, body_in + LINE_IN * len(marks))
    (axes,) = page.panels(figure, 1, 1, framed=True)
    page.legend(figure, legend, "outside upper center")
    key = [Line2D([], [], linestyle="", label=f"{mark.number}  {mark.label}") for mark in marks]
    page.legend(figure, key, room_in=width_in, handlelength=0.0, handletextpad=0.0)
    axes.set(xlim=(0.0, run_end_s(results)), ylim=(body_in, 0.0), xlabel=words.axis("time", "s"), yticks=[])
    return Sheet(figure, axes, body_in, marks, run_end_s(results))


def room_in(results: RunResults, width_in: float) -> float:
    """Return the approximate maximum height of a body on a paper's page."""
    marks = grouped(run_records.milestones(results))
    columns = style.legend_columns([f"{mark.number}  {mark.label}" for mark in marks], width_in - 0.1)
    return TALLEST_IN - AROUND_IN - LINE_IN * -(-len(marks) // columns)


def ends_in(bands: Sequence[Band[Content]]) -> list[float]:
    """Return the top of the first band and the lower end of each band (in)."""
    return [0.0, *accumulate(GAP_IN + sum(row.high_in for row in band) for band in bands)]


def fitting(variants: Iterable[Sequence[Band[Content]]], most_in: float) -> list[Band[Content]]:
    """Return the first variant that fits a height; if none does, those bands of the last that do."""
    for bands in variants:
        if ends_in(bands)[-1] <= most_in:
            break
    return [band for band, end_in in zip(bands, ends_in(bands)[1:], strict=True) if end_in <= most_in]


def grouped(milestones: Sequence[MilestoneRow]) -> list[NumberedMark]:
    """Number milestones by time; those of one time share a number."""
    by_time: dict[float, list[str]] = defaultdict(list)
    for milestone in sorted(milestones, key=lambda milestone: milestone.time_s):
        by_time[milestone.time_s].append(milestone.label)
    return [
        NumberedMark(number, time_s, f"{'; '.join(labels)} ({words.time(time_s)})")
        for number, (time_s, labels) in enumerate(by_time.items(), start=1)
    ]


def _time_axis(axes: Axes, end_s: float, inch_s: float) -> None:
    # Half an inch has room for the label of a tick.
    ticks = MaxNLocator(max(1, int(end_s / inch_s / 0.5)), steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, end_s)
    shown = [tick for tick in ticks if tick <= end_s]
    axes.set_xticks(shown, [f"{tick:g}" if tick < 1e6 else f"{tick:.3g}" for tick in shown])
    axes.spines["top"].set_visible(False)


def _flags(axes: Axes, marks: Sequence[NumberedMark], inch_s: float) -> None:
    """Draw lines at milestones with flags above; milestones too close for separate flags share one."""
    shared: list[list[NumberedMark]] = []
    for mark in marks:
        axes.axvline(mark.time_s, color=style.BLACK, linewidth=0.5, linestyle=(0, (3, 2)), zorder=3)
        if shared:
            wide_s = (style.width_in(_numbers(shared[-1]), style.TINY_PT) + 0.06) * inch_s
        if shared and mark.time_s < shared[-1][0].time_s + wide_s:
            shared[-1].append(mark)
        else:
            shared.append([mark])
    for flag in shared:
        axes.annotate(
            _numbers(flag), (flag[0].time_s, 1.0), (0.0, 6.0), axes.get_xaxis_transform(), "offset points",
            fontsize=style.TINY_PT, bbox=FLAG, annotation_clip=False, zorder=5,
        )  # fmt: skip


def _numbers(flag: Sequence[NumberedMark]) -> str:
    return "\u2013".join(dict.fromkeys((str(flag[0].number), str(flag[-1].number))))
