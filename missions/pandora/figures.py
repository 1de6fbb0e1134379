"""Figures of this mission: parts serviced over time, and when what befell was found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style
from missions.files import tables_of
from missions.meeting.truth import JOBS
from missions.pandora.events import FAULTS
from missions.pandora.truth import MET, SERVICED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FOUND_BY = ("diagnosis", "anomaly")
"""Attributes of what vehicles find."""


def _rows(results: RunResults, table: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = results.table(table).to_pylist() if results.has(table) else []
    return rows


def draw_serviced(axes: Axes, results: RunResults, style: Style) -> str:
    """Parts over time: taken for done by their vehicles, and really serviced."""
    end_s = max((row["time_s"] for row in _rows(results, "trajectories")), default=0.0)
    for table, label, line, colour in (
        (JOBS.name, "taken for done", "--", style.grey), (SERVICED.name, "really serviced", "-", style.black),
    ):  # fmt: skip
        first: dict[str, float] = {}
        for row in _rows(results, table):
            first.setdefault(row["job" if table == JOBS.name else "part"], row["time_s"])
        times_s = sorted(first.values())
        axes.step([0.0, *times_s, end_s], [*range(len(times_s) + 1), len(times_s)], where="post", color=colour,
                  linestyle=line, label=label)  # fmt: skip
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("parts"))
    return "Where the dashed line is above the other, a vehicle takes for done what is not."


def draw_findings(axes: Axes, results: RunResults, style: Style) -> str:
    """What vehicles found, a row for each finding, in the colour of the vehicle; above them what really befell."""
    findings = [
        row
        for row in _rows(results, "items")
        if row["attribute"] in ("diagnosis", "anomaly") and row["value"] != "sound"
    ]
    befell = [(row["time_s"], f"{row['kind']}: {row['vehicle']}") for row in _rows(results, "faults")
              if row["kind"] in FAULTS and row["detail"] != "over"]  # fmt: skip
    befell += [(row["time_s"], f"{row['kind']}: {row['part']}") for row in _rows(results, MET.name)]
    names = list(dict.fromkeys([*(name for _, name in befell), *(row["value"] for row in findings)]))
    for time_s, name in befell:
        axes.plot(time_s, names.index(name), marker="|", markersize=14, color=style.black, linestyle="none")
    axes.plot([], [], marker="|", color=style.black, linestyle="none", label="befell")
    for vehicle, look in style.looks.items():
        own = [row for row in findings if row["origin"] == vehicle]
        axes.plot([row["time_s"] for row in own], [names.index(row["value"]) for row in own], marker=look.marker,
                  color=look.colour, linestyle="none", label=f"found by {vehicle}")  # fmt: skip
    axes.set_yticks(range(len(names)), names, fontsize="x-small")
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlabel(style.axis("time", "s"))
    return "An upset befalls when a vehicle that works on the part comes near."


def draw_upset(axes: Axes, results: RunResults, style: Style) -> str:
    """Chains as lines; parts that were not serviced, crossed out."""
    scenario = tables_of(results.manifest["scenario"], "manifest.json")
    for chain in scenario.get("chain", []):
        axes.plot(*zip(*chain["points_m"], strict=True), color=style.grey, linewidth=1.0, zorder=0)
    serviced = {row["part"] for row in _rows(results, SERVICED.name)}
    left_m = [
        (part["points_m"][0] if kind == "chain" else part["position_m"])
        for kind in ("panel", "valve", "chain", "anode")
        for part in scenario.get(kind, [])
        if part["name"] not in serviced
    ]
    if not left_m:
        return "All parts were serviced."
    east_m, north_m = zip(*left_m, strict=True)
    axes.scatter(east_m, north_m, marker="x", s=60, color=style.black, label="not serviced")
    return f"Parts that were not serviced: {len(left_m)}."


FIGURES: tuple[Declared, ...] = (
    Figure("serviced", "Parts serviced over mission time", draw_serviced, needs=(SERVICED.name,)),
    Figure("findings", "What befell, and what vehicles found", draw_findings, needs=("items",)),
    Layer("structure", draw_upset, needs=(SERVICED.name,)),
    Mark("job_done", "part done"),
)
"""Figures of the mission."""
