"""Metrics and figures of the mapping mission."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, cast

from exchange.arithmetic import distance
from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style, round_up, run_end_s
from missions.mapping.sensors import SIGHTINGS
from missions.mapping.truth import GOAL
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.scenarios.features import place_error_m
from missions.scenarios.scenario import Scenario
from missions.statements import places_m

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from missions.mapping.scenario import MappingScenario
    from remoras.mission import Milestone
    from remoras.work import Point


SHARES = (50, 80, 95, 100)


def _n_cells(run: MeasuredRun) -> int:
    return len(run.mission.world(run.seed).cells)


def _mapped(run: MeasuredRun) -> set[tuple[int, int]]:
    return {(row[2], row[3]) for row in run.recorder.rows("coverage")}


def coverage_fraction(run: MeasuredRun) -> float:
    """Share of all cells that any vehicle mapped; 0 without areas."""
    n_cells = _n_cells(run)
    return len(_mapped(run)) / n_cells if n_cells else 0.0


def believed_fraction(run: MeasuredRun) -> float | Absent:
    """Share of surely mapped cells in all beliefs; not applicable without position errors."""
    n_cells = _n_cells(run)
    if place_error_m(run.scenario, ()) is None or not n_cells:
        return NOT_APPLICABLE
    return len({(row[4], row[6]) for row in run.recorder.rows("items") if row[5] == "mappedCell"}) / n_cells


def time_to_s(share: float) -> Callable[[MeasuredRun], float | None]:
    """Return the metric for the time to a share (0..1) of the goal; None if never reached."""

    def reached_s(run: MeasuredRun) -> float | None:
        # The tolerance absorbs the rounding of a sum of cell weights.
        reached = (time_s for time_s, fraction in run.recorder.rows(GOAL.name) if fraction >= share - 1e-9)
        first_s = next(reached, None)
        return None if first_s is None else round(first_s, 4)

    return reached_s


def duplicate_fraction(run: MeasuredRun) -> float:
    """Share of the mapping that repeated the work of another vehicle."""
    rows = run.recorder.rows("coverage")
    return 1.0 - len(_mapped(run)) / len(rows) if rows else 0.0


def area_roles(scenario: Scenario) -> set[tuple[str, str]]:
    """Return (group, role) of the roles that explore an area."""
    areas = {area.name for area in cast("MappingScenario", scenario).area}
    return {(group.name, role.name) for group in scenario.group for role in group.role if role.job in areas}


def least_mapped_fraction(run: MeasuredRun) -> float | None:
    """Smallest share of mapped cells mapped first by one vehicle; None without any.

    Over all that ever held a role with an area: 1/n for n equal contributions, 0 if one did nothing. (Egalitarian
    welfare: Brandt et al., Handbook of Computational Social Choice, 2016, chapter 12.)
    """
    recorder, roles = run.recorder, area_roles(run.scenario)
    first: dict[tuple[int, int], str] = {}
    for _, vehicle, x, y in recorder.rows("coverage"):
        first.setdefault((x, y), vehicle)
    holders = {vehicle for _, vehicle, group, role, event in recorder.rows("roles") if (group, role) in roles}
    counts = Counter(first.values())
    return min(counts[vehicle] for vehicle in holders) / len(first) if holders and first else None


def finds_inspected_fraction(run: MeasuredRun) -> float | Absent:
    """Share of all features detected and truly inspected; not applicable without features."""
    finds = cast("MappingScenario", run.scenario).finds
    if finds is None or not finds.number:
        return NOT_APPLICABLE
    return sum(milestone.name == "inspected" for milestone in run.milestones) / finds.number


REGION = 2.4477468306808166  # radius of the 95 % region in standard deviations per axis: (-2 ln 0.05)^1/2 (Rayleigh)


def courses_m(
    items: Iterable[tuple[Any, ...]], vehicles: Iterable[str], objects_m: Sequence[Point]
) -> Iterator[list[tuple[float, float]]]:
    """Yield (position error, 95 % radius) after each observation of an object, by the true object nearest at last."""
    for places in places_m(items, vehicles):
        truth_m = min(objects_m, key=lambda lies_m: distance(lies_m, places[-1][0]))
        yield [(distance(truth_m, at_m), REGION * sigma_m) for at_m, sigma_m in places]


def within_region_fraction(run: MeasuredRun) -> float | Absent | None:
    """Share of reported objects inside their 95 % region; None without reports."""
    objects_m = [thing.position_m for thing in cast("MappingScenario", run.scenario).object]
    if not objects_m:
        return NOT_APPLICABLE
    last = [course[-1] for course in courses_m(run.recorder.rows("items"), run.setup.database, objects_m)]
    return sum(off_m <= region_m for off_m, region_m in last) / len(last) if last else None


def _first_given_up(run: MeasuredRun) -> Milestone | None:
    return next((milestone for milestone in run.milestones if milestone.name == "mapping_stopped"), None)


def given_up_s(run: MeasuredRun) -> float | Absent:
    """Time at which the first vehicle finally abandoned an unfinished area."""
    stopped = _first_given_up(run)
    return NOT_APPLICABLE if stopped is None else round(stopped.time_s, 4)


AT_ONCE_S = 1e-3  # tolerance for the end of a consultation round, which vehicles reach microseconds apart


def left_when_given_up(run: MeasuredRun) -> float | Absent:
    """Uncovered share of its area when the first vehicle gave up; the largest of several."""
    stopped = _first_given_up(run)
    if stopped is None:
        return NOT_APPLICABLE
    recorder = run.recorder
    jobs = {(group.name, role.name): role.job for group in run.scenario.group for role in group.role}
    held: set[str] = set()
    for time_s, vehicle, group, role, event in recorder.rows("roles"):
        if (
            vehicle != stopped.vehicle
            or time_s >= stopped.time_s - AT_ONCE_S
            or (area := jobs.get((group, role))) is None
        ):
            continue
        # Roles released in the very round in which the vehicle stopped still count as held.
        if event == "assigned":
            held.add(area)
        elif event == "left":
            held.discard(area)
    covered = {row[2:4] for row in recorder.rows("coverage") if row[0] <= stopped.time_s}
    cells = run.mission.world(run.seed).cells
    n_cells = Counter(area for area, _ in cells.values())
    n_covered = Counter(area for cell, (area, _) in cells.items() if cell in covered)
    return round(max((1.0 - n_covered[area] / n_cells[area] for area in held if area in n_cells), default=0.0), 4)


METRICS = (
    Metric("coverage_fraction", "", Better.HIGHER, "coverage", coverage_fraction, headline=True),
    Metric(
        "believed_fraction", "", Better.HIGHER, "believed coverage", believed_fraction,
        note="Only runs with navigation errors count.",
    ),
    *(
        Metric(
            f"time_to_{share}_s", "s", Better.LOWER, f"time to {share} % of the goal", time_to_s(share / 100.0),
            censored=True,
        )
        for share in SHARES
    ),
    Metric("duplicate_fraction", "", Better.LOWER, "double work", duplicate_fraction, headline=True),
    Metric("finds_inspected_fraction", "", Better.HIGHER, "features inspected", finds_inspected_fraction),
    Metric(
        "within_region_fraction", "", Better.NEITHER, "objects in the 95 % region", within_region_fraction,
        note="For positions fused from all observations; 0.95 if the reported uncertainties are correct.",
    ),
    Metric("least_mapped_fraction", "", Better.HIGHER, "least mapped fraction", least_mapped_fraction),
    Metric(
        "given_up_s", "s", Better.NEITHER, "time when mapping stopped", given_up_s,
        note="Only runs in which mapping stopped early count.",
    ),
    Metric(
        "left_when_given_up", "", Better.NEITHER, "share left when mapping stopped", left_when_given_up,
        note="Only runs in which mapping stopped early count.",
    ),
)  # fmt: skip


SHADE = 0.16


def first_mapped(results: RunResults) -> dict[tuple[int, int], tuple[float, str]]:
    """Return time (s) and vehicle of the first mapping of each cell (column, row)."""
    first: dict[tuple[int, int], tuple[float, str]] = {}
    for row in results.table("coverage").to_pylist():
        first.setdefault((row["cell_x"], row["cell_y"]), (row["time_s"], row["vehicle"]))
    return first


def draw_coverage(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw the mapped share (%) of the fleet and of each vehicle over time."""
    end_s = run_end_s(results)
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
    axes.set_xlim(0.0, end_s)
    axes.set_ylim(-2.0, 102.0)
    axes.set_xlabel(style.axis("time", "s"))
    axes.set_ylabel(style.axis("mapped", "%"))
    return "A cell counts for the vehicle that mapped it first."


def draw_mapped_cells(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw mapped cells in the tint of the vehicle that mapped them first."""
    from matplotlib.collections import PolyCollection

    cells = first_mapped(results)
    if not cells:
        return ""
    size_m = float(results.scenario_tables["world"]["cell_m"])
    squares = [
        [((c + right) * size_m, (r + up) * size_m) for right, up in ((0, 0), (1, 0), (1, 1), (0, 1))] for c, r in cells
    ]
    colours = [style.tint(style.looks[vehicle].colour, SHADE) for _, vehicle in cells.values()]
    axes.add_collection(PolyCollection(squares, facecolors=colours, edgecolors="face", linewidths=0.3), autolim=False)
    axes.fill([], [], color=style.tint(style.black, SHADE), linewidth=0, label="mapped cells")
    return "Cells are shaded in the colour of the vehicle that mapped them first."


def draw_objects(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw true objects with their class, and a cross for each classifier sighting."""
    objects = results.scenario_tables.get("object", [])
    if not objects:
        return ""
    seen = results.rows(SIGHTINGS.name)
    seen_m = [row["x_m"] for row in seen], [row["y_m"] for row in seen]
    axes.scatter(*seen_m, s=5, color=style.black, marker="x", alpha=0.4, linewidths=0.5)
    axes.scatter([], [], s=12, color=style.black, marker="x", label="sighting")
    east_m, north_m = zip(*(thing["position_m"] for thing in objects), strict=True)
    axes.scatter(east_m, north_m, s=40, marker="D", facecolors="none", edgecolors=style.black, label="object")
    for table in objects:
        axes.annotate(
            table["classification"], table["position_m"], xytext=(5, 4), textcoords="offset points", fontsize="x-small",
            annotation_clip=True,
        )  # fmt: skip
    return f"Vehicles do not know the positions of objects; n = {len(seen)} sightings."


def draw_places(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw the error of fused object places over the reported radius, after each observation."""
    scenario = results.scenario_tables
    objects_m = [thing["position_m"] for thing in scenario.get("object", [])]
    rows = (tuple(row.values()) for row in results.table("items").to_pylist())
    courses = list(courses_m(rows, [entry["name"] for entry in scenario["vehicle"]], objects_m)) if objects_m else []
    all_m = [entry for course in courses for entry in course]
    for number, course in enumerate(courses):
        off_m, region_m = zip(*course, strict=True)
        label = "after each observation" if not number else None
        axes.plot(region_m, off_m, color=style.grey, linewidth=0.6, marker="o", markersize=2.5, label=label)
    last = [course[-1] for course in courses]
    axes.scatter(
        [entry[1] for entry in last], [entry[0] for entry in last], s=40, marker="D", facecolors="none",
        edgecolors=style.black, label="after the last observation", zorder=3,
    )  # fmt: skip
    end_m = round_up(max((max(entry) for entry in all_m), default=1.0))
    axes.plot([0.0, end_m], [0.0, end_m], color=style.black, linestyle="--", linewidth=0.8, label="edge of the region")
    axes.set_xlim(0.0, end_m)
    axes.set_ylim(0.0, end_m)
    axes.set_xlabel(style.axis("radius of the 95 % region", "m"))
    axes.set_ylabel(style.axis("position error", "m"))
    n_in = sum(off_m <= region_m for off_m, region_m in all_m)
    n_last = sum(off_m <= region_m for off_m, region_m in last)
    return (
        f"Below the line the object lies in the reported region: {n_last} of {len(last)} objects after the last "
        f"observation, {n_in} of n = {len(all_m)} estimates."
    )


FIGURES: tuple[Declared, ...] = (
    Figure("coverage", "Mapped share of the areas over mission time", draw_coverage, needs=("coverage",)),
    Figure(
        "places", "Position error of objects over reported uncertainty", draw_places, needs=(SIGHTINGS.name, "items")
    ),
    Layer("mapped cells", draw_mapped_cells, needs=("coverage",)),
    Layer("objects", draw_objects),
    Mark("mapping_stopped", "mapping stopped early"),
    Mark("found", "feature found"),
    Mark("inspected", "feature inspected"),
)
