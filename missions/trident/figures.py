"""Figures of this mission: services over time, the choreography, and the map."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

from missions.figure import Figure, Layer, RunResults, Style, axis_end_s
from missions.files import tables_of
from missions.trident.choreography import CHOREOGRAPHY
from missions.trident.modules import ATTEMPTS, CHARTED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

USES = {"Surveying", "Ranging", "Reacquiring", "Holding", "Handling"}
"""Steps that use a service; its name is their last argument but those of when."""


def statuses(results: RunResults) -> dict[str, list[tuple[float, str]]]:
    """For every service, in the order in which they were advertised: when it said what of itself."""
    found: dict[str, list[tuple[float, str]]] = {}
    for row in results.table("items").to_pylist():
        if row["attribute"] == "serviceStatus":
            found.setdefault(row["subject"], []).append((row["recorded_s"], row["value"]))
    return found


def uses(results: RunResults, services: Any) -> list[tuple[str, str, float, float]]:
    """Vehicle, service, begin and end (s) of every step of a plan that is bound to one of ``services``."""
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
    """A lane for each service: grey where it says that it works, a bar where a plan has it in use."""
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
    """Steps from state to state over time, a mark for each message, another for each violation."""
    rows, end_s = results.table(CHOREOGRAPHY.name).to_pylist(), max(float(results.summary["mission_time_s"]), 1.0)
    pattern = tables_of(results.manifest["scenario"], "manifest.json").get("choreography", {})
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
    """Charted tiles in the colour of the vehicle that was first, and where attempts were made."""
    raw = tables_of(results.manifest["scenario"], "manifest.json")
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
"""What results of this mission show beside what those of every mission do."""
