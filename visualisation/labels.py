"""Placement of labels without overlaps with each other or with marks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from visualisation import style

CLEAR_PT = 5.0
LEAST_LETTERS = 4
PAPER = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.75}


class Label(NamedTuple):
    """Text at a point, in data coordinates; ``inside`` is its width limit, 0 if beside the point."""

    text: str
    x: float
    y: float
    inside: float = 0.0


def place(axes: Axes, labels: Sequence[Label], keep_clear: Sequence[tuple[float, float]]) -> None:
    """Place all labels that fit, shortened if necessary; omit the others.

    Args:
        axes: with final limits and position.
        labels: most important first.
        keep_clear: data points that no label may cover.
    """
    pixel_pt = axes.figure.dpi / 72.0
    frame = axes.get_window_extent()
    taken = [_around(axes.transData.transform(point), 3.0 * pixel_pt) for point in keep_clear]
    for label in labels:
        at_x, at_y = axes.transData.transform((label.x, label.y))
        room_in = frame.width / 72.0 / pixel_pt * 0.6
        if label.inside:
            edge = axes.transData.transform((label.x + label.inside, label.y))[0]
            room_in = min(room_in, (edge - at_x) / 72.0 / pixel_pt * 0.95)
        text = style.fitted(label.text, room_in, style.TINY_PT)
        if len(text) < min(LEAST_LETTERS, len(label.text)):
            continue
        width = style.width_in(text, style.TINY_PT) * 72.0 * pixel_pt + 2.0 * pixel_pt
        height = style.TINY_PT * 1.5 * pixel_pt
        for centre_x, centre_y in _candidates(label, (at_x, at_y), (width, height), CLEAR_PT * pixel_pt):
            box = Bbox.from_bounds(centre_x - width / 2, centre_y - height / 2, width, height)
            if _within(box, frame) and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                x, y = axes.transData.inverted().transform((centre_x, centre_y))
                axes.text(x, y, text, fontsize=style.TINY_PT, ha="center", va="center", zorder=6, bbox=PAPER)
                break


def _candidates(
    label: Label, at: tuple[float, float], size: tuple[float, float], clear: float
) -> list[tuple[float, float]]:
    (x, y), (width, height) = at, size
    aside, over = width / 2 + clear, height / 2 + clear
    around = [(x + side * aside, y + up * over) for up in (0, 1, -1) for side in (1, -1)]
    around += [(x, y + over), (x, y - over), (x, y + 2.5 * over), (x, y - 2.5 * over)]
    return [(x, y + step * height) for step in (0, 1, -1, 2, -2)] if label.inside else around


def _around(point: NDArray[np.float64], reach: float) -> Bbox:
    x, y = point
    return Bbox.from_extents(x - reach, y - reach, x + reach, y + reach)


def _within(box: Bbox, frame: Bbox) -> bool:
    return bool(box.x0 >= frame.x0 and box.x1 <= frame.x1 and box.y0 >= frame.y0 and box.y1 <= frame.y1)
