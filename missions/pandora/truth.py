"""Ground truth, metrics and figures: events at the structure, services, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

from exchange.arithmetic import distance
from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style, draw_counts, run_end_s
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JOBS, JobTruth, first_s
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.pandora.scenario import PandoraScenario, job_of
from missions.pandora.structure import LOOKS, TURNS, PlannedPart, Structure
from remoras.faults import OVER
from remoras.mission import FleetView, Milestone
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table, Unread
from remoras.work import Job

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FAULTS = {"slow": "thruster", "sensor": "camera dead", "biased": "camera drifts", "drains": "energy"}
"""Correct diagnosis by kind of vehicle fault."""
UPSETS = {"moved": ("missing", "displaced"), "turned": ("turned",), "stuck": ("resists",)}
"""Correct anomalies by kind of upset."""
FOUND_BY = ("diagnosis", "anomaly")  # attributes of findings
CURRENT = "current"
OF_CAMERAS = "camera"  # faults of other sensors are not assessed
AFTER_S = 1200.0  # time after the end of a cause in which findings still count: estimates decay stepwise


@dataclass(frozen=True, slots=True)
class SiteEvent:
    """Event at a vehicle, a part or (empty ``subject``) the water, with correct ``findings``."""

    kind: str
    subject: str
    findings: tuple[str, ...]
    from_s: float
    until_s: float = math.inf

    def explains(self, time_s: float, subject: str, finding: str) -> bool:
        """Return True if a finding matches the event in kind, subject and time."""
        is_of_kind = finding in self.findings and self.subject in ("", subject)
        return is_of_kind and self.from_s <= time_s <= self.until_s + AFTER_S


def events_of(run: MeasuredRun) -> list[SiteEvent]:
    """Return the events of a run by start."""
    events = [
        SiteEvent(kind, part, UPSETS[kind], time_s)
        for time_s, _, part, kind in run.recorder.rows(MET.name)
    ]  # fmt: skip
    begun: dict[tuple[str, str], float] = {}
    for time_s, vehicle, kind, detail in run.recorder.rows("faults"):
        if kind not in FAULTS or (kind in ("sensor", "biased") and not detail.startswith((OF_CAMERAS, OVER))):
            continue
        if not detail.startswith(OVER):
            begun[vehicle, kind] = time_s
        elif (vehicle, kind) in begun:
            events.append(SiteEvent(kind, vehicle, (FAULTS[kind],), begun.pop((vehicle, kind)), time_s))
    events += [SiteEvent(kind, vehicle, (FAULTS[kind],), from_s) for (vehicle, kind), from_s in begun.items()]
    scenario = cast(PandoraScenario, run.scenario)
    rows = run.recorder.rows("trajectories")
    for surge in scenario.surges(run.seed):
        if rows and surge.from_s < rows[-1][0]:
            events.append(SiteEvent(CURRENT, "", (CURRENT,), surge.from_s, surge.until_s))
    return sorted(events, key=lambda event: (event.from_s, event.kind, event.subject))


def findings_of(run: MeasuredRun) -> list[tuple[float, str, str]]:
    """Return time (s), subject and kind of the findings of vehicles in order, except that all is sound."""
    return [
        (recorded_s, subject, value)
        for _, _, _, recorded_s, subject, attribute, value, *_ in run.recorder.rows("items")
        if attribute in FOUND_BY and value != "sound"
    ]


SERVICED = Table("serviced", (TIME, VEHICLE, Column("part", "str")))
"""True services: valve closed, anode clean, all points of a panel or chain inspected."""
MET = Table("met", (TIME, VEHICLE, Column("part", "str"), Column("kind", "str")))
"""First approach of a working vehicle to the planned place of an upset part."""
MET_M = 6.0


class PandoraTruth(JobTruth):
    """Referee of services by tools and cameras."""

    work = "service"
    ends_with_meeting = True

    def __init__(
        self,
        meeting: Meeting,
        objective: str,
        recorder: Recorder,
        structure: Structure,
        parts: Mapping[str, PlannedPart],
    ) -> None:
        super().__init__(meeting, objective, recorder)
        self._looks, self._turns = Unread(recorder.rows(LOOKS.name)), Unread(recorder.rows(TURNS.name))
        self._serviced_rows, self._met_rows = recorder.rows(SERVICED.name), recorder.rows(MET.name)
        self._left: dict[str, set[int]] = {
            thing.name: set(range(len(thing.points_m)))
            for thing in structure.things
            if thing.kind in ("Panel", "Chain")
        }
        self._parts, self._serviced = {part.of: part for part in parts.values()}, set[str]()
        self._states = {thing.name: thing.state for thing in structure.things if thing.kind == "Valve"}
        stuck = {thing.name for thing in structure.things if thing.upset == "stuck"}
        self._as_they_are = {
            name: replace(part, resists=True) if part.of in stuck else part for name, part in parts.items()
        }
        self._to_meet = {thing.name: thing for thing in structure.things if thing.upset}

    @property
    def goal_fraction(self) -> float:
        return len(self._serviced) / len(self._parts) if self._parts else 1.0

    @property
    def jobs_as_they_are(self) -> Mapping[str, Job]:
        return self._as_they_are

    @property
    def jobs_done(self) -> Collection[str]:
        return {self._parts[name].name for name in self._serviced}

    def watch(self, fleet: FleetView, now_s: float) -> None:
        claimed = len(self._done)
        super().watch(fleet, now_s)
        for time_s, vehicle, name, point in self._looks:
            left = self._left.get(name)
            if left is not None and point in left:
                left.remove(point)
                if not left:
                    self._note(time_s, vehicle, name)
        for time_s, vehicle, name, state in self._turns:
            if name in self._states:
                self._states[name] = state
                # A released valve that is turned again opens, which undoes the service.
                if state == "open" and name in self._serviced:
                    self._serviced.remove(name)
            if state != "open":
                self._note(time_s, vehicle, name)
        if claimed < len(self._done):
            self._note_turned(now_s)
        self._meet(fleet, now_s)

    def _note(self, time_s: float, vehicle: str, name: str) -> None:
        if name not in self._serviced:
            self._serviced.add(name)
            self._serviced_rows.append((time_s, vehicle, name))

    def _note_turned(self, now_s: float) -> None:
        """Count an initially closed valve once reported done and still closed."""
        parts = {part.name: name for name, part in self._parts.items()}
        for time_s, vehicle, job in self._rows:
            name = parts[job]
            if self._states.get(name) == "closed" and name not in self._serviced:
                self._note(max(time_s, now_s), vehicle, name)

    def _meet(self, fleet: FleetView, now_s: float) -> None:
        for name in list(self._to_meet):
            at_m, upset = self._parts[name].place_m, self._to_meet[name].upset
            for vehicle in fleet.vehicles:
                near = distance(vehicle.position_m, at_m) <= MET_M and vehicle.sensing
                if near and any(
                    objective.argument == self._parts[name].name for objective in vehicle.objectives_of(vehicle.name)
                ):
                    del self._to_meet[name]
                    self._met_rows.append((now_s, vehicle.name, name, upset))
                    self.milestones.append(Milestone(now_s, f"met_{upset}", vehicle.name))
                    break

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        yield from super().reasons(fleet, now_s)
        if left := [name for name in self._parts if name not in self._serviced]:
            yield f"not serviced: {', '.join(left)}"


# Results ----------------------------------------------------------------------------------------


REPAIRED = "failed step"  # kind of fault rows for plan repairs after a failed step
HOME_M = 25.0  # distance from start or rally point within which an empty vehicle is not lost


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


def delays_s(run: MeasuredRun) -> list[float | None]:
    """Time (s) from the begin of each event to its first finding; None if undetected."""
    findings = findings_of(run)
    return [
        next((found[0] - event.from_s for found in findings if event.explains(*found)), None)
        for event in events_of(run)
    ]


def detected_fraction(run: MeasuredRun) -> float | Absent:
    """Share of events that were detected."""
    taken_s = delays_s(run)
    return (len(taken_s) - taken_s.count(None)) / len(taken_s) if taken_s else NOT_APPLICABLE


def n_missed(run: MeasuredRun) -> int:
    """Events undetected at the end."""
    return delays_s(run).count(None)


def time_to_detect_s(run: MeasuredRun) -> float | Absent | None:
    """Mean time from the begin of a detected event to its first finding."""
    taken_s = delays_s(run)
    detected = [delay_s for delay_s in taken_s if delay_s is not None]
    if not taken_s:
        return NOT_APPLICABLE
    return math.fsum(detected) / len(detected) if detected else None


def n_false_alarms(run: MeasuredRun) -> int:
    """Findings without a cause."""
    events = events_of(run)
    return sum(not any(event.explains(*found) for event in events) for found in findings_of(run))


def n_repairs(run: MeasuredRun) -> int:
    """Number of plan repairs after failed steps."""
    return sum(row[2] == REPAIRED for row in run.recorder.rows("faults"))


def n_lost(run: MeasuredRun) -> int:
    """Vehicles whose battery ran out away from their start and from rally points."""
    empty_s = {row[1]: row[0] for row in run.recorder.rows("faults") if row[2] == "energy"}
    scenario = cast(PandoraScenario, run.scenario)
    at_m: dict[str, tuple[float, float]] = {}
    for t_s, name, x_m, y_m, *_ in run.recorder.rows("trajectories") if empty_s else ():
        # A vehicle without energy drifts; its place at the failure counts.
        if t_s <= empty_s.get(name, -1.0):
            at_m[name] = x_m, y_m
    homes_m = [point.position_m for point in scenario.rally_point]
    return sum(
        all(distance(at_m[vehicle.name], home_m) > HOME_M for home_m in (vehicle.start_m, *homes_m))
        for vehicle in scenario.vehicle
        if vehicle.name in at_m
    )


METRICS = (
    Metric(
        "serviced_fraction", "", Better.HIGHER, "share of parts serviced", lambda run: run.goal_fraction,
        headline=True,
    ),
    Metric("n_false_claims", "", Better.LOWER, "parts falsely reported as done", n_false_claims, headline=True),
    Metric(
        "last_serviced_s", "s", Better.LOWER, "time until all parts are serviced", last_serviced_s, headline=True,
        censored=True,
    ),
    Metric("detected_fraction", "", Better.HIGHER, "share of faults detected", detected_fraction),
    Metric(
        "time_to_detect_s", "s", Better.LOWER, "mean time to detect", time_to_detect_s, headline=True,
        note="Undetected faults do not count.",
    ),
    Metric("n_missed", "", Better.LOWER, "faults missed", n_missed, headline=True),
    Metric("n_false_alarms", "", Better.LOWER, "false alarms", n_false_alarms, headline=True),
    Metric("n_repairs", "", Better.NEITHER, "plan repairs", n_repairs, headline=True),
    Metric("n_lost", "", Better.LOWER, "vehicles lost without energy", n_lost),
)  # fmt: skip


def draw_serviced(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw parts over time: taken for done and truly serviced."""
    taken = first_s(results)
    serviced = {row["part"]: row["time_s"] for row in reversed(results.rows(SERVICED.name))}
    curves = (
        ("reported as done", taken.values(), "--", style.grey), ("truly serviced", serviced.values(), "-", style.black),
    )  # fmt: skip
    draw_counts(axes, results, style, curves, "parts")
    return "Where the dashed line is above the other, parts are falsely reported as done."


def draw_findings(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw findings of vehicles and true events over time, a row per kind."""
    findings = [row for row in results.rows("items") if row["attribute"] in FOUND_BY and row["value"] != "sound"]
    befell = [(row["time_s"], f"{row['kind']}: {row['vehicle']}") for row in results.rows("faults")
              if row["kind"] in FAULTS and row["detail"] != "over"]  # fmt: skip
    befell += [(row["time_s"], f"{row['kind']}: {row['part']}") for row in results.rows(MET.name)]
    names = list(dict.fromkeys([*(name for _, name in befell), *(row["value"] for row in findings)]))
    for time_s, name in befell:
        axes.plot(time_s, names.index(name), marker="|", markersize=14, color=style.black, linestyle="none")
    axes.plot([], [], marker="|", color=style.black, linestyle="none", label="fault or upset")
    for vehicle, look in style.looks.items():
        own = [row for row in findings if row["origin"] == vehicle]
        axes.plot([row["time_s"] for row in own], [names.index(row["value"]) for row in own], marker=look.marker,
                  color=look.colour, linestyle="none", label=f"found by {vehicle}")  # fmt: skip
    axes.set_yticks(range(len(names)), names, fontsize="x-small")
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlim(0.0, run_end_s(results))
    axes.set_xlabel(style.axis("time", "s"))
    return "An upset occurs when a vehicle that works on the part comes near."


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
    Figure("findings", "True faults and upsets, and findings of the vehicles", draw_findings, needs=("items",)),
    Layer("structure", draw_upset, needs=(SERVICED.name,)),
    Mark("job_done", "part done"),
)
