"""Share of the areas that is mapped, over mission time: the fleet, and what each vehicle adds."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from missions.runs.results import Results
from visualisation import style
from visualisation.runs import reading

LEFT_IN, RIGHT_IN, TOP_IN, BODY_IN, AXIS_IN = 0.5, 0.14, 0.08, 1.9, 0.36
NAME_ROOM_IN = 1.2


def figure(results: Results) -> Figure:
    """Steps of the mapped share in per cent; a cell counts for the vehicle that mapped it first."""
    end_s = reading.end_s(results)
    cells = sorted(reading.first_mapped(results).values())
    share = 100.0 * results.summary["coverage_fraction"] / len(cells) if cells else 0.0
    vehicles = reading.vehicles(results)
    names = [style.fitted(name, NAME_ROOM_IN, style.SMALL_PT) for name in vehicles]
    n_columns = style.legend_columns(["fleet", *names], style.COLUMN_IN - 0.1)
    legend_in = style.legend_height_in(1 + len(names), n_columns) + 0.05
    height_in = TOP_IN + BODY_IN + AXIS_IN + legend_in
    with style.paper():
        drawn = style.blank(style.COLUMN_IN, height_in)
        width_in = style.COLUMN_IN - LEFT_IN - RIGHT_IN
        box = LEFT_IN, AXIS_IN + legend_in, width_in, BODY_IN
        axes = drawn.add_axes(
            (box[0] / style.COLUMN_IN, box[1] / height_in, box[2] / style.COLUMN_IN, box[3] / height_in)
        )
        series = [("fleet", [time_s for time_s, _ in cells], style.Look(style.BLACK, "-", ""), 1.6)]
        for number, (vehicle, name) in enumerate(zip(vehicles, names, strict=True)):
            series.append((name, [at for at, by in cells if by == vehicle], style.look(number), 1.0))
        for name, times_s, look, linewidth in series:
            mapped = share * np.array([*range(len(times_s) + 1), len(times_s)])
            axes.step(
                [0.0, *times_s, end_s], mapped, where="post", color=look.colour, linestyle=look.line,
                linewidth=linewidth, label=name,
            )  # fmt: skip
        axes.set_xlim(0.0, end_s)
        axes.set_ylim(-2.0, 102.0)
        axes.set_xlabel("time / s", labelpad=2)
        axes.set_ylabel("mapped / %", labelpad=2)
        axes.spines[["top", "right"]].set_visible(False)
        drawn.legend(loc="lower center", bbox_to_anchor=(0.5, 0.02 / height_in), ncols=n_columns)
    return drawn
