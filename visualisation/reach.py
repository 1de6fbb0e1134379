"""How much of what is sent arrives, against range: a figure, and the numbers behind it as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from visualisation import style, words
from visualisation.errors import DrawingError
from visualisation.files import check_format
from visualisation.page import Box, Legend, Page

LEFT_IN, RIGHT_IN, TOP_IN, BODY_IN, AXIS_IN = 0.5, 0.12, 0.1, 2.3, 0.42
NAME = "delivery-against-range"
"""Name of the files, without suffix."""
BY_FRAME = (0, (3, 1.2))
NOMINAL = "nominal range"
MARKERS_ON_A_LINE = 12


class Point(NamedTuple):
    """One range: the link there, and the share of full packets, and of frames one by one, that arrives."""

    range_m: float
    transmission_loss_db: float
    snr_db: float
    ebn0_db: float
    delivered: float
    frames_delivered: float


class Reach(NamedTuple):
    """One modem: its name, the range that its profile has, frames of its packet, and its points in order of range."""

    modem: str
    nominal_m: float
    n_frames: int
    points: tuple[Point, ...]


def contents(reaches: Sequence[Reach], sea: str, format: str) -> list[tuple[str, bytes]]:
    """Names and contents of the files: figure, caption, numbers.

    Args:
        reaches: of one modem or several.
        sea: what the caption says of the water, its noise and its fading.
        format: png, svg or pdf.

    Raises:
        DrawingError: the format is not known.
    """
    check_format(format)
    return [
        (f"{NAME}.{format}", style.rendered(figure(reaches), format)),
        (f"{NAME}.txt", f"{caption(reaches, sea)}\n".encode()),
        (f"{NAME}.csv", as_csv(reaches)),
    ]


def figure(reaches: Sequence[Reach]) -> Figure:
    """Delivery ratio over range, a line for each modem, dashed for frames that are delivered one by one.

    Raises:
        DrawingError: there is nothing to draw.
    """
    if not reaches:
        raise DrawingError("a figure of reach needs a modem, and there is none")
    with style.paper():
        looks = [style.look(number) for number in range(len(reaches))]
        entries = [
            Line2D([], [], color=look.colour, marker=look.marker, label=one.modem)
            for one, look in zip(reaches, looks, strict=True)
        ]
        if any(one.n_frames > 1 for one in reaches):
            entries.append(Line2D([], [], color=style.BLACK, linestyle=BY_FRAME, label="frame by frame"))
        entries.append(Line2D([], [], color=style.BLACK, marker="*", markersize=9, linestyle="", label=NOMINAL))
        legend = Legend(tuple(entries), style.PAGE_IN)
        page = Page(style.PAGE_IN, TOP_IN + BODY_IN + AXIS_IN + legend.height_in + 0.08)
        axes = page.panel(Box(LEFT_IN, TOP_IN, style.PAGE_IN - LEFT_IN - RIGHT_IN, BODY_IN))
        axes.spines[["top", "right"]].set_visible(False)
        for one, look in zip(reaches, looks, strict=True):
            ranges_km = [point.range_m / 1000.0 for point in one.points]
            whole = [point.delivered for point in one.points]
            every = max(1, len(whole) // MARKERS_ON_A_LINE)
            axes.plot(ranges_km, whole, color=look.colour, marker=look.marker, markevery=every)
            if one.n_frames > 1:
                by_frame = [point.frames_delivered for point in one.points]
                axes.plot(ranges_km, by_frame, color=look.colour, linestyle=BY_FRAME)
            nominal_km = one.nominal_m / 1000.0
            if ranges_km[0] <= nominal_km <= ranges_km[-1]:
                there = float(np.interp(nominal_km, ranges_km, whole))
                axes.plot(nominal_km, there, color=look.colour, marker="*", markersize=9, markeredgecolor=style.BLACK)
        axes.set_xlim(0.0, max(point.range_m for one in reaches for point in one.points) / 1000.0)
        axes.set_ylim(0.0, 1.06)
        axes.set_xlabel(words.axis("range", "km"), labelpad=2)
        axes.set_ylabel("delivery ratio", labelpad=3)
        page.legend(legend)
    return page.figure


def caption(reaches: Sequence[Reach], sea: str) -> str:
    """What the figure shows, and in which sea."""
    several = (
        " Dashed: share of frames, if each is delivered for itself." if any(r.n_frames > 1 for r in reaches) else ""
    )
    return (
        f"Share of full packets that arrive whole, against range, for {words.listed([one.modem for one in reaches])}; "
        f"computed from the link budget, nothing is drawn.{several} Stars: the {NOMINAL} of a profile. {sea}"
    )


def as_csv(reaches: Sequence[Reach]) -> bytes:
    """A line for each modem and range."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(("modem", *Point._fields))
    lines.writerows((one.modem, *(f"{value:.6g}" for value in point)) for one in reaches for point in one.points)
    return text.getvalue().encode()
