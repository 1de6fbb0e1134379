"""Figure ``motivation``: motivations of all alternatives in the most contested decisions."""

from __future__ import annotations

from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from missions import words
from missions.decisions import Row, decisions_of, motivation_of
from missions.figure import RunResults
from visualisation import page, style
from visualisation.page import DrawnPage
from visualisation.runs import captions
from visualisation.runs.declared import Kit

COLUMN_IN, HIGHEST_IN = 3.2, 9.0  # minimum width of a column of panels; height of a page
MOMENTS, BARS = 9, 9  # maximum number of panels, and of activity sets in a panel, best combinations first
BAR_IN, BESIDE_IN = 0.145, 0.54
NAME_SHARE = 0.4  # share of a column for names
HATCH = "//////"


class Weighed(NamedTuple):
    """Decision with its alternatives; ``margin`` is the lead in mean motivation over the best rejected combination."""

    time_s: float
    vehicle: str
    rows: list[Row]
    margin: float


def picture(results: RunResults, width_in: float = style.PAGE_IN) -> DrawnPage:
    """Draw a panel for each of the most contested decisions, a bar for each activity set."""
    decisions = contested(results)
    choices: dict[tuple[Any, ...], Weighed] = {}  # the closest decision of each choice of a vehicle
    for weighed in sorted(decisions, key=lambda weighed: weighed.margin):
        alternatives = tuple((row["role"], tuple(row["activities"]), row["chosen"]) for row in weighed.rows)
        choices.setdefault((weighed.vehicle, alternatives), weighed)
    closest = list(choices.values())[:MOMENTS]
    columns = max(1, min(int(width_in / COLUMN_IN), len(closest)))
    n_bars = max((len(moment.rows) for moment in closest), default=1)
    body_in = BAR_IN * (n_bars + 0.4)
    # Half an inch of the page is for the legend.
    n_rows = int((HIGHEST_IN - 0.5) / (body_in + BESIDE_IN))
    shown = sorted(closest[: columns * n_rows], key=lambda weighed: (weighed.time_s, weighed.vehicle))
    colours = {vehicle: look.colour for vehicle, look in Kit(results).looks.items()}
    names_in = NAME_SHARE * width_in / columns
    with style.paper():
        figure = page.opened(width_in, body_in * -(-max(1, len(shown)) // columns))
        panels = page.panels(figure, max(1, len(shown)), columns, framed=True)
        for axes, moment in zip(panels, shown, strict=False):
            axes.set_title(f"{moment.vehicle}, {words.time(moment.time_s)}")
            _bars(axes, moment, colours[moment.vehicle], names_in)
            axes.set_xlim(0.0, 1.05 * max(value for row in moment.rows for value in _ends(row)))
            # All panels have room for as many bars, so that bars have one height.
            axes.set_ylim(n_bars - 0.3, -0.7)
        for axes in panels[-columns:]:
            axes.set_xlabel(words.axis("motivation"))
        if not shown:
            panels[0].set_axis_off()
            panels[0].set_title("no decision had conflicting candidates")
        page.legend(figure, _legend())
        page.lay_out(figure, panels[::columns], body_in)
    return DrawnPage(figure, _caption(results, len(shown), len(decisions)))


def contested(results: RunResults) -> list[Weighed]:
    """Return decisions that rejected an activity set of positive motivation."""
    cases = []
    for time_s, vehicle, rows, _ in decisions_of(results.rows("decisions")):
        rivals = [row for row in rows if not row["chosen"] and motivation_of(row) > 0.0]
        if rivals:
            moved = [row for row in rows if row["chosen"] or row in rivals]
            moved.sort(key=lambda row: (not row["chosen"], -(row["best_mean"] or 0.0)))
            won = max((row["best_mean"] or 0.0 for row in moved if row["chosen"]), default=0.0)
            cases.append(Weighed(time_s, vehicle, moved[:BARS], won - max(row["best_mean"] or 0.0 for row in rivals)))
    return cases


def _ends(row: Row) -> tuple[float, float]:
    return motivation_of(row), row["best_mean"] or 0.0


def _bars(axes: Axes, moment: Weighed, colour: str, room_in: float) -> None:
    names = []
    for y, row in enumerate(moment.rows):
        look: dict[str, Any] = {
            "facecolor": style.tint(colour, 1.0 if row["chosen"] else 0.25),
            "edgecolor": colour,
            "linewidth": 0.5,
        }
        axes.barh(y, row["own"], 0.66, **look)
        if row["external"]:
            axes.barh(y, row["external"], 0.66, row["own"], hatch=HATCH, **{**look, "edgecolor": style.BLACK})
        if row["best_mean"] is not None:
            axes.plot(row["best_mean"], y, "D", color=style.BLACK, markersize=3.0, markeredgecolor="white",
                      markeredgewidth=0.4)  # fmt: skip
        name = " + ".join(row["activities"]) + (f" ({row['role']})" if row["role"] else "")
        names.append(style.fitted(name, room_in, style.TINY_PT))
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="y", length=0, labelsize=style.TINY_PT, pad=2)


def _legend() -> list[Artist]:
    return [
        Patch(facecolor=style.GREY, linewidth=0, label="performed"),
        Patch(facecolor=style.tint(style.GREY, 0.25), edgecolor=style.GREY, linewidth=0.5, label="not performed"),
        Patch(facecolor="white", edgecolor=style.BLACK, hatch=HATCH, linewidth=0.5, label="from an influence signal"),
        Line2D([], [], marker="D", linestyle="none", color=style.BLACK, markersize=3.0, label="best combination"),
    ]


def _caption(results: RunResults, n_shown: int, n_found: int) -> str:
    which = (
        "All"
        if n_shown == n_found
        else f"The {n_shown} most closely contested, one per choice of a vehicle, of {n_found}"
    )
    return captions.of_run(
        results,
        "Motivation of the candidate activities at decisions with conflicting candidates.",
        f"{which} such decisions in time order, each with its own scale; colours identify the vehicles.",
        "A diamond is the mean motivation of the best combination with the activities; the highest combination is "
        "performed, after vital activities.",
    )
