"""Figure ``satisfaction``: personal satisfaction by vehicle and role over time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from missions.figure import RunResults
from visualisation import run_records, style
from visualisation.page import DrawnPage
from visualisation.run_records import Floats, RoleKey, Tenure
from visualisation.runs import captions
from visualisation.runs.declared import Kit
from visualisation.runs.sheet import BESIDE_IN, Name, Sheet, sheet

LOWEST, HIGHEST = -128, 127
VEHICLE_ROOM_IN = 1.0
TICK_ROOM_IN = 0.32
PAD_IN, LEAST_PAD_IN = 0.07, 0.02
BANDS_IN = ((4, 0.95), (8, 0.7), (14, 0.45), (24, 0.27))
"""Pairs of maximum fleet size and band height: with the legend, all fit a page of 9 inches."""
LEAST_BAND_IN = 0.2
CRAMPED_IN = 0.4
"""Bands up to this height label only zero."""
MARKED_IN = 0.9
"""Distance of markers on a line."""
THIN, THICK = 0.7, 1.9


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw a band per vehicle and a line per role, thick while the role drives the vehicle."""
    series = run_records.satisfaction(results)
    tenures = {
        (vehicle, tenure.group, tenure.role): tenure
        for vehicle, own in run_records.tenures(results).items()
        for tenure in own
    }
    keys = list(dict.fromkeys(key for of_role in series.values() for key in of_role))
    colours = {vehicle: look.colour for vehicle, look in Kit(results).looks.items()}
    looks = {key: style.look(number) for number, key in enumerate(keys)}
    band_in = next((high for n, high in BANDS_IN if len(series) <= n), LEAST_BAND_IN)
    titles = {vehicle: style.fitted(vehicle, VEHICLE_ROOM_IN, style.SMALL_PT, "bold") for vehicle in series}
    widest_in = max((style.width_in(title, style.SMALL_PT, "bold") for title in titles.values()), default=0.0)
    left_in = -TICK_ROOM_IN - widest_in
    names = []
    for number, title in enumerate(titles.values()):
        top_in = number * band_in
        names.append(Name(left_in, top_in + band_in / 2, title, style.SMALL_PT, "bold"))
        for value in (LOWEST, 0, HIGHEST) if band_in > CRAMPED_IN else (0,):
            names.append(Name(BESIDE_IN, _down_in(value, top_in, band_in), f"{value}".replace("-", "\u2212")))
    with style.paper():
        legend = [
            Line2D([], [], color=style.GREY, linestyle=looks[key].line, marker=looks[key].marker, label=label)
            for key, label in zip(keys, _labels(keys), strict=True)
        ]
        if keys:
            legend.append(Line2D([], [], color=style.GREY, linewidth=THICK, label="thick: drives the vehicle"))
        page = sheet(results, names, band_in * len(series), legend, width_in)
        axes, marked_s = page.axes, MARKED_IN * page.inch_s
        words = "personal satisfaction" if len(series) > 1 else "personal\nsatisfaction"
        axes.set_ylabel(words, labelpad=2.0 - 72.0 * left_in)
        for number, (vehicle, of_role) in enumerate(series.items()):
            top_in = number * band_in
            _ground(page, top_in, band_in)
            for index, (key, (times_s, values)) in enumerate(of_role.items()):
                look = looks[key]._replace(colour=colours[vehicle])
                downs_in = np.array([_down_in(value, top_in, band_in) for value in values])
                axes.plot(times_s, downs_in, color=look.colour, linestyle=look.line, linewidth=THIN)
                _emphasis(axes, times_s, downs_in, look, tenures.get((vehicle, *key)))
                _markers(axes, times_s, downs_in, look, marked_s, (index + 0.5) / len(of_role))
        figure = page.finished()
    return DrawnPage(figure, captions.satisfaction_caption(results))


def _labels(keys: list[RoleKey]) -> list[str]:
    """Return role names, with the group where two groups share the name."""
    roles = [role for _, role in keys]
    return [role if roles.count(role) == 1 else f"{role}, {group}" for group, role in keys]


def _down_in(value: float, top_in: float, band_in: float) -> float:
    pad_in = _pad_in(band_in)
    return top_in + pad_in + (HIGHEST - value) / (HIGHEST - LOWEST) * (band_in - 2 * pad_in)


def _pad_in(band_in: float) -> float:
    return PAD_IN if band_in > CRAMPED_IN else LEAST_PAD_IN


def _ground(page: Sheet, top_in: float, band_in: float) -> None:
    zero_in = _down_in(0.0, top_in, band_in)
    page.band(zero_in, top_in + band_in - _pad_in(band_in) - zero_in)
    page.axes.hlines(zero_in, 0.0, page.end_s, color=style.GREY, linewidth=0.4, zorder=1)
    page.axes.hlines(top_in, 0.0, page.end_s, color=style.BLACK, linewidth=0.4, zorder=1)


def _markers(axes: Axes, times_s: Floats, downs_in: Floats, look: style.Look, step_s: float, offset: float) -> None:
    """Draw the markers of a role, offset from those of the vehicle's other roles."""
    if times_s.size:
        at_s = np.arange(times_s[0] + offset * step_s, times_s[-1], step_s)
        axes.plot(
            at_s, np.interp(at_s, times_s, downs_in), color=look.colour, linestyle="none", marker=look.marker,
            markersize=3.0, markeredgecolor="white", markeredgewidth=0.3, zorder=3,
        )  # fmt: skip


def _emphasis(axes: Axes, times_s: Floats, downs_in: Floats, look: style.Look, tenure: Tenure | None) -> None:
    for span in tenure.active if tenure else ():
        inside = (times_s >= span.start_s) & (times_s <= span.end_s)
        axes.plot(times_s[inside], downs_in[inside], color=look.colour, linewidth=THICK, alpha=0.8)
