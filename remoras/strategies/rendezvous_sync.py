"""Rendezvous synchronisation: work is divided only when all have met.

Before the dive every member gets up to ``jobs_per_leg`` jobs. Whoever has done its jobs goes to the rally point.
When the head, free itself, knows all members there, it gives out the next jobs; each leaves for its own as soon as it
has heard of them. Between two meetings nothing needs to be heard, so losses can only prolong a meeting. When all who
are missing are overdue, they are waited for another ``wait_rounds``; then what they held is given out again.

Source: rendezvous point synchronisation as cited by Carlesi et al. 2011, section II.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.organisation import Group, RoleAssignment
from remoras.strategies.allocation import Expectations, shared_out
from remoras.strategies.founding import common_roles, founded
from remoras.strategy import JOB_DONE, Declaration, Move, Situation, Statable, Statement
from remoras.work import Outlook, Work


class Convener:
    """The head's part: who is here, and what is left to do; other members just come."""

    def __init__(self, me: str, group: Group, strategy: RendezvousSync) -> None:
        self._me = me
        self._group = group
        self._with = strategy
        self._waiting_since: int | None = None
        self._expectations = Expectations()

    def negotiate(self, situation: Situation) -> Move:
        """Wait for those who are expected; when all have come, or are given up, give out the next jobs."""
        work = situation.work
        if self._me not in work.heads:
            return Move()
        absent = [d.name for d in work.workers if work.held_by(d.name) or not self._is_here(d.name, situation)]
        is_due = not self._is_on_the_way(absent, situation) and len(absent) < len(work.workers)
        if not work.unfinished or not is_due:
            self._waiting_since = None
            return Move(holding=bool(work.unfinished))
        if self._waiting_since is None:
            self._waiting_since = situation.round
        if absent and situation.round - self._waiting_since < self._with.wait_rounds:
            return Move(holding=True)
        self._waiting_since = None
        said = self._given_out(absent, situation)
        return Move(tuple(Statement((fact,)) for fact in said), holding=True)

    def _is_here(self, vehicle: str, situation: Situation) -> bool:
        position_m = situation.work.positions_m.get(vehicle)
        if position_m is None or situation.rally_m is None:
            return False
        return math.dist(position_m, situation.rally_m) <= self._with.meeting_radius_m

    def _is_on_the_way(self, absent: Collection[str], situation: Situation) -> bool:
        """True while the head itself, or one that is missing, is not expected to be free yet."""
        work, now_s = situation.work, situation.now_s
        free_s = {d.name: self._expectations.of(d, work.held_by(d.name), now_s, work).free_s for d in work.workers}
        return self._me in absent or any(free_s[name] > now_s for name in absent)

    def _given_out(self, absent: Collection[str], situation: Situation) -> list[Statable]:
        """What the absent held is taken back; that and what is vacant goes to those who are here."""
        work, path = situation.work, self._group.path
        taken_back = [(name, role) for name in absent for role in work.held_by(name)]
        lost = [role for _, role in taken_back]
        vacant = [role for role in work.open if role in (*lost, *work.vacant)]
        present = [data for data in work.workers if data.name not in absent]
        outlooks = {data.name: Outlook(situation.now_s, work.position_m(data.name)) for data in present}
        given = shared_out(work, vacant, present, outlooks, self._with.jobs_per_leg)
        return [
            *((name, "leftRole", path(role.name)) for name, role in taken_back),
            *((one.vehicle, "playsRole", path(one.role)) for one in given),
        ]


@dataclass(frozen=True, slots=True)
class RendezvousSync:
    """Meetings; see the module's text."""

    jobs_per_leg: Annotated[int, Field(ge=1, le=64, description="most jobs for a vehicle between two meetings")] = 2
    meeting_radius_m: Annotated[
        float, Field(gt=0.0, le=10_000.0, description="a vehicle this near to the rally point has come")
    ] = 30.0
    wait_rounds: Annotated[
        int,
        Field(ge=1, le=100_000, description="TDMA frames that those who have come wait for others that are overdue"),
    ] = 60

    name: ClassVar[str] = "rendezvous-sync"
    declaration: ClassVar[Declaration] = Declaration(
        source="rendezvous point synchronisation, cited by Carlesi et al. 2011",
        messages={
            "playsRole": "the head gives a member a job, at a meeting",
            "leftRole": "the head takes back what a member held that did not come",
            JOB_DONE: "a vehicle has done a job",
        },
    )
    form = staticmethod(founded)

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Jobs of the first leg; in a mission that is planned anew none, since meetings give them out."""
        if any(work.holders(role) for role in work.roles):
            return common_roles(work)
        outlooks = {data.name: Outlook(0.0, work.position_m(data.name)) for data in work.workers}
        return common_roles(work) + shared_out(work, work.open, work.workers, outlooks, self.jobs_per_leg)

    def negotiator(self, me: str, group: Group) -> Convener:
        """The head's part, for each member: another may come to lead."""
        return Convener(me, group, self)


STRATEGY = RendezvousSync()
