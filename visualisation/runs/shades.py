"""Shades of grey for shares and ages, darker is worse, with row names and a key.

Colours denote vehicles in run figures; numbers are therefore grey.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from visualisation import style, words
from visualisation.page import panel_in
from visualisation.run_records import Floats, Span, outages_until

SHADES = LinearSegmentedColormap.from_list("shades", ["#FFFFFF", "#000000"])
NAME_ROOM_IN = 0.9
LEAST_NAME_IN = 0.095
"""Minimum row height at which each row has its name."""
KEY_IN, KEY_BAR_IN = 2.0, 0.07
"""Length and height of a key."""
MOST_NUMBERS = 8
"""Maximum fleet size for numbers in matrices."""


class Timespan(NamedTuple):
    """Time of a run: its end, end of the axis, and spans out of the mission by vehicle."""

    end_s: float
    axis_end_s: float
    out: Mapping[str, Sequence[Span]]


def row_in(n: int, least_in: float, most_in: float, all_in: float) -> float:
    """Return the height of one of ``n`` rows with ``all_in`` as target for their sum."""
    return min(most_in, max(least_in, all_in / max(1, n)))


def draw_shades(
    axes: Axes, values: Floats, top: float, extent: tuple[float, float, float, float] | None = None
) -> None:
    """Draw rows of values from 0 (white) to ``top`` (black); NaN stays white.

    Args:
        extent: left, right, bottom and top in data; None for numbers of columns and rows.
    """
    axes.imshow(
        np.ma.masked_invalid(values), cmap=SHADES, vmin=0.0, vmax=top, aspect="auto", interpolation="nearest",
        extent=extent,
    )  # fmt: skip


def name_rows(axes: Axes, names: Sequence[str], row_in: float) -> None:
    """Label the rows, as many as fit."""
    axes.set_yticks(*_ticks(names, row_in))
    axes.tick_params(axis="y", length=0, labelsize=style.TINY_PT, pad=2)


def _ticks(names: Sequence[str], room_in: float) -> tuple[list[int], list[str]]:
    step = max(1, int(np.ceil(LEAST_NAME_IN / room_in)))
    numbers = list(range(0, len(names), step))
    return numbers, [style.fitted(names[number], NAME_ROOM_IN, style.TINY_PT) for number in numbers]


def matrix(axes: Axes, names: Sequence[str], values: Floats, top: float, percent: bool, side_in: float) -> None:
    """Draw a square of shades, receivers down and senders across, with numbers for small fleets.

    Args:
        values: by receiver (row) and sender (column); NaN is crossed.
        top: value of black.
        percent: whether values are shares.
        side_in: approximate side of the square.
    """
    axes.set_xlabel("sender", fontsize=style.SMALL_PT)
    axes.set_ylabel("receiver", fontsize=style.SMALL_PT)
    n = max(1, len(names))
    if names:
        draw_shades(axes, values, top)
    name_rows(axes, names, side_in / n)
    axes.set_xticks(*_ticks(names, side_in / n), rotation=90)
    axes.tick_params(axis="x", length=0, labelsize=style.TINY_PT, pad=2)
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


def strip(axes: Axes, names: Sequence[str], values: Floats, top: float, span: Timespan, row_in: float) -> None:
    """Draw a row of shades per vehicle over mission time, hatched while out of the mission."""
    n = max(1, len(names))
    if values.size:
        draw_shades(axes, values, top, (0.0, span.end_s, n - 0.5, -0.5))
    axes.set_xlim(0.0, span.axis_end_s)
    name_rows(axes, names, row_in)
    for at in range(1, n):
        axes.axhline(at - 0.5, color="white", linewidth=min(1.0, 6.0 * row_in))
    for row, name in enumerate(names):
        for start, end in outages_until(span.out.get(name, ()), span.end_s):
            axes.barh(row, end - start, 1.0, start, facecolor="none", edgecolor=style.GREY, hatch="////", linewidth=0)
    axes.set_xlabel(words.axis("time", "s"))


def key(figure: Figure, below: Axes, body_in: float, top: float, label: str, percent: bool = False) -> None:
    """Draw the scale of shades from 0 to ``top`` below a panel of height ``body_in``."""
    share = min(1.0, KEY_IN / panel_in(below)[0])
    bar = figure.colorbar(
        ScalarMappable(Normalize(0.0, top), SHADES), ax=below, location="bottom", shrink=share, pad=0.05 / body_in,
        fraction=KEY_BAR_IN / body_in, aspect=share * panel_in(below)[0] / KEY_BAR_IN,
    )  # fmt: skip
    ends = [0.0, top / 2, top]
    bar.set_ticks(ends, labels=[f"{100 * end:.0f} %" if percent else f"{end:.0f}" for end in ends])
    bar.ax.tick_params(length=1.5, labelsize=style.TINY_PT, pad=1)
    bar.set_label(label, fontsize=style.TINY_PT, labelpad=1)
