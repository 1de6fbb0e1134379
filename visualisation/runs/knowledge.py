"""Figure ``knowledge``: age and completeness of information by vehicle over time."""

from __future__ import annotations

import numpy as np

from missions.figure import RunResults, axis_end_s
from visualisation import page, style, words
from visualisation.page import DrawnPage
from visualisation.runs import captions, news, shades
from visualisation.runs.shades import Timespan

ROWS_IN = 0.065, 0.3, 2.9
"""Minimum and maximum height of a row, and target height of a panel."""
POINTS = 400
"""Number of sampling times."""
WORST_ITEMS = 5.0
"""Missing items per vehicle of the fleet that are drawn black."""


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw strips per vehicle: mean age of information on peers, and missing items of peers."""
    traffic = news.traffic(results)
    names = traffic.vehicles
    row_in = shades.row_in(len(names), *ROWS_IN)
    body_in = row_in * max(1, len(names))
    at_s = (np.arange(POINTS) + 0.5) * traffic.end_s / POINTS
    ages_s = np.ma.masked_invalid(traffic.ages_s(at_s)).mean(axis=1).filled(np.nan)
    lacking = news.items_lacking(results, at_s)
    panels = (
        ("mean age of the news of the others", ages_s, words.axis("age", "s"), news.worst_age_s(traffic)),
        ("items of the others that the vehicle lacks", lacking, "items", WORST_ITEMS * max(1.0, len(names))),
    )
    span = Timespan(traffic.end_s, axis_end_s(results), traffic.out)
    with style.paper():
        figure = page.opened(width_in, 2 * body_in)
        strips = page.panels(figure, 2, 1, [title for title, *_ in panels], framed=True)
        for axes, (_, values, label, top) in zip(strips, panels, strict=True):
            shades.strip(axes, names, values, top, span, row_in)
            shades.key(figure, axes, body_in, top, label)
        page.lay_out(figure, strips, [body_in] * 2)
    text = captions.of_run(
        results,
        "Knowledge of the vehicles over mission time, darker is worse.",
        "(a) Time since a peer sent what the vehicle heard of it last, as a mean over its peers.",
        "(b) Items that others have told and the vehicle has not received.",
        f"Black is {news.WORST_FRAMES} TDMA frames, and {WORST_ITEMS:g} items for each vehicle, or more.",
        "Hatched: the vehicle is out of the mission." if traffic.out else "",
    )
    return DrawnPage(figure, text)
