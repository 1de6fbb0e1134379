"""Ground truth, metrics and figures of field work."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from exchange.arithmetic import distance
from missions.fieldwork.energy import BORED, BROUGHT, CAME, HALTED, LEAST_SHARE, Boring, ChargerSettings, Energies
from missions.fieldwork.jobs import LYING_AT, ON_LINE_M, Lift, SeaField, SurveyLine
from missions.figure import Declared, Figure, Layer, Mark, RunResults, Style, draw_counts
from missions.meeting.job_mission import THERE_M
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JOBS, JobTruth, done_s, first_s, mean_of_all_s
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from remoras.mission import FleetView
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table, Unread
from remoras.truth import left
from remoras.work import Job

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PASSAGE = "passage"
STANDS_MPS = 0.1
MARK_M = 5.0
PASSED_M = 1.5 * ON_LINE_M  # distance at which a mark counts as passed: off the line, and beyond the last stop
WAITS, LIFTED, SURVEYED = "waits", "lifted", "surveyed"  # events: a vehicle waits for others; the job was truly done
LIFTS = Table("lifts", (TIME, VEHICLE, Column("lift", "str"), Column("event", "str")))
"""First arrival at an object (``waits``) and true end of the lift (``lifted``)."""
ESCORTING = Table("escorting", (TIME, VEHICLE, Column("line", "str"), Column("event", "str")))
"""First arrival at the start of an escorted line (``waits``) and true end (``surveyed``)."""
ENERGY = Table(
    "energy", (TIME, VEHICLE, Column("boring", "str"), Column("event", "str"), Column("energy_j", "float", "J"))
)
"""Events at a drill site: ``halted`` drill, giver ``came``, had ``brought`` (J), ``bored``."""


class FieldTruth(JobTruth):
    """Referee of jobs, of which those in ``taking`` take several vehicles: waits and true completion."""

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, table: Table, taking: Collection[str]
    ) -> None:
        super().__init__(meeting, objective, recorder)
        self._events = recorder.rows(table.name)
        self._open = dict.fromkeys(taking)
        self._waited: set[str] = set()

    @property
    def jobs_done(self) -> Collection[str]:
        """Reported jobs; of those for several vehicles only the truly done."""
        return self._done - self._open.keys()

    def note_wait(self, vehicle: str, job: str, now_s: float) -> None:
        """Record the first vehicle that waits at a job."""
        if job not in self._waited:
            self._waited.add(job)
            self._events.append((now_s, vehicle, job, WAITS))

    def note_end(self, vehicle: str, job: str, event: str, now_s: float) -> None:
        """Record the true completion of a job."""
        del self._open[job]
        self._events.append((now_s, vehicle, job, event))


class LiftTruth(FieldTruth):
    """Referee of lifts: vehicles must hold all ends of an object for the whole duration."""

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, lifts: Mapping[str, Lift], world: SeaField
    ) -> None:
        super().__init__(meeting, objective, recorder, LIFTS, lifts)
        self._lifts = lifts
        self._ends = {name: lifts[name].ends_m(middle_m) for name, middle_m in world.items()}
        self._since_s: dict[str, float] = {}

    def watch(self, fleet: FleetView, now_s: float) -> None:
        super().watch(fleet, now_s)
        for name in list(self._open):
            present = [
                vehicle.name
                for end_m in self._ends[name]
                for vehicle in fleet.vehicles
                if vehicle.is_alive and distance(vehicle.position_m, end_m) <= THERE_M
            ]
            if present:
                self.note_wait(present[0], name, now_s)
            # A vehicle within reach of two ends takes only one of them.
            if len(set(present)) < len(self._ends[name]):
                self._since_s.pop(name, None)
            elif now_s - self._since_s.setdefault(name, now_s) >= self._lifts[name].stay_s:
                self.note_end(present[0], name, LIFTED, now_s)
                self.note(present[0], name, now_s)

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        yield from super().reasons(fleet, now_s)
        known = {subject for _, _, _, _, subject, attribute, *_ in self._items if attribute == LYING_AT}
        if hidden := ", ".join(name for name in self._open if name not in known):
            yield f"positions unknown to the vehicles: {hidden}"


class EscortTruth(FieldTruth):
    """Referee of escorted lines: all marks of a line must be passed with an escort within ``within_m``."""

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, lines: Mapping[str, SurveyLine], within_m: float
    ) -> None:
        super().__init__(meeting, objective, recorder, ESCORTING, lines)
        self._lines, self._within_m = lines, within_m
        self._marks = {name: {line.at(along_m) for along_m in marks_m(line.length_m)} for name, line in lines.items()}

    def watch(self, fleet: FleetView, now_s: float) -> None:
        super().watch(fleet, now_s)
        at_m = {vehicle.name: vehicle.position_m for vehicle in fleet.vehicles if vehicle.is_alive}
        escorted = {
            name: here_m
            for name, here_m in at_m.items()
            if any(other != name and distance(here_m, there_m) <= self._within_m for other, there_m in at_m.items())
        }
        for name in list(self._open):
            marks, start_m = self._marks[name], self._lines[name].place_m
            if name not in self._waited:
                auv = next((auv for auv, here_m in at_m.items() if distance(here_m, start_m) <= PASSED_M), None)
                if auv is not None:
                    self.note_wait(auv, name, now_s)
            for auv, here_m in escorted.items():
                marks -= {mark_m for mark_m in marks if distance(here_m, mark_m) <= PASSED_M}
                if not marks:
                    self.note_end(auv, name, SURVEYED, now_s)
                    break


class EnergyTruth(FieldTruth):
    """Referee of drill sites: events and true completion."""

    def __init__(
        self, meeting: Meeting, objective: str, recorder: Recorder, borings: Mapping[str, Boring], energies: Energies
    ) -> None:
        super().__init__(meeting, objective, recorder, ENERGY, borings)
        self._borings, self._energies, self._new_events = borings, energies, Unread(energies.events)
        self._starved: set[str] = set()
        self._halted_s: dict[str, float] = {}  # start of halts without a giver

    @property
    def jobs_as_they_are(self) -> Mapping[str, Job]:
        """Jobs by name; drill sites without energy are impossible for all."""
        # No vehicle has a drill without a name, so the job is impossible for all.
        return {**self._jobs, **{name: self._borings[name].model_copy(update={"drill": ""}) for name in self._starved}}

    def reachable_fraction(self, fleet: FleetView) -> float:
        self._starved = set() if self.helpers(fleet) else {
            name for name in self._open if not self._is_drill_charged(fleet, self._borings[name])
        }  # fmt: skip
        return super().reachable_fraction(fleet)

    def helpers(self, fleet: FleetView) -> frozenset[str]:
        """Return the remaining vehicles with energy for others."""
        chargers = [(vehicle.name, data.sensor(ChargerSettings)) for vehicle, data in left(fleet)]
        return frozenset(
            name for name, own in chargers if own is not None and own.of(name, self._energies).left_j > 0.0
        )

    def _is_drill_charged(self, fleet: FleetView, boring: Boring) -> bool:
        drills = [(vehicle.name, boring.drill_of(data)) for vehicle, data in left(fleet)]
        return any(
            own is not None and own.of(name, self._energies).left_j >= LEAST_SHARE * own.battery_j
            for name, own in drills
        )

    def watch(self, fleet: FleetView, now_s: float) -> None:
        super().watch(fleet, now_s)
        self._note_events()

    def _note_events(self) -> None:
        for event in self._new_events:
            self._events.append(event)
            if event[3] == BORED:
                self._open.pop(event[2], None)
            if event[3] == HALTED:
                self._halted_s[event[2]] = event[0]
            elif event[3] in (CAME, BORED):
                self._halted_s.pop(event[2], None)

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        """Record open transfers; yield reasons of failure, with drill sites without energy."""
        for key in list(self._energies.passing):
            self._energies.note_left(key, now_s)
        self._note_events()
        yield from super().reasons(fleet, now_s)
        if halted := [f"{hole} since {at_s:.0f} s" for hole, at_s in self._halted_s.items() if hole in self._open]:
            yield f"without energy: {', '.join(halted)}"


# Results ----------------------------------------------------------------------------------------


def mean_with_sites_s(run: MeasuredRun, table: Table, event: str) -> float:
    """Mean time of site surveys and truly done other jobs; undone ones count with the mission's duration."""
    scenario: Any = run.scenario
    sites = {site.name for site in scenario.site}
    surveyed_s = [time_s for name, time_s in done_s(run).items() if name in sites]
    return mean_of_all_s([*surveyed_s, *event_s(run, table.name, event).values()], len(scenario.jobs), run)


def event_s(run: MeasuredRun, table: str, event: str) -> dict[str, float]:
    """Time (s) of the last such event by subject, from a table (time, vehicle, subject, event)."""
    return {row[2]: row[0] for row in run.recorder.rows(table) if row[3] == event}


def mean_wait_s(run: MeasuredRun, table: Table, begin: str, end: str) -> float | None:
    """Mean time (s) from an event to the next ``end`` for the same subject, or the end of the run; None without any."""
    rows = run.recorder.rows(table.name)
    waits_s = []
    for begin_s, _, subject, event, *_ in rows:
        if event == begin:
            ends_s = (row[0] for row in rows if row[2:4] == (subject, end) and row[0] > begin_s)
            waits_s.append(min(ends_s, default=run.ended_s) - begin_s)
    return math.fsum(waits_s) / len(waits_s) if waits_s else None


def marks_m(length_m: float) -> list[float]:
    """Return the positions of marks along a line, every ``MARK_M`` from its start."""
    return [MARK_M * number for number in range(int(length_m / MARK_M) + 1)]


def mean_surveyed_s(run: MeasuredRun) -> float:
    """Mean time of line surveys; undone ones count with the mission's duration."""
    scenario: Any = run.scenario
    surveyed_s = done_s(run)
    for line, time_s in event_s(run, ESCORTING.name, SURVEYED).items():
        if line in surveyed_s:
            # A report before the escorted survey was complete is false, so the later time counts.
            surveyed_s[line] = max(surveyed_s[line], time_s)
    return mean_of_all_s(surveyed_s.values(), len(scenario.line), run)


def mean_delivered_s(run: MeasuredRun) -> float:
    """Mean time of deliveries; undone ones count with the mission's duration."""
    scenario: Any = run.scenario
    return mean_of_all_s(done_s(run).values(), len(scenario.delivery), run)


def blocked_s(run: MeasuredRun) -> float | Absent:
    """Total time (s) of all vehicles standing within the reef."""
    table = run.scenario.of_feature(PASSAGE)
    if table is None:
        return NOT_APPLICABLE
    west_m, east_m = table.x_m
    rows = run.recorder.rows("trajectories")
    tick_s: float = run.scenario.scenario.tick_s
    n_ticks: int = sum(west_m <= row[2] <= east_m and row[5] < STANDS_MPS for row in rows)
    return n_ticks * tick_s


def brought_j(run: MeasuredRun) -> float:
    """Energy transferred into batteries of drills."""
    return math.fsum(row[4] for row in run.recorder.rows(ENERGY.name) if row[3] == BROUGHT)


lower = partial(Metric, better=Better.LOWER, headline=True)
DONE = lower(
    "mean_done_s", "s", label="mean time until a job is done", of=partial(mean_with_sites_s, table=LIFTS, event=LIFTED)
)
WAIT = lower(
    "mean_wait_s", "s", label="mean wait at an object",
    of=partial(mean_wait_s, table=LIFTS, begin=WAITS, end=LIFTED),
)  # fmt: skip
RECOVERY_METRICS = (DONE, WAIT)
FERRY_METRICS = (
    lower("mean_delivered_s", "s", label="mean time until delivery", of=mean_delivered_s),
    lower("blocked_s", "s", label="time of vehicles stopped in the passage", of=blocked_s),
)
ESCORT_METRICS = (
    lower("mean_surveyed_s", "s", label="mean time until a line is surveyed", of=mean_surveyed_s),
    lower("mean_escort_s", "s", label="mean time of a vehicle at an escorted line",
          of=partial(mean_wait_s, table=ESCORTING, begin=WAITS, end=SURVEYED)),
)  # fmt: skip
RESUPPLY_METRICS = (
    replace(DONE, of=partial(mean_with_sites_s, table=ENERGY, event=BORED)),
    replace(WAIT, label="mean wait for energy", of=partial(mean_wait_s, table=ENERGY, begin=HALTED, end=CAME)),
    lower("brought_j", "J", label="energy brought", of=brought_j, headline=False),
)


def draw_jobs(axes: Axes, results: RunResults, style: Style, label: str, says: str) -> str:
    """Draw jobs done over time."""
    draw_counts(axes, results, style, [("fleet", first_s(results).values(), "-", style.black)], label)
    axes.locator_params("y", integer=True)
    return says


def draw_kinds(axes: Axes, results: RunResults, style: Style, table: Table, event: str, label: str, says: str) -> str:
    """Draw surveyed sites and truly done jobs of another kind over time."""
    column = table.columns[2].name
    done_s = {row[column]: row["time_s"] for row in results.table(table.name).to_pylist() if row["event"] == event}
    sites = {site["name"] for site in results.scenario_tables["site"]}
    sites_s = [time_s for job, time_s in first_s(results).items() if job in sites]
    curves = ("sites surveyed", sites_s, "-", style.black), (label, done_s.values(), "--", style.black)
    draw_counts(axes, results, style, curves, "done")
    axes.locator_params("y", integer=True)
    return says


def draw_reef(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw the reef with its passage."""
    scenario = results.scenario_tables
    reef = scenario.get(PASSAGE)
    if reef is None:
        return "There is no reef."
    (west_m, east_m), (south_m, north_m) = reef["x_m"], scenario["world"]["y_m"]
    for low_m, high_m in (
        (south_m, reef["y_m"] - reef["width_m"] / 2.0),
        (reef["y_m"] + reef["width_m"] / 2.0, north_m),
    ):
        axes.fill([west_m, east_m, east_m, west_m], [low_m, low_m, high_m, high_m], color=style.tint(style.grey, 0.4),
                  zorder=0, linewidth=0.0)  # fmt: skip
    return "Grey: the reef, which vehicles cross only by its passage."


def _figure(name: str, title: str, draw: partial[str], *tables: str) -> Figure:
    return Figure(name, f"{title} over mission time", draw, needs=(JOBS.name, *tables))


LIFTED_SAYS = "An object counts once vehicles have held all of its ends for the duration of a lift."
BORED_SAYS = "A hole counts once its drill has truly worked on it for the duration of drilling."
SURVEYED_SAYS = "A line counts once its vehicle has followed all of it, with an escort where required."
DELIVERED_SAYS = "A load counts once its vehicle has handed it over."
RECOVERY_FIGURES: tuple[Declared, ...] = (
    _figure("recovered", "Sites surveyed and objects lifted",
            partial(draw_kinds, table=LIFTS, event=LIFTED, label="objects lifted", says=LIFTED_SAYS), LIFTS.name),
    Mark("job_done", "job done"),
)  # fmt: skip
FERRY_FIGURES: tuple[Declared, ...] = (
    _figure("delivered", "Loads handed over", partial(draw_jobs, label="loads handed over", says=DELIVERED_SAYS)),
    Layer("reef", draw_reef),
    Mark("job_done", "load handed over"),
)
ESCORT_FIGURES: tuple[Declared, ...] = (
    _figure("surveyed", "Lines surveyed", partial(draw_jobs, label="lines surveyed", says=SURVEYED_SAYS)),
    Mark("job_done", "line surveyed"),
)
RESUPPLY_FIGURES: tuple[Declared, ...] = (
    _figure("sampled", "Sites surveyed and holes drilled",
            partial(draw_kinds, table=ENERGY, event=BORED, label="holes drilled", says=BORED_SAYS), ENERGY.name),
    Mark("job_done", "job done"),
)  # fmt: skip
