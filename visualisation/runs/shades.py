"""Shades of grey for shares and ages, darker is worse, with names beside the rows and a key below.

Colours stand for vehicles in the figures of a run, so what is a number has none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap

from visualisation import style, words
from visualisation.outages import Outage, outages_until
from visualisation.page import Box, Page
from visualisation.runs.reading import Floats

SHADES = LinearSegmentedColormap.from_list("shades", ["#FFFFFF", "#000000"])
NAME_ROOM_IN = 0.9
LEAST_NAME_IN = 0.095
"""Height of a row below which not each has its name."""
KEY_IN, KEY_BAR_IN = 0.36, 0.07
MOST_NUMBERS = 8
"""Fleets up to this size have numbers in matrices."""


class Timespan(NamedTuple):
    """The time of a run: its end, that of its axis, and when vehicles are out of the mission, by name."""

    end_s: float
    axis_end_s: float
    out: Mapping[str, Sequence[Outage]]


def names_in(names: Sequence[str]) -> float:
    """Width of the longest name, cut where it has no room."""
    cut = (style.fitted(name, NAME_ROOM_IN, style.TINY_PT) for name in names)
    return max((style.width_in(text, style.TINY_PT) for text in cut), default=0.0)


def draw_shades(
    axes: Axes, values: Floats, top: float, extent: tuple[float, float, float, float] | None = None
) -> None:
    """Rows of values from 0 (white) to ``top`` (black); what is not a number stays white.

    Args:
        axes: where.
        values: a row for each lane.
        top: value of black.
        extent: left, right, bottom and top in data; numbers of columns and rows if left out.
    """
    axes.imshow(
        np.ma.masked_invalid(values), cmap=SHADES, vmin=0.0, vmax=top, aspect="auto", interpolation="nearest",
        extent=extent,
    )  # fmt: skip


def hatched(axes: Axes, row: int, spans: Sequence[tuple[float, float]]) -> None:
    """Spans of a row of which nothing can be said."""
    for start, end in spans:
        axes.barh(row, end - start, 1.0, start, facecolor="none", edgecolor=style.GREY, hatch="////", linewidth=0)


def name_rows(axes: Axes, names: Sequence[str], row_in: float) -> None:
    """Names beside the rows, as many as have room."""
    axes.set_yticks(*_ticks(names, row_in))
    axes.tick_params(axis="y", length=0, labelsize=style.TINY_PT, pad=2)


def part_rows(axes: Axes, n: int, row_in: float) -> None:
    """White lines between the rows."""
    for at in range(1, n):
        axes.axhline(at - 0.5, color="white", linewidth=min(1.0, 6.0 * row_in))


def name_columns(axes: Axes, names: Sequence[str], column_in: float) -> None:
    """Names below the columns, upright, as many as have room."""
    axes.set_xticks(*_ticks(names, column_in), rotation=90)
    axes.tick_params(axis="x", length=0, labelsize=style.TINY_PT, pad=2)


def _ticks(names: Sequence[str], room_in: float) -> tuple[list[int], list[str]]:
    step = max(1, int(np.ceil(LEAST_NAME_IN / room_in)))
    numbers = list(range(0, len(names), step))
    return numbers, [style.fitted(names[number], NAME_ROOM_IN, style.TINY_PT) for number in numbers]


def matrix(axes: Axes, names: Sequence[str], values: Floats, top: float, side_in: float, percent: bool) -> None:
    """A square of shades, receivers down and senders across, with numbers where the fleet is small.

    Args:
        axes: where.
        names: of the vehicles.
        values: a row for each receiver, a column for each sender; crossed where it is not a number.
        top: value of black.
        side_in: of the square.
        percent: whether numbers are shares.
    """
    n = max(1, len(names))
    if names:
        draw_shades(axes, values, top)
    name_rows(axes, names, side_in / n)
    name_columns(axes, names, side_in / n)
    for at in range(len(names)):
        axes.plot([at - 0.5, at + 0.5], [at + 0.5, at - 0.5], color=style.GREY, linewidth=0.4)
    for receiver in range(len(names)):
        for sender in range(len(names)):
            value = values[receiver, sender]
            if np.isnan(value):
                if receiver != sender:
                    axes.plot([sender], [receiver], marker="x", color=style.GREY, markersize=2.5)
            elif n <= MOST_NUMBERS:
                text = f"{100 * value:.0f}" if percent else f"{value:.0f}"
                colour = "white" if value > 0.5 * top else style.BLACK
                axes.text(sender, receiver, text, ha="center", va="center", fontsize=style.SMALL_PT, color=colour)
    axes.set_xlim(-0.5, n - 0.5)
    axes.set_ylim(n - 0.5, -0.5)


def strip(page: Page, box: Box, title: str, names: Sequence[str], values: Floats, top: float, span: Timespan) -> Axes:
    """A row of shades over mission time for each vehicle, from 0 to ``top``, hatched where it is out of the mission."""
    n = max(1, len(names))
    axes = page.panel(box, style.fitted(title, box.width_in, style.TEXT_PT))
    if values.size:
        draw_shades(axes, values, top, (0.0, span.end_s, n - 0.5, -0.5))
    axes.set_xlim(0.0, span.axis_end_s)
    name_rows(axes, names, box.height_in / n)
    part_rows(axes, n, box.height_in / n)
    for row, name in enumerate(names):
        hatched(axes, row, outages_until(span.out.get(name, ()), span.end_s))
    axes.set_xlabel(words.axis("time", "s"), labelpad=1)
    return axes


def matrix_panel(
    page: Page, box: Box, title: str, names: Sequence[str], values: Floats, top: float, percent: bool, beside_in: float
) -> float:
    """A ``matrix`` in a square, with what its rows and columns are; returns where the room below it begins."""
    side_in = box.width_in
    axes = page.panel(box, style.fitted(title, side_in, style.TEXT_PT))
    matrix(axes, names, values, top, side_in, percent)
    page.text(box.left_in - beside_in + 0.1, box.top_in + side_in / 2, "receiver", rotation="vertical", ha="center",
              va="center", fontsize=style.SMALL_PT)  # fmt: skip
    below_in = box.top_in + side_in + names_in(names) + 0.06
    page.text(box.left_in + side_in / 2, below_in + 0.1, "sender", ha="center", fontsize=style.SMALL_PT)
    return below_in


def key_below(page: Page, box: Box, top: float, label: str, percent: bool = False) -> None:
    """What the shades mean, in the middle below a strip that begins and ends where the box does."""
    width_in = min(1.6, box.width_in)
    key(page, Box(box.left_in + (box.width_in - width_in) / 2, box.top_in, width_in, 0.0), top, label, percent)


def key(page: Page, box: Box, top: float, label: str, percent: bool = False) -> None:
    """What the shades mean: a bar from 0 to ``top`` with its label below."""
    axes = page.panel(Box(box.left_in, box.top_in, box.width_in, KEY_BAR_IN))
    axes.imshow(np.linspace(0.0, 1.0, 64)[None, :], cmap=SHADES, aspect="auto", extent=(0.0, top, 0.0, 1.0))
    axes.set_yticks([])
    ends = [0.0, top / 2, top]
    axes.set_xticks(ends, [f"{100 * end:.0f} %" if percent else f"{end:.0f}" for end in ends])
    axes.tick_params(axis="x", length=1.5, labelsize=style.TINY_PT, pad=1)
    axes.get_xticklabels()[0].set_horizontalalignment("left")
    axes.get_xticklabels()[-1].set_horizontalalignment("right")
    axes.set_xlabel(style.fitted(label, box.width_in, style.TINY_PT), fontsize=style.TINY_PT, labelpad=1)
