"""Obligations: ``[[group.obligation]]``, what a role owes by a deadline, and whether it did, as the heads know.

Nobody is forced by an obligation and nobody acts on it; it is judged and put down. The holders of the role owe it
together: it is fulfilled once the objective of the role is reached, whoever has reached it. The job that is the
objective's argument has to be done; an objective without a job ends when the group has gathered.

=========  ===============  ======================================================================
from       to               when
=========  ===============  ======================================================================
           pending          the mission begins, or the vehicle begins to lead the group
pending    fulfilled        the head knows that it was reached by the deadline
pending    violated         the deadline is over, and the head does not know of it
violated   fulfilled        the head comes to know that it was reached by the deadline
violated   fulfilled late   the head comes to know that it was reached after the deadline
=========  ===============  ======================================================================

Each head judges by what it knows, so after a succession the new one judges anew. What is reached stays reached.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from pydantic import Field

from missions.errors import ConfigurationFault
from missions.feature import Feature, Joining
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.scenarios.ontologies import words_of
from missions.scenarios.tables import Positive, Raw, Section, entries, names_of, one_of
from remoras.activities import Objective
from remoras.beliefs import Key
from remoras.events import Part
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table
from remoras.work import Job
from worldmodel import OntologyError

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.mission import Mission
    from remoras.vehicle import Vehicle

KEY = "obligation"
PREFIX = "objective"
"""Attributes of roles whose name begins so are objectives."""
OBLIGATIONS = Table("obligations", (
    TIME, VEHICLE, Column("group", "str"), Column("role", "str"), Column("objective", "str"), Column("state", "str"),
    Column("deadline_s", "float", "s"), Column("reached_s", "float", "s"), Column("holders", "list"),
))  # fmt: skip
"""States of obligations in the view of ``vehicle``, which leads the group, each from ``time_s`` on; written in runs of
scenarios that have any. ``reached_s`` is when the objective was reached, null while that is not known; ``holders`` play
the role, as the vehicle knows."""
GATHERED_AT = "gatheredAt"


class State(Enum):
    """How it stands with an obligation."""

    PENDING = "pending"
    FULFILLED = "fulfilled"
    VIOLATED = "violated"
    LATE = "fulfilled late"


@dataclass(frozen=True, slots=True)
class Obligation:
    """The holders of ``role`` in ``group`` owe that its ``objective`` is reached by ``deadline_s``."""

    group: str
    role: str
    objective: str
    deadline_s: float


def judged(deadline_s: float, reached_s: float | None, now_s: float) -> State:
    """The state of an obligation, by what is known.

    Args:
        deadline_s: by which the objective has to be reached.
        reached_s: when it was; None while that is not known.
        now_s: time of the judgement.
    """
    if reached_s is not None:
        return State.FULFILLED if reached_s <= deadline_s else State.LATE
    return State.VIOLATED if now_s > deadline_s else State.PENDING


class Obligations:
    """Judges the obligations of a run, in the view of every vehicle that leads a group with any.

    Args:
        declared: obligations of all groups.
        jobs: of the mission, by name.
        recorder: takes the rows.
    """

    def __init__(self, declared: Iterable[Obligation], jobs: Mapping[str, Job], recorder: Recorder) -> None:
        self._declared = tuple(declared)
        self._jobs = jobs
        self._recorder = recorder
        self._states: dict[tuple[str, Obligation], State] = {}

    def judge(self, vehicles: Iterable[Vehicle], now_s: float) -> None:
        """Let all heads judge; a row for every state that is new."""
        self._recorder.declare(OBLIGATIONS)
        for vehicle in vehicles:
            for obligation in self._declared if vehicle.is_alive else ():
                if vehicle.social.leads(obligation.group):
                    self._judge(vehicle, obligation, now_s)

    def _judge(self, head: Vehicle, one: Obligation, now_s: float) -> None:
        key = head.name, one
        before = self._states.get(key)
        if before in (State.FULFILLED, State.LATE):
            return  # what is reached stays reached
        reached_s = self._reached_s(head, one)
        state = judged(one.deadline_s, reached_s, now_s)
        if state is before:
            return
        self._states[key] = state
        holders = list(head.social.present.members(one.group, one.role))
        about = one.group, one.role, one.objective
        if state is State.LATE and before is not State.VIOLATED:
            self._write(now_s, head.name, *about, State.VIOLATED.value, one.deadline_s, None, holders)
        self._write(now_s, head.name, *about, state.value, one.deadline_s, reached_s, holders)

    def _write(self, *row: object) -> None:
        self._recorder.rows(OBLIGATIONS.name).append(row)

    def _reached_s(self, head: Vehicle, one: Obligation) -> float | None:
        given = head.social.objectives.get((one.group, one.role, one.objective))
        if given is None:
            return None
        key = reached_by(given, self._jobs)
        return None if head.social.facts.get(key) is None else head.beliefs.observed_s(key)


def reached_by(objective: Objective, jobs: Mapping[str, Job]) -> Key:
    """The fact that says that an objective is reached: its job is done, or its group has gathered.

    Args:
        objective: that a role has; jobs: of the mission, by name.
    """
    job = jobs.get(objective.argument)
    return (GATHERED_AT, objective.group) if job is None else job.done


class ObligationTable(Section):
    """One ``[[group.obligation]]``."""

    role: str = Field(description="role of the group whose holders owe it")
    objective: str = Field(description="objective of the role that has to be reached")
    deadline_s: Positive = Field(description="time of the mission by which it has to be")


def obligations_of(scenario: Scenario) -> tuple[Obligation, ...]:
    """The obligations of all groups."""
    return tuple(
        Obligation(group.name, one.role, one.objective, one.deadline_s)
        for group in scenario.group
        for one in group.of_feature(KEY)
    )


def obligation_faults(raw: Raw, mission: type[Mission] | None) -> Iterator[ConfigurationFault]:
    """Obligations of roles that the group has not, for objectives that there are not, or said twice."""
    groups = [group for group in entries(raw, "group") if entries(group, KEY)]
    if not groups or mission is None:
        return
    known = _objectives(raw, mission)
    for group in groups:
        said: dict[tuple[str, str], int] = {}
        for number, entry in enumerate(entries(group, KEY), 1):
            key = f"group.{group.get('name')}.obligation.{number}"
            yield from one_of(f"{key}.role", entry.get("role"), names_of(group, "role"))
            yield from one_of(f"{key}.objective", entry.get("objective"), known)
            about = str(entry.get("role")), str(entry.get("objective"))
            if said.setdefault(about, number) != number:
                allowed = f"{about[0]} has an obligation for {about[1]} already, number {said[about]}: leave one out"
                yield ConfigurationFault(f"{key}.objective", f'"{about[1]}"', allowed)


def _objectives(raw: Raw, mission: type[Mission]) -> list[str]:
    """Names of the objectives that the ontology of a scenario has."""
    try:
        tbox = words_of(raw, mission)
    except (OntologyError, OSError):
        return []  # reported elsewhere
    names = (attribute.name for attribute in tbox.attributes if attribute.name.startswith(PREFIX))
    return sorted(name.removeprefix(PREFIX) for name in names)


def n_violated_obligations(run: MeasuredRun) -> int | Absent:
    """Obligations that no head knew to be fulfilled in time by the end of the run, though their deadline was over.

    What was reached late, or never judged for want of a head, counts. It does not apply without obligations.
    """
    declared = obligations_of(run.scenario)
    if not declared:
        return NOT_APPLICABLE
    states: dict[tuple[str, str, str], set[str]] = {}
    for row in run.recorder.rows(OBLIGATIONS.name):
        states.setdefault(row[2:5], set()).add(row[5])
    n_violated = 0
    for obligation in declared:
        known = states.get((obligation.group, obligation.role, obligation.objective), set())
        is_over = obligation.deadline_s < run.end_s or State.VIOLATED.value in known
        n_violated += is_over and State.FULFILLED.value not in known
    return n_violated


def part_of(joining: Joining) -> Part | None:
    """Let the heads of a fleet judge whenever its truth looks."""
    declared = obligations_of(joining.scenario)
    if not declared:
        return None
    obligations = Obligations(declared, joining.mission.jobs, joining.recorder)
    return Part(watch=obligations.judge)


FEATURE = Feature(
    {"group": {KEY: (tuple[ObligationTable, ...], Field((), description="what its roles owe, and by when"))}},
    part_of,
    obligation_faults,
    metrics=(Metric("n_violated_obligations", "", Better.LOWER, "violated obligations", n_violated_obligations),),
)
