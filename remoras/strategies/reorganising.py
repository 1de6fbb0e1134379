"""Reorganising: a group that changes its strategy in mid-mission, depending on conditions.

It starts under ``plan-and-dispatch``. On a deviation (``Foreseen``) with fresh information (``news_age_s``), the leader
proposes ``status-broadcast``, where no vehicle waits for another. With old information, the common plan is worth more.

A proposal is the count of changes, which also names the strategy. Members repeat and follow the greatest number
received, so vehicles with the same messages agree. On a change, a vehicle keeps its current job and leaves the others.
A leader without the proposal may still assign jobs: members that have changed leave them.

Source: ours; the strategies have their own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.organisation import Group, RoleAssignment, RoleSpecification
from remoras.strategies.head_led import TOLD
from remoras.strategies.initial_roles import common_roles
from remoras.strategies.negotiator import Helped, Member, frames
from remoras.strategies.plan_and_dispatch import PlanAndDispatch
from remoras.strategies.status_broadcast import Broadcaster, StatusBroadcast
from remoras.strategy import Declaration, Move, Situation, Statement
from remoras.work import Outlook, Work

PLAN, STATES = PlanAndDispatch(), StatusBroadcast()
"""Strategies of a group; it starts under the first."""
N_ORGANISATIONS, MOST = 2, 65535
"""Number of strategies, and greatest number that a fact can hold."""


def news_age_s(situation: Situation) -> float:
    """Return the age (s) of other workers' information, at least frame / reception probability."""
    known = [data.name for data in situation.work.workers if data.name in situation.links]
    if not known:
        return math.inf
    p_heard = math.fsum(1.0 - situation.links[name].incoming.p_reckoned for name in known) / len(known)
    last_s = max(situation.heard_s.get(name, 0.0) for name in known)
    return max(situation.now_s / situation.round / p_heard, situation.now_s - last_s)


class Foreseen:
    """Expectations of a vehicle in its first round: workers, jobs, and the end of each job."""

    def __init__(self, situation: Situation) -> None:
        work = situation.work
        self._workers = {data.name for data in work.workers}
        self._jobs = {role.job for role in work.roles}
        self._due_s: dict[str, float] = {}
        for data in work.workers:
            outlook = Outlook(situation.now_s, work.position_m(data.name))
            for role in work.in_order(outlook, data, work.held_by(data.name)):
                outlook = work.after(outlook, data, role) or outlook
                self._due_s[role.job or ""] = outlook.free_s

    def has_failed(self, situation: Situation, share: float) -> bool:
        """True on a lost worker, a new job, or a job early or late by ``share`` of its expected end."""
        work, now_s = situation.work, situation.now_s
        if not self._workers.issubset(data.name for data in work.workers):
            return True
        if not self._jobs.issuperset(role.job for role in work.roles):
            return True
        done = {job: due_s for job, due_s in self._due_s.items() if job in work.done}
        for job in done:
            del self._due_s[job]
        is_early = any(now_s < (1.0 - share) * due_s for due_s in done.values())
        return is_early or any(now_s > (1.0 + share) * due_s for due_s in self._due_s.values())


class Reorganiser(Member["Reorganising"]):
    """Negotiator of one vehicle, which delegates to that of the group's current strategy."""

    def __init__(self, me: str, group: Group, strategy: Reorganising) -> None:
        super().__init__(me, group, strategy)
        self._planned, self._stated = PLAN.negotiator(me, group), Broadcaster(me, group, STATES)
        self._foreseen: Foreseen | None = None
        self.number = 0
        """Count of strategy changes, as far as known: even under the first strategy."""

    def negotiate(self, situation: Situation) -> Move:
        """Process proposals, propose a change as leader, continue under the valid strategy."""
        before, work = self.number, situation.work
        self._foreseen = self._foreseen or Foreseen(situation)
        self.number = max([before, *self._heard(situation)])
        if not self.number and self._is_better_changed(situation, self._foreseen) and self._me in work.heads:
            self.number = 1
        statements = []
        if self.number and (self.number != before or situation.round % self._with.repeat_rounds == 0):
            statements.append(Statement(((self._me, "claimsOf", self.number),)))
        if not self.number % N_ORGANISATIONS:
            move = self._planned.negotiate(situation)
        else:
            if not before % N_ORGANISATIONS:
                self._stated.take_over(situation)
            given_up = [role for role in work.held_by(self._me) if not self._stated.is_at(role.name)]
            if given_up:  # else others find no vacancy
                statements.append(Statement(tuple(self._left(self._me, role.name) for role in given_up)))
            move = self._stated.negotiate(_without(given_up, situation, self._me))
        # Deviations and repetitions of the proposal come without news.
        return replace(move, statements=(*statements, *move.statements), until_news=False)

    def division(self) -> Mapping[str, str]:
        """Return the vehicle at each job under ``status-broadcast``; else empty: roles give it."""
        return self._stated.division() if self.number % N_ORGANISATIONS else {}

    def _heard(self, situation: Situation) -> Iterator[int]:
        for message in situation.heard:
            for subject, attribute, value in message.facts:
                if attribute == "claimsOf" and subject == message.issuer and subject in situation.work.members:
                    yield int(value)

    def _is_better_changed(self, situation: Situation, foreseen: Foreseen) -> bool:
        return foreseen.has_failed(situation, self._with.share) and news_age_s(situation) <= self._with.news_s


def _without(roles: Sequence[RoleSpecification], situation: Situation, vehicle: str) -> Situation:
    work = situation.work
    organisation = work.organisation
    for role in roles:
        organisation, _ = organisation.leave_role(vehicle, work.group.name, role.name)
    return replace(situation, work=replace(work, organisation=organisation)) if roles else situation


@dataclass(frozen=True, slots=True)
class Reorganising(Helped):
    """Strategy that changes at run time; see the module docstring."""

    news_s: Annotated[
        float, Field(ge=0.0, le=1e6, description="maximum age of information to abandon the plan (s)")
    ] = 30.0
    share: Annotated[
        float, Field(ge=0.0, le=100.0, description="relative deviation at which a job is early or late")
    ] = 0.1
    repeat_rounds: Annotated[int, frames("after which the organisation is repeated")] = 3

    name: ClassVar[str] = "reorganising"
    member = Reorganiser
    planned: ClassVar[Declaration] = Declaration(
        source="ours; what it changes between: " + f"{PLAN.source}; {STATES.declaration.source}",
        messages={
            "claimsOf": "how often the organisation of the sender's group was changed; not acknowledged",
            **STATES.declaration.messages,
            **TOLD,
        },
        blocks_per_round=1,
        authorities=STATES.declaration.authorities,
        private_jobs=True,
    )

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Assign as ``plan-and-dispatch``; after the first assignment negotiators assign new jobs."""
        return common_roles(work) if work.is_begun else PLAN.adapt(work)


REORGANISING = Reorganising()
