"""How old and how incomplete the knowledge of every vehicle was over mission time."""

from __future__ import annotations

import numpy as np

from missions.figure import RunResults, axis_end_s
from visualisation import style, words
from visualisation.page import Box, DrawnPage, Page
from visualisation.runs import captions, news, shades
from visualisation.runs.shades import Timespan

TOP_IN, AXIS_IN, GAP_IN, RIGHT_IN = 0.24, 0.36, 0.12, 0.14
LOWEST_IN, HIGHEST_IN, STRIPS_IN = 0.065, 0.3, 2.9
"""A row at least and at most, and what all rows of a panel should take."""
POINTS = 400
"""Times at which the shades are computed."""
WORST_ITEMS = 5.0
"""Items lacking, for each vehicle of the fleet, that are black."""


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """A strip for each vehicle: the mean age of its news of the others, and below the items of others that it lacks.

    Args:
        results: of the run.
        width_in: of the page.
    """
    traffic = news.traffic(results)
    names = traffic.vehicles
    row_in = min(HIGHEST_IN, max(LOWEST_IN, STRIPS_IN / max(1, len(names))))
    body_in = row_in * max(1, len(names))
    at_s = (np.arange(POINTS) + 0.5) * traffic.end_s / POINTS
    ages_s = np.ma.masked_invalid(traffic.ages_s(at_s)).mean(axis=1).filled(np.nan)
    lacking = news.items_lacking(results, at_s)
    left_in = 0.08 + shades.names_in(names) + 0.06
    panel_in = width_in - left_in - RIGHT_IN
    each_in = TOP_IN + body_in + AXIS_IN + shades.KEY_IN + GAP_IN
    panels = (
        ("(a) mean age of the news of the others", ages_s, words.axis("age", "s"), news.worst_age_s(traffic)),
        ("(b) items of the others that the vehicle lacks", lacking, "items", WORST_ITEMS * max(1.0, len(names))),
    )
    span = Timespan(traffic.end_s, axis_end_s(results), traffic.out)
    with style.paper():
        page = Page(width_in, 2 * each_in)
        for number, (title, values, label, top) in enumerate(panels):
            down_in = number * each_in + TOP_IN
            shades.strip(page, Box(left_in, down_in, panel_in, body_in), title, names, values, top, span)
            shades.key_below(page, Box(left_in, down_in + body_in + AXIS_IN, panel_in, 0.0), top, label)
    text = words.joined(
        "Knowledge of the vehicles over mission time, darker is worse.",
        "(a) Time since a peer sent what the vehicle heard of it last, as a mean over its peers.",
        "(b) Items that others have told and the vehicle has not received.",
        f"Black is {news.WORST_FRAMES} TDMA frames, and {WORST_ITEMS:g} items for each vehicle, or more.",
        "Hatched: the vehicle is out of the mission." if traffic.out else "",
        captions.faults(results),
        captions.run_conditions(results),
    )
    return DrawnPage(page.figure, text)
