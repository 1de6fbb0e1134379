"""Ground truth, metrics and figures: charted tiles, recovered object, choreography.

A choreography is a state machine whose transitions are messages. It is sound if every state is reachable from the first
and leads to a final one. A message that the state does not allow is a violation, and so is an overdue one.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from exchange.arithmetic import distance
from missions.figure import Figure, Layer, RunResults, Style, run_end_s
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth, n_stated
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.trident.jobs import WORKING
from missions.trident.scenario import ChoreographyTable, MessageTable, TridentScenario
from missions.trident.services import ATTEMPTS, CHARTED, TARGET, Site, Tile
from remoras.mission import FleetView, Milestone
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Row, Table, Unread
from remoras.truth import within_reach

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CHOREOGRAPHY = Table("choreography", (
    TIME, VEHICLE, Column("state", "str"), Column("says", "str"), Column("subject", "str"), Column("value", "str"),
    Column("to", "str"), Column("violation", "str"),
))  # fmt: skip
"""Messages with state and successor. Violations keep the state; overdue ones lack a vehicle."""
PLAYING = {"assigned": True, "left": False}  # events of the table ``roles`` for begin and end of a role
PACKET_TIME, SENDER, ITEM_UIDS = 1, 2, 10


class StatedFact(NamedTuple):
    """First transmission of a fact, recorded earlier at ``recorded_s``."""

    time_s: float
    vehicle: str
    subject: str
    attribute: str
    value: str
    recorded_s: float


def unsound(
    states: Sequence[str], final: Iterable[str], arrows: Sequence[tuple[str, str]]
) -> Iterator[tuple[str, str]]:
    """Yield unreachable states and dead ends, with an explanation."""
    import networkx as nx  # slow to load

    graph = nx.DiGraph(arrows)
    graph.add_nodes_from(states)
    ends = [state for state in final if state in states]
    reached = {states[0], *nx.descendants(graph, states[0])}
    out = {*ends, *(state for end in ends for state in nx.ancestors(graph, end))}
    for state in states:
        if state not in reached:
            yield state, f"cannot be reached: no message leads to it from {states[0]}, the first state"
        if state not in out:
            yield (
                state,
                f"is a dead end: no message leads from it to a final state, which are {', '.join(ends) or 'none'}",
            )


class Monitor:
    """Check of one run against a pattern; a pattern without states disables it."""

    def __init__(self, pattern: ChoreographyTable, recorder: Recorder) -> None:
        self._states = {state.name: state for state in pattern.state}
        self._allowed: dict[str, list[MessageTable]] = defaultdict(list)
        for message in pattern.message:
            self._allowed[message.state].append(message)
        self._alphabet = {message.says for message in pattern.message}
        self._items, self._packets, self._roles = map(Unread, (recorder.items, recorder.packets, recorder.roles))
        self._plays: dict[tuple[str, str], list[tuple[float, bool]]] = defaultdict(list)
        self._is_by_role = any(message.by for message in pattern.message)
        self._rows = recorder.rows(CHOREOGRAPHY.name)
        self._unsaid: dict[str, list[StatedFact]] = {}
        self.state = pattern.state[0].name if pattern.state else ""
        self._since_s, self._is_overdue = 0.0, False

    def look(self, now_s: float) -> None:
        """Process transmissions since the last call."""
        if not self.state:
            return
        for uid, origin, _, recorded_s, subject, attribute, value, kind, _ in self._items:
            if attribute in self._alphabet and kind == "told":
                fact = StatedFact(0.0, origin, subject, attribute, value, recorded_s)
                self._unsaid.setdefault(uid.partition(".")[0], []).append(fact)
        if self._is_by_role:
            self._note_roles()
        for packet in self._packets:
            if self._unsaid:
                for stated in self._said(packet):
                    # The limit of the old state is checked before the message leaves it.
                    self._check_time(stated.time_s)
                    self._move(stated)
        self._check_time(now_s)

    def _said(self, packet: Row) -> Iterator[StatedFact]:
        for uid in packet[ITEM_UIDS]:
            block = self._unsaid.get(uid)
            # A relayed copy is no statement of its sender. A fact counts at its first transmission, received or not.
            if block is not None and block[0].vehicle == packet[SENDER]:
                yield from (fact._replace(time_s=packet[PACKET_TIME]) for fact in self._unsaid.pop(uid))

    def _note_roles(self) -> None:
        for time_s, vehicle, _, role, event in self._roles:
            if event in PLAYING:
                self._plays[vehicle, role].append((time_s, PLAYING[event]))

    def _is_by(self, message: MessageTable, fact: StatedFact) -> bool:
        """True if the sender is the required vehicle, or held the required role at recording time."""
        if message.by in ("", fact.vehicle):
            return True
        plays = False
        for time_s, begins in self._plays.get((fact.vehicle, message.by), ()):
            # A role released at the instant of the record still counts.
            if time_s > fact.recorded_s or (time_s == fact.recorded_s and not begins):
                break
            plays = begins
        return plays

    def _move(self, fact: StatedFact) -> None:
        allowed = self._allowed[self.state]
        fitting = [message for message in allowed if _fits(message, fact) and self._is_by(message, fact)]
        said_row = fact.time_s, fact.vehicle, self.state, fact.attribute, fact.subject, fact.value
        if not fitting:
            expected = "; ".join(_shown(message) for message in allowed) or "nothing"
            self._rows.append((*said_row, self.state, f"not allowed in state {self.state}; allowed: {expected}"))
            return
        self._rows.append((*said_row, fitting[0].to, ""))
        self.state, self._since_s, self._is_overdue = fitting[0].to, fact.time_s, False

    def _check_time(self, now_s: float) -> None:
        within_s = self._states[self.state].within_s
        if within_s is None or self._is_overdue or now_s - self._since_s <= within_s:
            return
        self._is_overdue = True
        expected = "; ".join(_shown(message) for message in self._allowed[self.state])
        late = f"overdue: nothing said in state {self.state} for {within_s:g} s; expected: {expected}"
        self._rows.append((self._since_s + within_s, "", self.state, "", "", "", self.state, late))


def _fits(message: MessageTable, fact: StatedFact) -> bool:
    return message.says == fact.attribute and message.value in ("", fact.value)


def _shown(message: MessageTable) -> str:
    value = f" {message.value}" if message.value else ""
    return f"{message.says}{value} by {message.by or 'any vehicle'}"


RECOVERY_SHARE = 0.5  # weight of the recovery in the goal; the rest is the map


class TridentTruth(JobTruth):
    """Referee of a run."""

    def __init__(self, meeting: Meeting, scenario: TridentScenario, recorder: Recorder, site: Site) -> None:
        super().__init__(meeting, WORKING, recorder)
        self._goal = scenario.mission.goal
        self._recovery = scenario.recovery.name
        self._site = site
        self._n_tiles = len(site.numbers)
        self._monitor = Monitor(scenario.choreography, recorder)
        self._new_tiles, self._attempts = Unread(recorder.rows(CHARTED.name)), Unread(recorder.rows(ATTEMPTS.name))
        self._statements = Unread(recorder.items)
        self._charted: set[Tile] = set()
        self.is_recovered = False

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        for _, _, column, row in self._new_tiles:
            self._charted.add((column, row))
        for time_s, vehicle, _, does, thing, _, succeeded in self._attempts:
            if succeeded:
                outcome = "held" if does == "hold" else "recovered" if thing == TARGET else "mistaken"
                self.milestones.append(Milestone(time_s, outcome, vehicle))
                self.is_recovered = self.is_recovered or outcome == "recovered"
        for _, origin, _, recorded_s, subject, attribute, *_ in self._statements:
            if attribute == "chosen":
                self.milestones.append(Milestone(recorded_s, "chosen", origin))
            elif attribute == "surveyedBy":  # a survey on request is no objective
                self.note(origin, subject, now_s)
        self._monitor.look(now_s)
        return super().observe(fleet, now_s)

    @property
    def charted_fraction(self) -> float:
        """Share of all tiles truly charted."""
        return len(self._charted) / self._n_tiles if self._n_tiles else 1.0

    @property
    def goal_fraction(self) -> float:
        return self._share(self.charted_fraction, self.is_recovered)

    def _share(self, charted: float, is_recovered: bool) -> float:
        mapping = min(1.0, charted / self._goal)
        return (1.0 - RECOVERY_SHARE) * mapping + RECOVERY_SHARE * is_recovered

    @property
    def jobs_done(self) -> Collection[str]:
        """Blocks reported as surveyed, and the recovery once it is real."""
        return {*(self._done - {self._recovery}), *((self._recovery,) if self.is_recovered else ())}

    def reachable_fraction(self, fleet: FleetView) -> float:
        jobs = self._jobs
        # Charting counts even if the survey was reported as done, recovery only while it is open.
        within = within_reach(jobs, self._groups, fleet, self.jobs_done)
        able = within_reach({name: jobs[name] for name in jobs if name != self._recovery}, self._groups, fleet, ())
        n_within = sum(block in able for tile, (block, _) in self._site.numbers.items() if tile not in self._charted)
        charted = (len(self._charted) + n_within) / self._n_tiles if self._n_tiles else 1.0
        return self._share(charted, self._recovery in within)

    def reasons(self, fleet: FleetView, now_s: float) -> Iterator[str]:
        """Check the last messages; yield reasons of failure, with what is not recovered or charted."""
        self._monitor.look(now_s)
        yield from super().reasons(fleet, now_s)
        if not self.is_recovered:
            yield "the target is not recovered"
        if self.charted_fraction < self._goal:
            yield f"{self.charted_fraction:.0%} of the site charted of {self._goal:.0%}"


# Results ----------------------------------------------------------------------------------------


def recovered(run: MeasuredRun) -> bool:
    """True if the target was truly recovered."""
    return target_recovered_s(run) is not None


def target_recovered_s(run: MeasuredRun) -> float | None:
    """Time of the true recovery of the target."""
    return next((time_s for time_s, thing in _handled(run) if thing == TARGET), None)


def n_mistaken(run: MeasuredRun) -> int:
    """Number of decoys recovered instead of the target."""
    return len({thing for _, thing in _handled(run) if thing != TARGET})


def _handled(run: MeasuredRun) -> list[tuple[float, str]]:
    return [(row[0], row[4]) for row in run.recorder.rows(ATTEMPTS.name) if row[3] == "handle" and row[-1]]


def charted_fraction(run: MeasuredRun) -> float:
    """Share of all tiles truly charted."""
    n_tiles = sum(len(block.tiles) for block in cast(Site, run.mission.world(run.seed)).blocks)
    return len({row[2:4] for row in run.recorder.rows(CHARTED.name)}) / n_tiles if n_tiles else 1.0


def n_violations(run: MeasuredRun) -> int | Absent:
    """Number of violations of the choreography."""
    if not cast(TridentScenario, run.scenario).choreography.state or not run.recorder.rows("packets"):
        return NOT_APPLICABLE
    return sum(bool(row[-1]) for row in run.recorder.rows(CHOREOGRAPHY.name))


def navigation_error_m(run: MeasuredRun) -> float | Absent:
    """Greatest error of the positions reported by submerged vehicles."""
    submerged = {vehicle.name for vehicle in run.scenario.vehicle if vehicle.depth_m > 1.0}
    rows, tick_s = run.recorder.rows("trajectories"), run.scenario.scenario.tick_s
    ways = {name: [(row[2], row[3]) for row in rows if row[1] == name] for name in submerged}
    off_m = []
    for _, origin, _, recorded_s, _, attribute, value, *_ in run.recorder.rows("items"):
        if attribute == "position" and len(ways.get(origin, ())) > 1:
            way, place = ways[origin], recorded_s / tick_s
            before = min(int(place), len(way) - 2)
            share, (x_m, y_m), (to_x_m, to_y_m) = place - before, way[before], way[before + 1]
            east, north = (float(part) for part in value.removeprefix("POINT (").removesuffix(")").split())
            off_m.append(distance((x_m + share * (to_x_m - x_m), y_m + share * (to_y_m - y_m)), (east, north)))
    return round(max(off_m), 3) if off_m else NOT_APPLICABLE


METRICS = (
    Metric("recovered", "", Better.HIGHER, "target recovered", recovered, headline=True),
    Metric(
        "target_recovered_s", "s", Better.LOWER, "time to the recovery of the target", target_recovered_s,
        headline=True, censored=True,
    ),
    Metric("charted_fraction", "", Better.HIGHER, "share of the site charted", charted_fraction, headline=True),
    Metric("n_mistaken", "", Better.LOWER, "decoys recovered", n_mistaken),
    Metric("n_choices", "", Better.LOWER, "choices of a candidate", lambda run: n_stated(run, "chosen")),
    Metric("n_requests", "", Better.NEITHER, "requests for services", lambda run: n_stated(run, "requestedOf")),
    Metric("n_violations", "", Better.LOWER, "violations of the choreography", n_violations),
    Metric(
        "navigation_error_m", "m", Better.LOWER, "largest navigation error", navigation_error_m,
        note="Of positions reported by submerged vehicles, which are rounded to 0.5 m.",
    ),
)  # fmt: skip


USES = {"Surveying", "Ranging", "Reacquiring", "Holding", "Handling"}


def statuses(results: RunResults) -> dict[str, list[tuple[float, str]]]:
    """Return time and status of each service, in order of advertisement."""
    reports: dict[str, list[tuple[float, str]]] = {}
    for row in results.table("items").to_pylist():
        if row["attribute"] == "serviceStatus":
            reports.setdefault(row["subject"], []).append((row["recorded_s"], row["value"]))
    return reports


def uses(results: RunResults, services: Any) -> list[tuple[str, str, float, float]]:
    """Return vehicle, service, begin and end (s) of every step bound to one of ``services``."""
    end_s = run_end_s(results)
    running: dict[tuple[str, str, str, int], tuple[str, float]] = {}
    marks = []
    for row in results.table("plans").to_pylist():
        key = row["vehicle"], row["role"], row["argument"], row["node"]
        service = next((name for name in services if name in row["task"]), None)
        if row["task"].partition("(")[0] not in USES or service is None:
            continue
        if row["status"] == "running":
            running.setdefault(key, (service, row["time_s"]))
        elif key in running:
            used, from_s = running.pop(key)
            marks.append((row["vehicle"], used, from_s, row["time_s"]))
    marks += [(key[0], used, from_s, end_s) for key, (used, from_s) in running.items()]
    return sorted(marks, key=lambda mark: mark[2])


def draw_services(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw a lane per service: grey while it reports to work, bars while plans use it."""
    reports, end_s = statuses(results), run_end_s(results)
    names = list(reports)
    for lane, name in enumerate(names):
        times = [*reports[name], (end_s, "")]
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
        bar = names.index(service) - 0.3 + (list(style.looks).index(vehicle) + 0.5) * height
        axes.barh(bar, to_s - from_s, left=from_s, height=height, color=colour, label=label)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlim(0.0, end_s)
    axes.set_xlabel(style.axis("mission time", "s"))
    return (
        "Grey: the service reports that it works; a cross: that it has failed. Coloured: a plan step of that vehicle "
        "is bound to it. Choices and fixes are not shown, since they are no steps."
    )


def draw_choreography(axes: Axes, results: RunResults, style: Style) -> str:
    """Draw states over time with messages and violations."""
    rows, end_s = results.table(CHOREOGRAPHY.name).to_pylist(), run_end_s(results)
    pattern = results.scenario_tables.get("choreography", {})
    states = [state["name"] for state in pattern.get("state", [])]
    moves = [row for row in rows if not row["violation"]]
    line = [(0.0, states[0])] if states else []
    line += [(row["time_s"], row["to"]) for row in moves]
    line += [(end_s, line[-1][1])] if line else []
    axes.step([t for t, _ in line], [states.index(s) for _, s in line], where="post", color=style.grey)
    marks: dict[str, list[tuple[float, int]]] = defaultdict(list)
    for row in rows:
        marks["violation" if row["violation"] else row["vehicle"]].append((row["time_s"], states.index(row["to"])))
    for name, own in marks.items():
        look = style.looks.get(name)
        marker, colour = (look.marker, look.colour) if look else ("x", style.black)
        axes.plot([t for t, _ in own], [n for _, n in own], marker, color=colour, label=name)
    axes.set_yticks(range(len(states)), states)
    axes.set_xlim(0.0, end_s)
    axes.set_xlabel(style.axis("mission time", "s"))
    n = len(marks["violation"])
    return f"A mark is the first transmission of a message by that vehicle. Violations of the pattern: {n}."


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
    return "Charted tiles (ground truth) have the colour of the vehicle that charted them first."


FIGURES = (
    Figure("services", "Services over mission time", draw_services, needs=("items", "plans")),
    Figure("choreography", "Choreography over mission time", draw_choreography, needs=(CHOREOGRAPHY.name,)),
    Layer("site", draw_site, needs=(CHARTED.name, ATTEMPTS.name)),
)
