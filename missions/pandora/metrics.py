"""Metrics and figures of the Pandora mission."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

from exchange.arithmetic import distance
from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style, draw_counts, last_position_s
from missions.meeting.truth import JOBS
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.pandora.scenario import job_of
from missions.pandora.truth import FAULTS, MET, SERVICED, detected_s, events_of, findings_of, is_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from missions.pandora.scenario import PandoraScenario


REPAIRED = "failed step"
"""Kind of fault rows for plan repairs after a failed step."""
HOME_M = 25.0
"""Distance from start or rally point within which an empty vehicle is not lost."""


def serviced_fraction(run: MeasuredRun) -> float:
    """Share of parts truly serviced at the end."""
    return run.goal_fraction


def n_false_claims(run: MeasuredRun) -> int:
    """Parts taken for done without service and without a reported failure."""
    serviced = {job_of(row[2]) for row in run.recorder.rows(SERVICED.name)}
    failed = {
        job_of(row[4]) for row in run.recorder.rows("items") if row[5] == "outcome" and row[6] == "failed"
    }  # fmt: skip
    return len({row[2] for row in run.recorder.rows(JOBS.name)} - serviced - failed)


def last_serviced_s(run: MeasuredRun) -> float | None:
    """Time at which all parts were truly serviced; None if some were not."""
    rows = run.recorder.rows(SERVICED.name)
    return float(rows[-1][0]) if rows and run.goal_fraction == 1.0 else None


def detected_fraction(run: MeasuredRun) -> float | Absent:
    """Share of events that were detected."""
    events, found = events_of(run), list(findings_of(run))
    if not events:
        return NOT_APPLICABLE
    return sum(detected_s(event, found) is not None for event in events) / len(events)


def n_missed(run: MeasuredRun) -> int:
    """Events undetected at the end."""
    found = list(findings_of(run))
    return sum(detected_s(event, found) is None for event in events_of(run))


def time_to_detect_s(run: MeasuredRun) -> float | Absent | None:
    """Mean time from the begin of a detected event to its first finding."""
    events, found = events_of(run), list(findings_of(run))
    if not events:
        return NOT_APPLICABLE
    taken_s = [one for event in events if (one := detected_s(event, found)) is not None]
    return math.fsum(taken_s) / len(taken_s) if taken_s else None


def n_false_alarms(run: MeasuredRun) -> int:
    """Findings without a cause."""
    events = events_of(run)
    return sum(not any(is_of(finding, event) for event in events) for finding in findings_of(run))


def n_repairs(run: MeasuredRun) -> int:
    """Number of plan repairs after failed steps."""
    return sum(row[2] == REPAIRED for row in run.recorder.rows("faults"))


def n_lost(run: MeasuredRun) -> int:
    """Vehicles whose battery ran out away from their start and from rally points."""
    empty_s = {row[1]: row[0] for row in run.recorder.rows("faults") if row[2] == "energy"}
    scenario = cast("PandoraScenario", run.scenario)
    at_m: dict[str, tuple[float, float]] = {}
    for t_s, name, x_m, y_m, *_ in run.recorder.rows("trajectories") if empty_s else ():
        if t_s <= empty_s.get(name, -1.0):
            at_m[name] = x_m, y_m
    homes_m = [point.position_m for point in scenario.rally_point]
    return sum(
        all(distance(at_m[vehicle.name], home_m) > HOME_M for home_m in (vehicle.start_m, *homes_m))
        for vehicle in scenario.vehicle
        if vehicle.name in at_m
    )


METRICS = (
    Metric("serviced_fraction", "", Better.HIGHER, "share of parts serviced", serviced_fraction, headline=True),
    Metric("n_false_claims", "", Better.LOWER, "parts falsely taken for done", n_false_claims, headline=True),
    Metric(
        "last_serviced_s", "s", Better.LOWER, "time until all is serviced", last_serviced_s, headline=True,
        censored=True,
    ),
    Metric("detected_fraction", "", Better.HIGHER, "share of faults detected", detected_fraction),
    Metric(
        "time_to_detect_s", "s", Better.LOWER, "mean time to detect", time_to_detect_s, headline=True,
        note="Faults that were not detected do not count in it.",
    ),
    Metric("n_missed", "", Better.LOWER, "faults missed", n_missed, headline=True),
    Metric("n_false_alarms", "", Better.LOWER, "false alarms", n_false_alarms, headline=True),
    Metric("n_repairs", "", Better.NEITHER, "plan repairs", n_repairs, headline=True),
    Metric("n_lost", "", Better.LOWER, "vehicles lost for want of energy", n_lost),
)  # fmt: skip
"""Metrics of the mission, in summary order."""


FOUND_BY = ("diagnosis", "anomaly")
"""Attributes of findings."""


def draw_serviced(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw parts over time: taken for done and truly serviced."""
    taken = {row["job"]: row["time_s"] for row in reversed(results.rows(JOBS.name))}
    serviced = {row["part"]: row["time_s"] for row in reversed(results.rows(SERVICED.name))}
    curves = (
        ("taken for done", taken.values(), "--", style.grey), ("really serviced", serviced.values(), "-", style.black),
    )  # fmt: skip
    draw_counts(axes, style, last_position_s(results), curves, "parts")
    return "Where the dashed line is above the other, a vehicle takes for done what is not."


def draw_findings(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw findings of vehicles and true events over time, a row per kind."""
    findings = [row for row in results.rows("items") if row["attribute"] in FOUND_BY and row["value"] != "sound"]
    befell = [(row["time_s"], f"{row['kind']}: {row['vehicle']}") for row in results.rows("faults")
              if row["kind"] in FAULTS and row["detail"] != "over"]  # fmt: skip
    befell += [(row["time_s"], f"{row['kind']}: {row['part']}") for row in results.rows(MET.name)]
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
    """Draw chains as lines and unserviced parts as crosses."""
    scenario = results.scenario_tables
    for chain in scenario.get("chain", []):
        axes.plot(*zip(*chain["points_m"], strict=True), color=style.grey, linewidth=1.0, zorder=0)
    serviced = {row["part"] for row in results.rows(SERVICED.name)}
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
