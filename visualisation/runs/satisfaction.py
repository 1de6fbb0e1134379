"""Figure ``satisfaction``: personal satisfaction by vehicle and role over time."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from missions.figure import RunResults
from visualisation import run_records, style
from visualisation.page import DrawnPage
from visualisation.run_records import Floats, RoleKey, Tenure
from visualisation.runs import captions
from visualisation.runs.declared import Kit
from visualisation.runs.sheet import sheet

LOWEST, HIGHEST = -128, 127
STEP = HIGHEST - LOWEST + 60  # distance of the zeros of two vehicles, in units of satisfaction
NAME_ROOM_IN = 1.0
HIGHEST_BAND_IN, BODY_IN = 0.95, 5.0  # maximum height of a band, and of all bands
CRAMPED_IN = 0.4  # bands up to this height label only zero
MARKED = 0.15  # distance of markers on a line, as a share of the diagonal of the panel
THIN, THICK = 0.7, 1.9


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw a band per vehicle and a line per role, thick while the role is active."""
    series = run_records.satisfaction(results)
    tenures = {
        (vehicle, tenure.group, tenure.role): tenure
        for vehicle, own in run_records.tenures(results).items()
        for tenure in own
    }
    keys = list(dict.fromkeys(key for of_role in series.values() for key in of_role))
    colours = {vehicle: look.colour for vehicle, look in Kit(results).looks.items()}
    looks = {key: style.look(number) for number, key in enumerate(keys)}
    band_in = min(HIGHEST_BAND_IN, BODY_IN / max(1, len(series)))
    with style.paper():
        legend = [
            Line2D([], [], color=style.GREY, linestyle=looks[key].line, marker=looks[key].marker, label=label)
            for key, label in zip(keys, _labels(keys), strict=True)
        ]
        if keys:
            legend.append(Line2D([], [], color=style.GREY, linewidth=THICK, label="thick: active role"))
        page = sheet(results, band_in * len(series), legend, width_in)
        axes, ticks = page.axes, {}
        axes.set_ylabel("personal satisfaction" if len(series) > 1 else "personal\nsatisfaction")
        for number, (vehicle, of_role) in enumerate(series.items()):
            # The default binds the present number; the variable changes with the loop.
            def down_in(values: Any, number: int = number) -> Any:
                return ((number + 0.5) * STEP - values) * band_in / STEP

            for value in (LOWEST, 0, HIGHEST) if band_in > CRAMPED_IN else (0,):
                ticks[down_in(value)] = f"{value}".replace("-", "\u2212")
            ticks[down_in(0)] = f"{style.fitted(vehicle, NAME_ROOM_IN, style.TINY_PT)}    0"
            page.shade(down_in(0), -LOWEST * band_in / STEP)
            axes.hlines(down_in(0), 0.0, page.end_s, color=style.GREY, linewidth=0.4, zorder=1)
            axes.hlines(number * band_in, 0.0, page.end_s, color=style.BLACK, linewidth=0.4, zorder=1)
            for index, (key, (times_s, values)) in enumerate(of_role.items()):
                look, downs_in = looks[key]._replace(colour=colours[vehicle]), down_in(values)
                axes.plot(
                    times_s, downs_in, color=look.colour, linestyle=look.line, linewidth=THIN, marker=look.marker,
                    markersize=3.0, markeredgecolor="white", markeredgewidth=0.3,
                    markevery=(MARKED * (index + 0.5) / len(of_role), MARKED),
                )  # fmt: skip
                _emphasis(axes, times_s, downs_in, look, tenures.get((vehicle, *key)))
        axes.set_yticks(list(ticks), list(ticks.values()), fontsize=style.TINY_PT)
        axes.tick_params(axis="y", length=0)
        figure = page.finished()
    text = captions.of_run(
        results,
        "Personal satisfaction of the roles of every vehicle (\u2212128 to 127).",
        "A line is thick while the role is active; below zero (shaded) the vehicle requests help or passage.",
        "Colours identify vehicles, line styles and markers roles.",
    )
    return DrawnPage(figure, text)


def _labels(keys: list[RoleKey]) -> list[str]:
    roles = [role for _, role in keys]
    return [role if roles.count(role) == 1 else f"{role}, {group}" for group, role in keys]


def _emphasis(axes: Axes, times_s: Floats, downs_in: Floats, look: style.Look, tenure: Tenure | None) -> None:
    for span in tenure.active if tenure else ():
        inside = (times_s >= span.start_s) & (times_s <= span.end_s)
        axes.plot(times_s[inside], downs_in[inside], color=look.colour, linewidth=THICK, alpha=0.8)
