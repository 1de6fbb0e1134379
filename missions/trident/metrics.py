"""Metrics and figures of the Trident mission."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

from missions.figure import Figure, Layer, RunResults, Style, axis_end_s
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.trident.scenario import TridentScenario
from missions.trident.services import ATTEMPTS, CHARTED, TARGET, Site
from missions.trident.truth import CHOREOGRAPHY

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def recovered(run: MeasuredRun) -> bool:
    """True if the target was truly recovered."""
    return target_recovered_s(run) is not None


def target_recovered_s(run: MeasuredRun) -> float | None:
    """Time of the true recovery of the target."""
    return next((time_s for time_s, of in _handled(run) if of == TARGET), None)


def n_mistaken(run: MeasuredRun) -> int:
    """Number of decoys recovered instead of the target."""
    return len({of for _, of in _handled(run) if of != TARGET})


def _handled(run: MeasuredRun) -> list[tuple[float, str]]:
    """Time and object of each successful handling."""
    return [(row[0], row[4]) for row in run.recorder.rows(ATTEMPTS.name) if row[3] == "handle" and row[-1]]


def charted_fraction(run: MeasuredRun) -> float:
    """Share of all tiles truly charted."""
    n_tiles = sum(len(block.tiles) for block in cast(Site, run.mission.world(run.seed)).blocks)
    return len({row[2:4] for row in run.recorder.rows(CHARTED.name)}) / n_tiles if n_tiles else 1.0


def n_choices(run: MeasuredRun) -> int:
    """Number of choices of a candidate."""
    return sum(row[5] == "chosen" for row in run.recorder.rows("items"))


def n_requests(run: MeasuredRun) -> int:
    """Number of service requests between vehicles."""
    return sum(row[5] == "requestedOf" for row in run.recorder.rows("items"))


def n_violations(run: MeasuredRun) -> int | Absent:
    """Number of violations of the choreography."""
    if not cast(TridentScenario, run.scenario).choreography.state or not run.recorder.rows("packets"):
        return NOT_APPLICABLE
    return sum(bool(row[-1]) for row in run.recorder.rows(CHOREOGRAPHY.name))


def navigation_error_m(run: MeasuredRun) -> float | Absent:
    """Greatest error of the positions reported by submerged vehicles."""
    submerged = {vehicle.name for vehicle in run.scenario.vehicle if vehicle.depth_m > 1.0}
    ways: dict[str, list[tuple[float, float, float]]] = {name: [] for name in submerged}
    for row in run.recorder.rows("trajectories"):
        if row[1] in submerged:
            ways[row[1]].append((row[0], row[2], row[3]))
    tick_s, worst_m = run.scenario.scenario.tick_s, None
    for _, origin, _, recorded_s, _, attribute, value, *_ in run.recorder.rows("items"):
        if attribute != "position" or origin not in submerged:
            continue
        way, place = ways[origin], recorded_s / tick_s
        before = min(int(place), len(way) - 2)
        if before < 0:
            continue
        share, (_, x_m, y_m), (_, to_x_m, to_y_m) = place - before, way[before], way[before + 1]
        east, north = (float(part) for part in value.removeprefix("POINT (").removesuffix(")").split())
        dx_m, dy_m = x_m + share * (to_x_m - x_m) - east, y_m + share * (to_y_m - y_m) - north
        worst_m = max(worst_m or 0.0, math.sqrt(dx_m * dx_m + dy_m * dy_m))
    return NOT_APPLICABLE if worst_m is None else round(worst_m, 3)


METRICS = (
    Metric("recovered", "", Better.HIGHER, "target recovered", recovered, headline=True),
    Metric(
        "target_recovered_s", "s", Better.LOWER, "time to the recovery of the target", target_recovered_s,
        headline=True, censored=True,
    ),
    Metric("charted_fraction", "", Better.HIGHER, "share of the site charted", charted_fraction, headline=True),
    Metric("n_mistaken", "", Better.LOWER, "decoys recovered", n_mistaken),
    Metric("n_choices", "", Better.LOWER, "choices of a candidate", n_choices),
    Metric("n_requests", "", Better.NEITHER, "requests for services", n_requests),
    Metric("n_violations", "", Better.LOWER, "violations of the choreography", n_violations),
    Metric(
        "navigation_error_m", "m", Better.LOWER, "greatest navigation error", navigation_error_m,
        note="Of the places that vehicles under water tell, which are rounded to 0.5 m.",
    ),
)  # fmt: skip
"""Metrics of this mission."""


USES = {"Surveying", "Ranging", "Reacquiring", "Holding", "Handling"}
"""Steps that use a service."""


def statuses(results: RunResults) -> dict[str, list[tuple[float, str]]]:
    """Return time and status of each service, in order of advertisement."""
    found: dict[str, list[tuple[float, str]]] = {}
    for row in results.table("items").to_pylist():
        if row["attribute"] == "serviceStatus":
            found.setdefault(row["subject"], []).append((row["recorded_s"], row["value"]))
    return found


def uses(results: RunResults, services: Any) -> list[tuple[str, str, float, float]]:
    """Return vehicle, service, begin and end (s) of every step bound to one of ``services``."""
    end_s = float(results.summary["mission_time_s"])
    running: dict[tuple[str, str, str, int], tuple[str, float]] = {}
    found = []
    for row in results.table("plans").to_pylist():
        key = row["vehicle"], row["role"], row["argument"], row["node"]
        service = next((name for name in services if name in row["task"]), None)
        if row["task"].partition("(")[0] not in USES or service is None:
            continue
        if row["status"] == "running":
            running.setdefault(key, (service, row["time_s"]))
        elif key in running:
            of, from_s = running.pop(key)
            found.append((row["vehicle"], of, from_s, row["time_s"]))
    found += [(key[0], of, from_s, end_s) for key, (of, from_s) in running.items()]
    return sorted(found, key=lambda mark: mark[2])


def draw_services(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw a lane per service: grey while it reports to work, bars while plans use it."""
    said, end_s = statuses(results), max(float(results.summary["mission_time_s"]), 1.0)
    names = list(said)
    for lane, name in enumerate(names):
        times = [*said[name], (end_s, "")]
        for (from_s, status), (to_s, _) in pairwise(times):
            if status == "available":
                axes.barh(lane, to_s - from_s, left=from_s, height=0.8, color=style.tint(style.grey, 0.25))
            else:
                axes.plot([from_s], [lane], marker="x", color=style.black, linestyle="none")
    shown = set()
    for vehicle, service, from_s, to_s in uses(results, names):
        label = None if vehicle in shown else vehicle
        shown.add(vehicle)
        colour, height = style.looks[vehicle].colour, 0.6 / len(style.looks)
        at = names.index(service) - 0.3 + (list(style.looks).index(vehicle) + 0.5) * height
        axes.barh(at, to_s - from_s, left=from_s, height=height, color=colour, label=label)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlim(0.0, axis_end_s(results))
    axes.set_xlabel(style.axis("mission time", "s"))
    return (
        "Grey: the service says of itself that it works; a cross: that it has failed. Coloured: a step of the plan of "
        "that vehicle is bound to it. Choices and fixes, which are no steps, are not shown."
    )


def draw_choreography(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw states over time with messages and violations."""
    rows, end_s = results.table(CHOREOGRAPHY.name).to_pylist(), max(float(results.summary["mission_time_s"]), 1.0)
    pattern = results.scenario_tables.get("choreography", {})
    states = [state["name"] for state in pattern.get("state", [])]
    moves = [row for row in rows if not row["violation"]]
    line = [(0.0, states[0])] if states else []
    line += [(row["time_s"], row["to"]) for row in moves]
    line += [(end_s, line[-1][1])] if line else []
    axes.step([t for t, _ in line], [states.index(s) for _, s in line], where="post", color=style.grey)
    shown = set()
    for row in rows:
        if row["violation"]:
            label = None if "violation" in shown else "violation"
            shown.add("violation")
            axes.plot(row["time_s"], states.index(row["state"]), "x", color=style.black, label=label)
            continue
        look = style.looks[row["vehicle"]]
        label = None if row["vehicle"] in shown else row["vehicle"]
        shown.add(row["vehicle"])
        axes.plot(row["time_s"], states.index(row["to"]), look.marker, color=look.colour, label=label)
    axes.set_yticks(range(len(states)), states)
    axes.set_xlim(0.0, axis_end_s(results))
    axes.set_xlabel(style.axis("mission time", "s"))
    n = sum(bool(row["violation"]) for row in rows)
    return f"A mark is a message when it is first said, by the vehicle that says it. Violations of the pattern: {n}."


def draw_site(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw charted tiles in the colour of the first vehicle."""
    raw = results.scenario_tables
    size_m = float(raw["mission"]["tile_m"])
    first: dict[tuple[int, int], str] = {}
    for row in results.table(CHARTED.name).to_pylist():
        first.setdefault((row["column"], row["row"]), row["vehicle"])
    for (column, of_row), vehicle in first.items():
        tint = style.tint(style.looks[vehicle].colour, 0.16)
        corner = column * size_m, of_row * size_m
        xs = [corner[0], corner[0] + size_m, corner[0] + size_m, corner[0]]
        axes.fill(xs, [corner[1], corner[1], corner[1] + size_m, corner[1] + size_m], color=tint, linewidth=0.0)
    return "Tiles that were really charted are tinted in the colour of the vehicle that was first."


FIGURES = (
    Figure("services", "Services over mission time", draw_services, needs=("items", "plans")),
    Figure("choreography", "Choreography over mission time", draw_choreography, needs=(CHOREOGRAPHY.name,)),
    Layer("site", draw_site, needs=(CHARTED.name, ATTEMPTS.name)),
)
"""Figures of this mission."""
