"""Page of a figure: constrained layout by Matplotlib, with its height fitted to the panels.

Papers show figures in true size, so legibility is a matter of inches: a row of text needs 0.15 in for two vehicles or
sixteen. Matplotlib fits panels into a page; this fits the page to its panels and then freezes the layout.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from visualisation import style

Edge = Literal["outside lower center", "outside upper center"]
LETTERS = "abcdefghijklmnopqrstuvwxyz"
BODY_GUESS_IN = 4.0
"""Initial height of everything outside panel bodies."""
LABEL_ROOM_IN = 2.5
"""Maximum width of a legend entry."""
PASSES, EXACT_IN = 4, 0.002
"""Maximum number of layout passes, and their tolerance."""
OVER_IN = 0.1
"""Allowed excess of a vertical label over its axis."""
UNIT = re.compile(r" \([^()]*\)$")


def opened(width_in: float, body_in: float) -> Figure:
    """Return an empty off-screen figure with an estimated body height, for ``style.paper()``."""
    figure = Figure(figsize=(width_in, body_in + BODY_GUESS_IN), dpi=style.DPI, layout="constrained")
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
    figure: Figure,
    entries: Sequence[Artist],
    edge: Edge = "outside lower center",
    room_in: float = LABEL_ROOM_IN,
    **look: Any,
) -> None:
    """Add a legend outside the panels, with as many columns as fit; no effect without entries.

    ``room_in`` is the maximum width of a label; ``look`` passes to Matplotlib.
    """
    if not entries:
        return
    width_in = figure.get_figwidth()
    for entry in entries:
        entry.set_label(style.fitted(str(entry.get_label()), min(room_in, width_in - 0.7), style.SMALL_PT))
    columns = style.legend_columns([str(entry.get_label()) for entry in entries], width_in - 0.1)
    figure.legend(handles=list(entries), loc=edge, **{"ncols": columns, **look})


def lay_out(figure: Figure, column: Sequence[Axes], bodies_in: Sequence[float] | Callable[[], Sequence[float]]) -> None:
    """Fit the page to its row heights, freeze the layout, and shorten long titles and labels.

    Args:
        figure: completely drawn.
        column: one panel per row.
        bodies_in: row heights, or a function that returns them once panels have their widths.
    """
    engine, grid = figure.get_layout_engine(), column[0].get_gridspec()
    assert engine is not None
    assert grid is not None
    for line in (line for axes in figure.axes for line in axes.lines):
        line.set_in_layout(np.size(line.get_xdata()) > 0)  # Matplotlib places an empty line at the page corner
    for _ in range(PASSES):
        engine.execute(figure)
        found_in = [panel_in(axes)[1] for axes in column]
        wanted_in = bodies_in() if callable(bodies_in) else bodies_in
        if max(abs(wanted - found) for wanted, found in zip(wanted_in, found_in, strict=True)) < EXACT_IN:
            break
        grid.set_height_ratios(wanted_in)
        figure.set_figheight(figure.get_figheight() + sum(wanted_in) - sum(found_in))
    figure.set_layout_engine("none")
    for axes in figure.axes:
        wide_in, high_in = panel_in(axes)
        axes.set_title(_cut(axes.get_title(loc="left"), wide_in, style.TEXT_PT), loc="left")
        for label, room_in in ((axes.xaxis.label, wide_in), (axes.yaxis.label, high_in + OVER_IN)):
            label.set_text(_cut(label.get_text(), room_in, float(label.get_fontsize())))


def panel_in(axes: Axes) -> tuple[float, float]:
    """Return width and height of the space of a panel in inches."""
    figure, room = axes.figure, axes.get_position(original=True)
    assert isinstance(figure, Figure)
    width_in, height_in = figure.get_size_inches()
    return float(room.width * width_in), float(room.height * height_in)


def _cut(text: str, room_in: float, size_pt: float) -> str:
    unit = found[0] if (found := UNIT.search(text)) else ""
    named, room_in = text.removesuffix(unit), room_in - style.width_in(unit, size_pt)
    is_long = "\n" not in text and style.width_in(named, size_pt) > room_in
    return style.fitted(named, room_in, size_pt) + unit if is_long else text


class DrawnPage(NamedTuple):
    """Drawn figure, its caption, and notes on omitted content."""

    figure: Figure
    caption: str
    notes: tuple[str, ...] = ()

    def shown(self) -> CaptionedFigure:
        """Return the figure for display in notebooks, with its caption as ``.caption``."""
        figure = self.figure
        figure.__class__ = CaptionedFigure
        assert isinstance(figure, CaptionedFigure)
        figure.caption = self.caption
        return figure


class CaptionedFigure(Figure):
    """Matplotlib figure with a caption, displayed by notebooks.

    Attributes:
        caption: content with units, n and seeds.
    """

    caption: str

    def _repr_png_(self) -> bytes:  # called by IPython
        return style.rendered(self, "png")
