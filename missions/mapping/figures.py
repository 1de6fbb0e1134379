"""Figures of the mapping mission: the mapped share over time, and what the map of the tracks shows of the work."""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.figure import Declared, Figure, Layer, Mark, Place, RunResults, Style, Tiles, axis_end_s
from missions.files import tables_of
from missions.mapping.ground import Ground, grounds_of
from missions.mapping.objects import SIGHTINGS
from missions.mapping.sensors import COVERAGE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from missions.mapping.scenario import MappingScenario

SHADE = 0.16
"""Strength of the tint of mapped cells."""


def first_mapped(results: RunResults) -> dict[tuple[int, int], tuple[float, str]]:
    """For every mapped cell (column, row): when (s), and by whom, it was first mapped."""
    found: dict[tuple[int, int], tuple[float, str]] = {}
    for row in results.table("coverage").to_pylist():
        found.setdefault((row["cell_x"], row["cell_y"]), (row["time_s"], row["vehicle"]))
    return found


def draw_coverage(axes: Axes, results: RunResults, style: Style) -> str:
    """Steps of the mapped share in per cent, for the fleet and for each vehicle."""
    end_s = max(float(results.summary["mission_time_s"]), 1.0)
    cells = sorted(first_mapped(results).values())
    share = 100.0 * results.summary["coverage_fraction"] / len(cells) if cells else 0.0

    def step(times_s: list[float], label: str, colour: str, line: object, width_pt: float) -> None:
        mapped = [share * count for count in (*range(len(times_s) + 1), len(times_s))]
        axes.step(
            [0.0, *times_s, end_s], mapped, where="post", color=colour, linestyle=line, linewidth=width_pt, label=label
        )

    step([time_s for time_s, _ in cells], "fleet", style.black, "-", 1.6)
    for vehicle, look in style.looks.items():
        step([time_s for time_s, by in cells if by == vehicle], vehicle, look.colour, look.line, 1.0)
    axes.set_xlim(0.0, axis_end_s(results))
    axes.set_ylim(-2.0, 102.0)
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("mapped", "%"))
    return "A cell counts for the vehicle that mapped it first."


def draw_mapped_cells(axes: Axes, results: RunResults, style: Style) -> str:
    """Mapped cells as squares in the tint of the vehicle that mapped them first."""
    from matplotlib.collections import PolyCollection

    cells = first_mapped(results)
    if not cells:
        return ""
    size_m = float(tables_of(results.manifest["scenario"], "manifest.json")["world"]["cell_m"])
    squares = [
        [((c + right) * size_m, (r + up) * size_m) for right, up in ((0, 0), (1, 0), (1, 1), (0, 1))] for c, r in cells
    ]
    colours = [style.tint(style.looks[vehicle].colour, SHADE) for _, vehicle in cells.values()]
    axes.add_collection(PolyCollection(squares, facecolors=colours, edgecolors="face", linewidths=0.3), autolim=False)
    axes.fill([], [], color=style.tint(style.black, SHADE), linewidth=0, label="mapped cells")
    return "Cells are shaded in the colour of the vehicle that mapped them first."


def draw_objects(axes: Axes, results: RunResults, style: Style) -> str:
    """Objects where they lie, with what they are, and a cross for each place at which a classifier saw one."""
    objects = tables_of(results.manifest["scenario"], "manifest.json").get("object", [])
    if not objects:
        return ""
    seen = results.table(SIGHTINGS.name).to_pylist() if results.has(SIGHTINGS.name) else []  # no classifier on board
    seen_m = [row["x_m"] for row in seen], [row["y_m"] for row in seen]
    axes.scatter(*seen_m, s=5, color=style.black, marker="x", alpha=0.4, linewidths=0.5)
    axes.scatter([], [], s=12, color=style.black, marker="x", label="seen there")
    east_m, north_m = zip(*(thing["position_m"] for thing in objects), strict=True)
    axes.scatter(east_m, north_m, s=40, marker="D", facecolors="none", edgecolors=style.black, label="object")
    for one in objects:
        axes.annotate(
            one["classification"], one["position_m"], xytext=(5, 4), textcoords="offset points", fontsize="x-small",
            annotation_clip=True,
        )  # fmt: skip
    return f"No vehicle knows where an object lies; n = {len(seen)} sightings."


FIGURES: tuple[Declared, ...] = (
    Figure("coverage", "Mapped share of the areas over mission time", draw_coverage, needs=("coverage",)),
    Layer("mapped cells", draw_mapped_cells, needs=("coverage",)),
    Layer("objects", draw_objects),
    Mark("mapping_stopped", "mapping given up"),
    Mark("found", "feature found"),
    Mark("inspected", "find inspected"),
)
"""Figures of the mission."""


def places(scenario: MappingScenario) -> tuple[Place, ...]:
    """Areas to be mapped, with their cells, and points to meet at."""
    corners_m = tuple((area.name, area.corners_m) for area in scenario.area)
    size_m = scenario.world.cell_m
    areas = [
        Place(name, "area to map", tuple((float(x), float(y)) for x, y in ground.corners_m), _tiles(ground, size_m))
        for name, ground in grounds_of(size_m, corners_m).items()
    ]
    points = [Place(point.name, "rally point", (point.position_m,)) for point in scenario.rally_point]
    return (*points, *areas)


def _tiles(ground: Ground, size_m: float) -> Tiles:
    return Tiles(size_m, ground.cells, "mappedCell", COVERAGE.name, ("cell_x", "cell_y"))
