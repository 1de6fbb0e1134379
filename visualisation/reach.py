"""Figure of delivery ratio over range, and its data as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from missions import words
from visualisation import page, style
from visualisation.output import DrawingError, as_csv

BODY_IN = 2.3
NAME = "delivery-against-range"
NOMINAL = "nominal range"
MARKERS_ON_A_LINE = 12


class Point(NamedTuple):
    """Link at one range, with the delivery ratio of full packets."""

    range_m: float
    transmission_loss_db: float
    snr_db: float
    ebn0_db: float
    delivered: float


class ModemReach(NamedTuple):
    """One modem: nominal range, points by range."""

    modem: str
    nominal_m: float
    points: tuple[Point, ...]


def reach_contents(reaches: Sequence[ModemReach], sea: str, format: str) -> list[tuple[str, bytes]]:
    """Return names and contents of figure, caption and CSV; ``sea`` describes water, noise, fading in the caption."""
    figure, caption = reach_figure(reaches), reach_caption(reaches, sea)
    return style.contents(NAME, format, figure, caption, reach_csv(reaches))


def reach_figure(reaches: Sequence[ModemReach]) -> Figure:
    """Draw one line per modem; DrawingError without modems."""
    if not reaches:
        raise DrawingError("a figure of reach needs a modem, and there is none")
    with style.paper():
        looks = [style.look(number) for number in range(len(reaches))]
        entries = [
            Line2D([], [], color=look.colour, marker=look.marker, label=reach.modem)
            for reach, look in zip(reaches, looks, strict=True)
        ]
        entries.append(Line2D([], [], color=style.BLACK, marker="*", markersize=9, linestyle="", label=NOMINAL))
        figure = page.opened(style.PAGE_IN, BODY_IN)
        (axes,) = page.panels(figure, 1, 1)
        page.legend(figure, entries)
        for modem, look in zip(reaches, looks, strict=True):
            ranges_km = [point.range_m / 1000.0 for point in modem.points]
            whole = [point.delivered for point in modem.points]
            # Markers tell lines apart in grey print; one at each point would hide them.
            every = max(1, len(whole) // MARKERS_ON_A_LINE)
            axes.plot(ranges_km, whole, color=look.colour, marker=look.marker, markevery=every)
            nominal_km = modem.nominal_m / 1000.0
            if ranges_km[0] <= nominal_km <= ranges_km[-1]:
                share = float(np.interp(nominal_km, ranges_km, whole))
                axes.plot(nominal_km, share, color=look.colour, marker="*", markersize=9, markeredgecolor=style.BLACK)
        axes.set_xlim(0.0, max(point.range_m for reach in reaches for point in reach.points) / 1000.0)
        axes.set_ylim(0.0, 1.06)
        axes.set_xlabel(words.axis("range", "km"))
        axes.set_ylabel("delivery ratio")
        page.lay_out(figure, [axes], BODY_IN)
    return figure


def reach_caption(reaches: Sequence[ModemReach], sea: str) -> str:
    """Return the caption: content and sea."""
    return (
        f"Share of full packets that arrive whole, against range, "
        f"for {words.listed([reach.modem for reach in reaches])}; lines are computed from the link "
        f"budget. Stars: the {NOMINAL} of a profile. {sea}"
    )


def reach_csv(reaches: Sequence[ModemReach]) -> bytes:
    """Return one line per modem and range."""
    rows = ((reach.modem, *(f"{value:.6g}" for value in point)) for reach in reaches for point in reach.points)
    return as_csv(("modem", *Point._fields), rows)
