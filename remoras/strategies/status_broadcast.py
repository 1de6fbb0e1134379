"""Status broadcast: each vehicle repeats its mission state and predicts silent peers.

Every ``period_rounds`` a vehicle broadcasts its current job and the known finished jobs; repetition replaces
acknowledgement. From received states it predicts the end of each peer's job, plans for all members by the shared
allocator and takes the first job of its part. A vehicle without a part helps at a job with a vacancy if that saves
``join_s``, or repeats one that is late by ``doubt_rounds``.

Source: Sotzing, Lane 2010 (DELPHIS: broadcast of the mission state, prediction of silent partners, re-tasking).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Annotated, ClassVar

from remoras.database import VehicleData
from remoras.organisation import Group
from remoras.strategies.allocation import AllocationPlan, expected_end, joining, planned
from remoras.strategies.negotiator import JOIN, KnownFromStart, Member, frames, in_blocks, taking
from remoras.strategy import Heard, Move, Situation, Statable, Statement
from remoras.work import Outlook, Work

JOBS_PER_BLOCK = 8
RECENT_ROUNDS = 3
"""A jobless vehicle received within as many TDMA frames is free now, else since then."""


@dataclass(frozen=True, slots=True)
class JobWatch:
    """Job of a vehicle: start (s) and expected end (s)."""

    role: str
    since_s: float
    due_s: float


class Broadcaster(Member["StatusBroadcast"]):
    """Mission state as one vehicle knows it."""

    def __init__(self, me: str, group: Group, strategy: StatusBroadcast) -> None:
        super().__init__(me, group, strategy)
        self._at: dict[str, JobWatch] = {}  # last known of every vehicle
        self._reported: set[str] = set()  # jobs reported done
        self._helps = False  # knowingly at another vehicle's job
        self._awaited: dict[str, float] = {}  # due time (s) of jobs planned for idle vehicles

    def negotiate(self, situation: Situation) -> Move:
        """Process states, predict, release jobs done or taken earlier, take a job, broadcast."""
        for message in situation.heard:
            self._hear(message, situation.work)
        work = situation.work.knowing(self._reported)
        outlooks = {data.name: self._outlook(data, work, situation) for data in work.workers}
        doubted = {name for name, outlook in outlooks.items() if self._is_late(name, outlook.free_s, situation)}
        held = work.held_by(self._me)
        left = [
            role
            for role in situation.work.held_by(self._me)
            if role not in held or self._is_later(role.name, doubted, work)
        ]
        name = None
        if all(role in left for role in held):
            self._at.pop(self._me, None)
            name = self._choice(work, outlooks, doubted, situation)
            if name is not None:
                # Whole seconds, as sent: all vehicles compare the same times.
                self._at[self._me] = self._station(name, self._me, round(situation.now_s), work)
        left = [role for role in left if role.name != name]  # it stays, to help
        statements = [self._leaves(role.name) for role in left]
        if name is not None and name not in [role.name for role in held if role not in left]:
            statements.append(self._takes(name))
        if situation.round % self._with.period_rounds == 0 or statements:
            statements += self._state(work)
        return Move(tuple(statements), holding=bool(work.unfinished))

    def division(self) -> Mapping[str, str]:
        """Return the last known vehicle at each job."""
        return {watch.role: name for name, watch in self._at.items()}

    def _hear(self, message: Heard, work: Work) -> None:
        values = {attribute: value for subject, attribute, value in message.facts if subject == message.issuer}
        group, _, role = str(values.get("worksOn", "")).partition(".")
        known = self._at.get(message.issuer)
        if group == self._group.name and (known is None or known.role != role):
            self._at.pop(message.issuer, None)
            if any(candidate.name == role for candidate in work.roles):
                since_s = float(values.get("worksSince", message.time_s))
                self._at[message.issuer] = self._station(role, message.issuer, since_s, work)
        self._reported.update(subject for subject, attribute, _ in message.facts if attribute == "knownDone")

    def _station(self, role: str, vehicle: str, since_s: float, work: Work) -> JobWatch:
        specification, end = work.group.role(role), None
        if specification in work.roles:
            end = work.after(Outlook(since_s, work.position_m(vehicle)), work.database[vehicle], specification)
        return JobWatch(role, since_s, since_s if end is None else end.free_s)

    def _is_later(self, role: str, doubted: Collection[str], work: Work) -> bool:
        mine, database = self._at.get(self._me), work.database
        if mine is None:
            return False
        before = [
            name
            for name, watch in self._at.items()
            if watch.role == role and (watch.since_s, database[name].node) < (mine.since_s, database[self._me].node)
            if name not in doubted and name != self._me and name in work.members
        ]
        specification = work.group.role(role)
        # Without intention to help, one earlier member fills the job: of two equal choices only one continues.
        room = 1 if not self._helps else None if specification is None else specification.maximum
        return room is not None and len(before) >= room

    # Prediction

    def _outlook(self, data: VehicleData, work: Work, situation: Situation) -> Outlook:
        now_s, place_m = situation.now_s, work.position_m(data.name)
        heard_s = now_s if data.name == self._me else situation.heard_s.get(data.name, 0.0)
        watch = self._at.get(data.name)
        role = next((role for role in work.unfinished if watch is not None and role.name == watch.role), None)
        if watch is None or role is None or data.name == self._me:
            is_recent = now_s - heard_s <= RECENT_ROUNDS * now_s / situation.round
            return Outlook(now_s if is_recent else heard_s, place_m)
        return expected_end(role, data, work, now_s, heard_s, watch.due_s)

    def _is_late(self, vehicle: str, free_s: float, situation: Situation) -> bool:
        doubt_s = self._with.doubt_rounds * situation.now_s / situation.round
        return vehicle != self._me and free_s + doubt_s <= situation.now_s

    def _choice(
        self, work: Work, outlooks: Mapping[str, Outlook], doubted: Collection[str], situation: Situation
    ) -> str | None:
        if self._me not in outlooks:
            return None
        at = [(at.role, name) for name, at in self._at.items() if name in outlooks]
        taken = {role for role, _ in at}
        plan = planned(work, [role for role in work.open if role.name not in taken], work.workers, outlooks)
        self._helps = not plan.roles[self._me]
        if plan.roles[self._me]:
            return plan.roles[self._me][0].name
        return self._again(work, plan, outlooks, doubted, situation) or self._help(work, plan, outlooks, situation)

    def _again(
        self,
        work: Work,
        plan: AllocationPlan,
        outlooks: Mapping[str, Outlook],
        doubted: Collection[str],
        situation: Situation,
    ) -> str | None:
        trusted = {watch.role for name, watch in self._at.items() if name in outlooks and name not in doubted}
        awaited: dict[str, float] = {}
        unfinished = {role.name for role in work.unfinished}
        busy = {name for name, watch in self._at.items() if watch.role in unfinished}
        for data in work.workers:
            outlook = outlooks[data.name]
            for role in plan.roles[data.name]:
                outlook = work.after(outlook, data, role) or outlook
                due_s = outlook.free_s
                if data.name not in busy:  # due since its first planned end
                    due_s = awaited[role.name] = self._awaited.get(role.name, due_s)
                if not self._is_late(data.name, due_s, situation):
                    trusted.add(role.name)
        self._awaited = awaited
        data = work.database[self._me]
        left = [role for role in work.open if role.name not in trusted and work.able(data, role)]
        return work.in_order(outlooks[self._me], data, left)[0].name if left else None

    def _help(
        self, work: Work, plan: AllocationPlan, outlooks: Mapping[str, Outlook], situation: Situation
    ) -> str | None:
        at = {name: at.role for name, at in self._at.items() if name in outlooks}
        idle = [data for data in work.workers if data.name not in at and not plan.roles[data.name]]
        ends_s: dict[str, float] = {}
        n_holders: dict[str, int] = {}
        for name, role in at.items():
            ends_s[role] = min(ends_s.get(role, math.inf), outlooks[name].free_s)
            n_holders[role] = n_holders.get(role, 0) + 1
        helpers = joining(work, idle, ends_s, situation.now_s, self._with.join_s, n_holders)
        return next((assignment.role for assignment in helpers if assignment.vehicle == self._me), None)

    # Saying

    def _state(self, work: Work) -> list[Statement]:
        done = [role.job for role in work.roles if role.job is not None and role.job in work.done]
        facts: list[Statable] = [(job, "knownDone", True) for job in done]
        statements = in_blocks(facts, JOBS_PER_BLOCK)
        watch = self._at.get(self._me)
        if watch is not None:
            job, since = (self._me, "worksOn", self._group.path(watch.role)), (self._me, "worksSince", watch.since_s)
            statements.append(Statement((job, since)))
        elif work.unfinished:  # peers would wait for its former job
            free = (role for role in self._group.roles if role.job is None and self._me in work.holders(role))
            statements += [Statement(((self._me, "worksOn", self._group.path(role.name)),)) for role in islice(free, 1)]
        return statements


@dataclass(frozen=True, slots=True)
class StatusBroadcast(KnownFromStart):
    """Repeated mission states; see the module docstring."""

    period_rounds: Annotated[int, frames("between two broadcasts of the state")] = 3
    doubt_rounds: Annotated[int, frames("that a job may be late before another vehicle does it too", 0, 10_000)] = 30
    join_s: Annotated[float, JOIN] = 60.0

    name: ClassVar[str] = "status-broadcast"
    member = Broadcaster
    decides: ClassVar[str] = "all"
    announces = "states"
    planned = taking(
        "Sotzing, Lane 2010 (DELPHIS)",
        {
            "worksOn": "the job that the sender is at, or a role without one; not acknowledged",
            "worksSince": "since when; not acknowledged",
            "knownDone": "a job that the sender knows to be done; not acknowledged",
        },
    )


STRATEGY = StatusBroadcast()
