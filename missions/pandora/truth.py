"""Ground truth of the Pandora mission: events at the structure, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

from exchange.arithmetic import distance
from missions.meeting.meeting import Meeting
from missions.meeting.truth import JobTruth
from missions.metric import MeasuredRun
from missions.pandora.structure import LOOKS, TURNS, PlannedPart, Structure
from remoras.faults import OVER
from remoras.mission import FleetView, Milestone
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table, Unread
from remoras.work import Job

if TYPE_CHECKING:
    from missions.pandora.scenario import PandoraScenario


FAULTS = {"slow": "thruster", "sensor": "camera dead", "biased": "camera drifts", "drains": "energy"}
"""Correct diagnosis by kind of vehicle fault."""
UPSETS = {"moved": ("missing", "displaced"), "turned": ("turned",), "stuck": ("resists",)}
"""Correct anomalies by kind of upset."""
CURRENT = "current"
OF_CAMERAS = "camera"
"""Faults of other sensors are not assessed."""
AFTER_S = 1200.0
"""Time after the end of a cause in which findings still count: estimates decay stepwise."""


@dataclass(frozen=True, slots=True)
class SiteEvent:
    """Event at a vehicle, a part or (empty ``subject``) the water, with correct ``findings``."""

    kind: str
    subject: str
    findings: tuple[str, ...]
    from_s: float
    until_s: float = math.inf


@dataclass(frozen=True, slots=True)
class Found:
    """Finding of a vehicle about a subject."""

    time_s: float
    vehicle: str
    subject: str
    finding: str


def events_of(run: MeasuredRun) -> list[SiteEvent]:
    """Return the events of a run by start."""
    found = [
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
            found.append(SiteEvent(kind, vehicle, (FAULTS[kind],), begun.pop((vehicle, kind)), time_s))
    found += [SiteEvent(kind, vehicle, (FAULTS[kind],), from_s) for (vehicle, kind), from_s in begun.items()]
    scenario = cast("PandoraScenario", run.scenario)
    for surge in scenario.surges(run.seed):
        if surge.from_s < _last_s(run):
            found.append(SiteEvent(CURRENT, "", (CURRENT,), surge.from_s, surge.until_s))
    return sorted(found, key=lambda event: (event.from_s, event.kind, event.subject))


def _last_s(run: MeasuredRun) -> float:
    rows = run.recorder.rows("trajectories")
    return float(rows[-1][0]) if rows else 0.0


def findings_of(run: MeasuredRun) -> Iterator[Found]:
    """Yield findings of vehicles in order, except that all is sound."""
    for _, origin, _, recorded_s, subject, attribute, value, *_ in run.recorder.rows("items"):
        if attribute in ("diagnosis", "anomaly") and value != "sound":
            yield Found(recorded_s, origin, subject, value)


def is_of(found: Found, event: SiteEvent) -> bool:
    """Return True if a finding matches an event in kind, subject and time."""
    if found.finding not in event.findings or (event.subject and found.subject != event.subject):
        return False
    return event.from_s <= found.time_s <= event.until_s + AFTER_S


def detected_s(event: SiteEvent, found: list[Found]) -> float | None:
    """Time (s) from the start of an event to its first finding; None if undetected."""
    first = next((row for row in found if is_of(row, event)), None)
    return None if first is None else first.time_s - event.from_s


SERVICED = Table("serviced", (TIME, VEHICLE, Column("part", "str")))
"""True services: valve closed, anode clean, all points of a panel or chain inspected."""
MET = Table("met", (TIME, VEHICLE, Column("part", "str"), Column("kind", "str")))
"""First approach of a working vehicle to the planned place of an upset part."""
MET_M = 6.0
"""Distance of an approach."""


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
        stuck = {thing.name for thing in structure.things if thing.is_stuck}
        self._as_they_are = {
            name: replace(part, resists=True) if part.of in stuck else part for name, part in parts.items()
        }
        self._to_meet = {thing.name: thing for thing in structure.things if thing.upset}

    @property
    def goal_fraction(self) -> float:
        """Share of parts truly serviced."""
        return len(self._serviced) / len(self._parts) if self._parts else 1.0

    @property
    def jobs_as_they_are(self) -> Mapping[str, Job]:
        """Jobs with truly stuck valves."""
        return self._as_they_are

    @property
    def jobs_done(self) -> Collection[str]:
        """Jobs with truly serviced parts."""
        return {self._parts[name].name for name in self._serviced}

    def watch(self, fleet: FleetView, now_s: float) -> None:
        """Record services since the last call."""
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
        of = {part.name: name for name, part in self._parts.items()}
        for time_s, vehicle, job in self._rows:
            name = of[job]
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

    def close(self, fleet: FleetView, now_s: float) -> str:
        """Return the reason of failure, with unserviced parts."""
        left: Sequence[str] = [name for name in self._parts if name not in self._serviced]
        reason = super().close(fleet, now_s)
        if not left:
            return reason
        why = f"not serviced: {', '.join(left)}"
        return f"{reason}; {why}" if reason else why
