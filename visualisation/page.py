"""Page of a figure: Matplotlib fits panels into a page; this fits the page to its panels, then freezes the layout.

Papers show figures in true size, so legibility is a matter of inches, whatever the size of the fleet.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from visualisation import style

Edge = Literal["outside lower center", "outside upper center"]
LETTERS = "abcdefghijklmnopqrstuvwxyz"
BODY_GUESS_IN = 4.0  # initial height of everything outside panel bodies
LABEL_ROOM_IN = 2.5  # maximum width of a legend entry
PASSES, EXACT_IN = 4, 0.002  # maximum number of layout passes, and their tolerance
OVER_IN = 0.1  # allowed excess of a vertical label over its axis
UNIT = re.compile(r" \([^()]*\)$")


def opened(width_in: float, body_in: float) -> Figure:
    """Return an empty off-screen figure with an estimated body height, for ``style.paper()``."""
    figure = Figure(figsize=(width_in, body_in + BODY_GUESS_IN), dpi=style.DPI, layout="constrained")
    # Without pyplot, which keeps its figures open and may need a display.
    FigureCanvasAgg(figure)
    return figure


def panels(figure: Figure, n: int, columns: int, titles: Sequence[str] = (), framed: bool = False) -> list[Axes]:
    """Add panels in rows, with or without top and right frame; titles get letters."""
    grid = list(figure.subplots(-(-n // columns), columns, squeeze=False).flat)
    for number, axes in enumerate(grid):
        axes.spines[["top", "right"]].set_visible(framed)
        axes.tick_params(labelsize=style.SMALL_PT)  # else the user's settings apply when drawn
        if number >= n:
            axes.remove()
        elif titles:
            axes.set_title(f"({LETTERS[number]}) {titles[number]}".rstrip())
    return grid[:n]


def legend(
    figure: Figure | Axes,
    entries: Sequence[Artist],
    edge: Edge = "outside lower center",
    room_in: float = LABEL_ROOM_IN,
    **look: Any,
) -> None:
    """Add a legend outside the panels in as many columns as fit, labels up to ``room_in``; none without entries.

    In a user's axes, Matplotlib chooses its place.
    """
    if not entries:
        return
    if isinstance(figure, Axes):
        figure.legend(handles=list(entries), frameon=True)  # over the data, if need be
        return
    width_in = figure.get_figwidth()
    for entry in entries:
        entry.set_label(style.wrapped(str(entry.get_label()), min(room_in, width_in - 0.7), style.SMALL_PT))
    columns = style.legend_columns([str(entry.get_label()) for entry in entries], width_in - 0.1)
    figure.legend(handles=list(entries), loc=edge, **{"ncols": columns, **look})


def lay_out(
    figure: Figure, column: Sequence[Axes], bodies_in: float | Sequence[float] | Callable[[], Sequence[float]]
) -> None:
    """Fit the page to its row heights, freeze the layout, and shorten long titles and labels.

    ``column`` has one panel per row of the completely drawn figure. ``bodies_in`` is the height of each row, their
    heights, or a function that returns them once panels have their widths.
    """
    engine, grid = figure.get_layout_engine(), column[0].get_gridspec()
    assert engine is not None
    assert grid is not None
    for line in (line for axes in figure.axes for line in axes.lines):
        line.set_in_layout(np.size(line.get_xdata()) > 0)  # Matplotlib places an empty line at the page corner
    # New heights move ticks and labels, which changes the space of the panels again.
    for _ in range(PASSES):
        engine.execute(figure)
        found_in = [panel_in(axes)[1] for axes in column]
        wanted_in = np.broadcast_to(bodies_in() if callable(bodies_in) else bodies_in, len(column)).tolist()
        if max(abs(wanted - got) for wanted, got in zip(wanted_in, found_in, strict=True)) < EXACT_IN:
            break
        grid.set_height_ratios(wanted_in)
        figure.set_figheight(figure.get_figheight() + sum(wanted_in) - sum(found_in))
    # Frozen, since saving would lay out again, with other sizes for another format.
    figure.set_layout_engine("none")
    for axes in figure.axes:
        wide_in, high_in = panel_in(axes)
        axes.set_title(_cut(axes.get_title(loc="left"), wide_in, style.TEXT_PT), loc="left")
        for label, room_in in ((axes.xaxis.label, wide_in), (axes.yaxis.label, high_in + OVER_IN)):
            label.set_text(_cut(label.get_text(), room_in, float(label.get_fontsize())))


def figure_of(axes: Axes) -> Figure:
    """Return the whole figure of axes, which a user's may share with others."""
    figure = axes.figure.figure
    assert isinstance(figure, Figure)
    return figure


def panel_in(axes: Axes) -> tuple[float, float]:
    """Return width and height of the space of a panel in inches."""
    room = axes.get_position(original=True)
    width_in, height_in = figure_of(axes).get_size_inches()
    return float(room.width * width_in), float(room.height * height_in)


def _cut(text: str, room_in: float, size_pt: float) -> str:
    # Only the name is shortened: without its unit a number means nothing.
    unit = match[0] if (match := UNIT.search(text)) else ""
    named, room_in = text.removesuffix(unit), room_in - style.width_in(unit, size_pt)
    is_long = "\n" not in text and style.width_in(named, size_pt) > room_in
    return style.fitted(named, room_in, size_pt) + unit if is_long else text


LEAST_LETTERS = 4
PAPER = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}
BESIDE = (
    (5, 0, "left"), (-5, 0, "right"), (5, 7, "left"), (-5, 7, "right"), (5, -7, "left"), (-5, -7, "right"),
    (0, 10, "center"), (0, -10, "center"), (0, 20, "center"), (0, -20, "center"),
)  # fmt: skip
INSIDE = ((0, 0, "center"), (0, 9, "center"), (0, -9, "center"), (0, 18, "center"), (0, -18, "center"))
"""Offsets of a label (pt) with its alignment, best first: beside a point, and in an outline."""


class Label(NamedTuple):
    """Text at a point, in data coordinates; ``inside`` is its width limit, 0 if beside the point.

    ``ends`` are further points beside which it may stand.
    """

    text: str
    x: float
    y: float
    inside: float = 0.0
    ends: Sequence[tuple[float, float]] = ()


def place_labels(axes: Axes, labels: Sequence[Label], keep_clear: Sequence[tuple[float, float]]) -> None:
    """Place labels that fit, most important first, shortened if necessary, clear of texts and of ``keep_clear``."""
    inch_px, frame = axes.figure.dpi, axes.get_window_extent()
    taken = [Bbox([point, point]).padded(inch_px / 24) for point in map(axes.transData.transform, keep_clear)]
    taken += [text.get_window_extent() for text in axes.texts]
    for label in labels:
        room_in = 0.6 * frame.width / inch_px
        if label.inside:
            (left, _), (right, _) = axes.transData.transform([(0.0, 0.0), (label.inside, 0.0)])
            room_in = min(room_in, 0.95 * (right - left) / inch_px)
        text = style.fitted(label.text, room_in, style.TINY_PT)
        if len(text) < min(LEAST_LETTERS, len(label.text)):
            continue
        offsets = INSIDE if label.inside else BESIDE
        spots = [(label[1:3], offset) for offset in offsets]
        # A name far from the middle of a line is further from it than one at an end.
        spots[1:1] = [(end, offset) for end in label.ends for offset in BESIDE]
        for point, (x_pt, y_pt, side) in spots:
            drawn = axes.annotate(
                text, point, (x_pt, y_pt), textcoords="offset points", ha=side, va="center",
                fontsize=style.TINY_PT, zorder=6, bbox=PAPER,
            )  # fmt: skip
            box = drawn.get_window_extent().padded(inch_px / 72)
            if frame.contains(*box.min) and frame.contains(*box.max) and not box.count_overlaps(taken):
                taken.append(box)
                break
            drawn.remove()


class DrawnPage(NamedTuple):
    """Drawn figure, its caption, and notes on omitted content."""

    figure: Figure
    caption: str
    notes: tuple[str, ...] = ()

    def shown(self) -> CaptionedFigure:
        """Return the figure for display in notebooks, with its caption as ``.caption``."""
        figure = self.figure
        if type(figure) is Figure:  # a user's own kind stays
            # In place, since a copy would lose the links between the artists and their figure.
            figure.__class__ = CaptionedFigure
        shown = cast(CaptionedFigure, figure)
        shown.caption = self.caption
        return shown


class CaptionedFigure(Figure):
    """Matplotlib figure with a caption (content with units, n and seeds), displayed by notebooks."""

    caption: str

    def _repr_png_(self) -> bytes:  # called by IPython
        return style.rendered(self, "png")
