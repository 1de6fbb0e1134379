"""A page: a figure that is laid out in inches, x from its left edge and y down from its top edge.

Figures stand in papers in their true size, so what is legible is a matter of inches: a row of text needs 0.15 in
whether the page shows two vehicles or sixteen. Matplotlib counts in shares of the figure from its bottom left corner;
nobody but this module does.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from visualisation import style

LEGEND_UP_IN = 0.03
"""Distance of a legend from the lower edge."""
LETTERS = "abcdefghijklmnopqrstuvwxyz"


class Box(NamedTuple):
    """A rectangle on a page: its upper left corner, its width and its height."""

    left_in: float
    top_in: float
    width_in: float
    height_in: float


@dataclass(frozen=True)
class PanelGrid:
    """Panels of one size in rows.

    Args:
        n: number of panels.
        columns: panels in a row.
        width_in: width of the page.
        left_in: room left of the first panel of a row, for ticks and label of its y axis.
        right_in: room right of the last one.
        top_in: room above the first row, for titles.
        body_in: height of a panel.
        gap_in: room between panels of a row.
        row_gap_in: room between a row and the titles of the next.
    """

    n: int
    columns: int
    width_in: float
    left_in: float
    right_in: float
    top_in: float
    body_in: float
    gap_in: float = 0.0
    row_gap_in: float = 0.0

    @property
    def panel_in(self) -> float:
        """Width of a panel."""
        gaps_in = (self.columns - 1) * self.gap_in
        return (self.width_in - self.left_in - self.right_in - gaps_in) / self.columns

    @property
    def height_in(self) -> float:
        """Height from the upper edge of the page to the lower edge of the last row."""
        n_rows = -(-self.n // self.columns)
        return n_rows * (self.top_in + self.body_in) + (n_rows - 1) * self.row_gap_in

    @property
    def boxes(self) -> list[Box]:
        """Where the panels are, row by row.

        >>> PanelGrid(3, 2, 7.0, 0.5, 0.1, 0.2, 2.0, gap_in=0.4, row_gap_in=0.3).boxes[2]
        Box(left_in=0.5, top_in=2.7, width_in=3.0, height_in=2.0)
        """
        row_in = self.top_in + self.body_in + self.row_gap_in
        places = (divmod(number, self.columns) for number in range(self.n))
        return [
            Box(
                self.left_in + column * (self.panel_in + self.gap_in),
                row * row_in + self.top_in,
                self.panel_in,
                self.body_in,
            )
            for row, column in places
        ]


@dataclass(frozen=True)
class Legend:
    """Entries of a legend in as many columns as have room.

    Args:
        entries: artists with the labels that are shown.
        room_in: width that the legend may have.
        most: most columns.
    """

    entries: tuple[Artist, ...]
    room_in: float
    most: int = 99

    @property
    def columns(self) -> int:
        """Number of columns."""
        return min(self.most, style.legend_columns([str(entry.get_label()) for entry in self.entries], self.room_in))

    @property
    def height_in(self) -> float:
        """Height; 0 without entries."""
        return style.legend_height_in(len(self.entries), self.columns) if self.entries else 0.0


class Overhang(NamedTuple):
    """How far ticks, labels and title of a panel stand out of it on each side (in)."""

    left_in: float
    top_in: float
    right_in: float
    bottom_in: float


class Page:
    """A figure of that size in inches, off screen; draw on it under ``style.paper()``.

    >>> page = Page(3.5, 2.0)
    >>> axes = page.panel(Box(0.5, 0.25, 2.5, 1.5), "(a) left")
    >>> [round(float(edge), 3) for edge in axes.get_position().extents]
    [0.143, 0.125, 0.857, 0.875]
    """

    def __init__(self, width_in: float, height_in: float) -> None:
        self.figure = Figure(figsize=(width_in, height_in), dpi=style.DPI)
        FigureCanvasAgg(self.figure)

    @property
    def width_in(self) -> float:
        """Width of the page."""
        return float(self.figure.get_figwidth())

    @property
    def height_in(self) -> float:
        """Height of the page."""
        return float(self.figure.get_figheight())

    def panel(self, box: Box, title: str = "") -> Axes:
        """Empty axes in that place, with a title above their left edge."""
        axes = self.figure.add_axes(self._shares(box))
        if title:
            axes.set_title(title, loc="left", pad=3)
        return axes

    def open_panels(self, grid: PanelGrid, titles: Sequence[str] = ()) -> list[Axes]:
        """The panels of a grid, without frame above and on the right; titles get letters and are cut to their panel."""
        panels = []
        for number, box in enumerate(grid.boxes):
            words = f"({LETTERS[number]}) {titles[number]}".rstrip() if titles else ""
            axes = self.panel(box, style.fitted(words, box.width_in, style.TEXT_PT))
            axes.spines[["top", "right"]].set_visible(False)
            panels.append(axes)
        return panels

    def text(self, x_in: float, down_in: float, text: str, **look: Any) -> None:
        """Text at a place of the page, by default with its middle at that height."""
        if not {"va", "verticalalignment"} & look.keys():
            look["va"] = "center_baseline"
        self.figure.text(x_in / self.width_in, 1.0 - down_in / self.height_in, text, **look)

    def legend(self, legend: Legend, up_in: float = LEGEND_UP_IN, **look: Any) -> None:
        """A legend in the middle of the page, its lower edge ``up_in`` above that of the page; none without entries."""
        if legend.entries:
            place = 0.5, up_in / self.height_in
            self.figure.legend(
                handles=list(legend.entries), loc="lower center", bbox_to_anchor=place, ncols=legend.columns, **look
            )

    def overhang(self, axes: Axes) -> Overhang:
        """How much room a panel needs around it, as it is drawn now."""
        outer, inner = axes.get_tightbbox(), axes.get_window_extent()
        if outer is None:
            return Overhang(0.0, 0.0, 0.0, 0.0)
        sides = inner.x0 - outer.x0, outer.y1 - inner.y1, outer.x1 - inner.x1, inner.y0 - outer.y0
        return Overhang(*(max(0.0, side) / self.figure.dpi for side in sides))

    def extend(self, by_in: float) -> None:
        """Make the page longer at its lower edge; panels keep their place and size in inches."""
        boxes = [self._box(axes) for axes in self.figure.axes]
        self.figure.set_figheight(self.height_in + by_in)
        for axes, box in zip(self.figure.axes, boxes, strict=True):
            axes.set_position(self._shares(box))

    def refit(self, height_in: float, axes: Axes, box: Box) -> None:
        """Give the page another height, and a panel another place."""
        self.figure.set_figheight(height_in)
        axes.set_position(self._shares(box))

    def _box(self, axes: Axes) -> Box:
        place = axes.get_position()
        width_in, height_in = self.width_in, self.height_in
        return Box(place.x0 * width_in, (1.0 - place.y1) * height_in, place.width * width_in, place.height * height_in)

    def _shares(self, box: Box) -> tuple[float, float, float, float]:
        left, width = box.left_in / self.width_in, box.width_in / self.width_in
        return left, 1.0 - (box.top_in + box.height_in) / self.height_in, width, box.height_in / self.height_in


BODY_GUESS_IN = 4.0
"""Room for all that is no body of a panel, before the layout says how much that takes."""
LABEL_ROOM_IN = 2.5
"""Widest entry of a legend."""
PASSES, EXACT_IN = 4, 0.002
"""Layouts until panels have their heights, and how near they come."""
OVER_IN = 0.1
"""How much longer than its axis a vertical label may be."""
UNIT = re.compile(r" \([^()]*\)$")


def opened(width_in: float, body_in: float) -> Figure:
    """An empty figure off screen; draw on it under ``style.paper()``.

    Args:
        width_in: of the page.
        body_in: height of all rows of panels together, as far as it is known.
    """
    figure = Figure(figsize=(width_in, body_in + BODY_GUESS_IN), dpi=style.DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def panels(figure: Figure, n: int, columns: int, titles: Sequence[str] = (), framed: bool = False) -> list[Axes]:
    """Panels in rows, framed or without frame above and on the right; titles get letters."""
    grid = list(figure.subplots(-(-n // columns), columns, squeeze=False).flat)
    for number, axes in enumerate(grid):
        axes.spines[["top", "right"]].set_visible(framed)
        axes.tick_params(labelsize=style.SMALL_PT)  # else their number follows the user's settings when it is drawn
        if number >= n:
            axes.remove()
        elif titles:
            axes.set_title(f"({LETTERS[number]}) {titles[number]}".rstrip())
    return grid[:n]


def legend(
    figure: Figure, entries: Sequence[Artist], edge: str = "lower", room_in: float = LABEL_ROOM_IN, **look: Any
) -> None:
    """A legend outside of the panels, in as many columns as have room; none without entries.

    Args:
        figure: on which it stands.
        entries: artists with the labels that are shown.
        edge: of the page.
        room_in: widest label.
        look: more for Matplotlib.
    """
    if not entries:
        return
    width_in = figure.get_figwidth()
    for entry in entries:
        entry.set_label(style.fitted(str(entry.get_label()), min(room_in, width_in - 0.7), style.SMALL_PT))
    columns = style.legend_columns([str(entry.get_label()) for entry in entries], width_in - 0.1)
    figure.legend(handles=list(entries), loc=f"outside {edge} center", **{"ncols": columns, **look})


def lay_out(figure: Figure, column: Sequence[Axes], bodies_in: Sequence[float] | Callable[[], Sequence[float]]) -> None:
    """Give the page the height at which its rows of panels have theirs, and everything its place for good.

    Titles and labels of axes that are longer than their panel are cut, labels before their unit.

    Args:
        figure: with everything drawn that takes room.
        column: a panel of each row.
        bodies_in: their heights, or what says so once panels have their widths.
    """
    engine, grid = figure.get_layout_engine(), column[0].get_gridspec()
    assert engine is not None
    assert grid is not None
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
    """Width and height of the room of a panel in inches."""
    room, (width_in, height_in) = axes.get_position(original=True), axes.figure.get_size_inches()
    return float(room.width * width_in), float(room.height * height_in)


def _cut(text: str, room_in: float, size_pt: float) -> str:
    unit = found[0] if (found := UNIT.search(text)) else ""
    named, room_in = text.removesuffix(unit), room_in - style.width_in(unit, size_pt)
    is_long = "\n" not in text and style.width_in(named, size_pt) > room_in
    return style.fitted(named, room_in, size_pt) + unit if is_long else text


class DrawnPage(NamedTuple):
    """A drawn page: its figure, its caption, and notes on what was left out of it."""

    figure: Figure
    caption: str
    notes: tuple[str, ...] = ()

    def shown(self) -> CaptionedFigure:
        """The figure as notebooks show it by themselves, with its caption as ``.caption``."""
        figure = self.figure
        figure.__class__ = CaptionedFigure
        assert isinstance(figure, CaptionedFigure)
        figure.caption = self.caption
        return figure


class CaptionedFigure(Figure):
    """A Matplotlib figure that has a caption, and that notebooks show by themselves.

    Attributes:
        caption: what it shows, with units, n and seeds.
    """

    caption: str

    def _repr_png_(self) -> bytes:  # what IPython asks for
        return style.rendered(self, "png")
