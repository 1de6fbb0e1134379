"""Shades of grey for values by row and column, darker for greater ones, and matrices by sender and receiver."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import permutations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap

from visualisation import style
from visualisation.run_records import Floats

SHADES = LinearSegmentedColormap.from_list("shades", ["#FFFFFF", "#000000"])
NAME_ROOM_IN = 0.9
LEAST_NAME_IN = 0.095  # minimum row height at which each row has its name


def draw_shades(
    axes: Axes, values: Floats, top: float, extent: tuple[float, float, float, float] | None = None
) -> None:
    """Draw rows of values from 0 (white) to ``top`` (black); ``extent`` is left, right, bottom, top in data."""
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


def matrix(
    axes: Axes,
    names: Sequence[str],
    values: Floats,
    top: float,
    number: Callable[[float], str],
    side_in: float,
    most_numbers: int,
) -> None:
    """Draw a square of shades, senders down and receivers across, with a ``number`` for each value of few nodes.

    ``values`` are by receiver (row) and sender (column), NaN is crossed, ``top`` black; ``side_in`` is approximate.
    """
    axes.set_xlabel("receiver", fontsize=style.SMALL_PT)
    axes.set_ylabel("sender", fontsize=style.SMALL_PT)
    n = max(1, len(names))
    if names:
        draw_shades(axes, values.T, top)
    name_rows(axes, names, side_in / n)
    places, labels = _ticks(names, side_in / n)
    is_upright = any(style.width_in(label, style.TINY_PT) > side_in / n - 0.05 for label in labels)
    axes.set_xticks(places, labels, rotation=90 if is_upright else 0)
    axes.tick_params(axis="x", length=0, labelsize=style.TINY_PT, pad=2)
    for i in range(len(names)):
        # No node receives its own packets.
        axes.plot([i - 0.5, i + 0.5], [i + 0.5, i - 0.5], color=style.GREY, linewidth=0.4)
    for receiver, sender in permutations(range(len(names)), 2):
        value = values[receiver, sender]
        if np.isnan(value):
            axes.plot([receiver], [sender], marker="x", color=style.GREY, markersize=2.5)
        elif n <= most_numbers:
            colour = "white" if value > 0.5 * top else style.BLACK
            axes.text(
                receiver, sender, number(value), ha="center", va="center", fontsize=style.SMALL_PT, color=colour
            )  # fmt: skip
