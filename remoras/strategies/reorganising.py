"""Reorganising: a group that goes on under another shipped strategy in mid-mission, as what it meets asks for it.

It begins under ``plan-and-dispatch``: all know a plan from the start, and its head mends it. Each vehicle estimates
how old news is (a TDMA frame over the share of packets that are heard, the mean of its links, or the age of the last
word if that is more), which jobs are done earlier or later than foreseen, which members are gone, which jobs nobody
knew of. Where something is not as foreseen and news is fresh, the head proposes to go on as ``status-broadcast`` does,
under which nobody waits for anybody. Where news is old, the plan that all know is worth more than what can be told.

A proposal is a number: how often the organisation was changed, and to which. Every member says the greatest that it has
heard, again and again, and goes by it; hearing is a join, so whoever has heard the same agrees, whatever was lost, and
of two heads of a divided group the one with the greater number counts once either is heard. Who changes keeps the job
that it is at and leaves the others; of its peers it takes for true that they are at the first of what they held.
A head that was not heard yet may still give out jobs: who has changed leaves them, and says where it is.

Source: ours. What a group may go on under are strategies with sources of their own; that loss, group and work decide
which of them does best is what ``fathom-1`` measures.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.organisation import Group, RoleAssignment, RoleSpecification
from remoras.strategies.founding import common_roles, founded
from remoras.strategies.head_led import TOLD
from remoras.strategies.negotiator import Member, frames
from remoras.strategies.plan_and_dispatch import PlanAndDispatch
from remoras.strategies.status_broadcast import StatusBroadcast
from remoras.strategy import Declaration, Move, Situation, Statement
from remoras.work import Outlook, Work

PLAN, STATES = PlanAndDispatch(), StatusBroadcast()
"""Strategies that a group may go on under; it begins under the first."""
N_ORGANISATIONS, MOST = 2, 65535
"""Of these, and the greatest number that can be told."""


def news_age_s(situation: Situation) -> float:
    """How old news of other workers is: a TDMA frame over the share of packets heard, or the last word if older (s)."""
    known = [data.name for data in situation.work.workers if data.name in situation.links]
    if not known:
        return math.inf
    p_heard = math.fsum(1.0 - situation.links[name].incoming.p_reckoned for name in known) / len(known)
    last_s = max(situation.heard_s.get(name, 0.0) for name in known)
    return max(situation.now_s / situation.round / p_heard, situation.now_s - last_s)


class Foreseen:
    """What a vehicle knew in its first round: who works, at which jobs, and when each should be done.

    Args:
        situation: of that round.
    """

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
        """True if a worker is gone, a job was found, or one is done too early or late by a share of its time."""
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
    """One vehicle's part under whichever strategy its group is now."""

    def __init__(self, me: str, group: Group, strategy: Reorganising) -> None:
        super().__init__(me, group, strategy)
        self._planned, self._stated = PLAN.negotiator(me, group), STATES.negotiator(me, group)
        self._foreseen: Foreseen | None = None
        self.number = 0
        """How often the organisation was changed, as far as it is known: even under the first strategy."""

    def negotiate(self, situation: Situation) -> Move:
        """Hear how the group is organised, propose another way as a head, and go on under the one that counts."""
        before, work = self.number, situation.work
        self._foreseen = self._foreseen or Foreseen(situation)
        self.number = max([before, *self._heard(situation)])
        if not self.number and self._is_better_changed(situation, self._foreseen) and self._me in work.heads:
            self.number = 1
        said = []
        if self.number and (self.number != before or situation.round % self._with.repeat_rounds == 0):
            said.append(Statement(((self._me, "claimsOf", self.number),)))
        if not self.number % N_ORGANISATIONS:
            move = self._planned.negotiate(situation)
        else:
            if not before % N_ORGANISATIONS:
                self._stated.take_over(situation)
            given_up = [role for role in work.held_by(self._me) if not self._stated.is_at(role.name)]
            if given_up:  # others would find no room
                path = self._group.path
                said.append(Statement(tuple((self._me, "leftRole", path(role.name)) for role in given_up)))
            move = self._stated.negotiate(_without(given_up, situation, self._me))
        return replace(move, statements=(*said, *move.statements), until_news=False)

    def division(self) -> Mapping[str, str]:
        """Who is at which job, where that is not told as roles are."""
        return self._stated.division() if self.number % N_ORGANISATIONS else {}

    def _heard(self, situation: Situation) -> Iterator[int]:
        """Numbers that members of the group have told."""
        for heard in situation.heard:
            for subject, attribute, value in heard.facts:
                if attribute == "claimsOf" and subject == heard.issuer and subject in situation.work.members:
                    yield int(value)

    def _is_better_changed(self, situation: Situation, foreseen: Foreseen) -> bool:
        """True if something is other than foreseen, and news is fresh."""
        return foreseen.has_failed(situation, self._with.share) and news_age_s(situation) <= self._with.news_s


def _without(roles: Sequence[RoleSpecification], situation: Situation, vehicle: str) -> Situation:
    """The situation once a vehicle has left roles."""
    work = situation.work
    organisation = work.organisation
    for role in roles:
        organisation, _ = organisation.leave_role(vehicle, work.group.name, role.name)
    return replace(situation, work=replace(work, organisation=organisation)) if roles else situation


@dataclass(frozen=True, slots=True)
class Reorganising:
    """An organisation that changes itself at sea; see the module's text."""

    news_s: Annotated[
        float, Field(ge=0.0, le=1e6, description="how old news may be where the plan is given up (s)")
    ] = 30.0
    share: Annotated[
        float, Field(ge=0.0, le=100.0, description="share of the time foreseen by which a job is early or late")
    ] = 0.1
    repeat_rounds: Annotated[int, frames("after which the organisation is said again")] = 3

    name: ClassVar[str] = "reorganising"
    declaration: ClassVar[Declaration] = Declaration(
        source="ours; what it changes between: " + f"{PLAN.source}; {STATES.declaration.source}",
        messages={
            "claimsOf": "how often the organisation of the sender's group was changed; not acknowledged",
            **TOLD,
            **STATES.declaration.messages,
        },
        blocks_per_round=1,
        authorities=STATES.declaration.authorities,
        private_jobs=True,
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """As the strategy that it begins under; once somebody has a job, negotiators give out what comes up."""
        is_begun = any(work.holders(role) or role.job in work.done for role in work.roles)
        return common_roles(work) if is_begun else PLAN.adapt(work)

    def negotiator(self, me: str, group: Group) -> Reorganiser:
        """One for each member."""
        return Reorganiser(me, group, self)


REORGANISING = Reorganising()
