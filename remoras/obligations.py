"""Obligations: what a role of a group owes by a deadline, and whether it was fulfilled, as the heads of the group know.

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

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from remoras.activities import Objective
from remoras.beliefs import Key
from remoras.recorder import TIME, VEHICLE, Column, Recorder, Table
from remoras.work import Job

if TYPE_CHECKING:
    from remoras.vehicle import Vehicle

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
        recorder.declare(OBLIGATIONS)
        self._rows = recorder.rows(OBLIGATIONS.name)
        self._states: dict[tuple[str, Obligation], State] = {}

    def judge(self, vehicles: Iterable[Vehicle], now_s: float) -> None:
        """Let all heads judge; a row for every state that is new."""
        for vehicle in vehicles:
            for one in self._declared if vehicle.is_alive else ():
                if vehicle.social.leads(one.group):
                    self._judge(vehicle, one, now_s)

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
        self._rows.append(row)

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
