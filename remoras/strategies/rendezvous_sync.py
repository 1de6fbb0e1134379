"""Rendezvous synchronisation: work is divided, and knowledge exchanged, only at rendezvous.

Each member starts with the first ``jobs_per_leg`` jobs of a common plan, does them silently and goes to the rally
point. Once the leader, itself free, receives all members there, it assigns the first jobs of a new plan; each member
leaves on receiving its own. So packet loss can only prolong a rendezvous. A member missing for a lease after its
expected arrival leaves the group by the common rule, and others get its jobs.

Source: rendezvous point synchronisation as cited by Carlesi et al. 2011, section II. The plan is ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

from pydantic import Field

from exchange.arithmetic import distance
from remoras.database import VehicleData
from remoras.organisation import Group, RoleAssignment, RoleSpecification
from remoras.strategies.allocation import assignments, job_plan, planned
from remoras.strategies.factors import Factors
from remoras.strategies.initial_roles import common_roles
from remoras.strategies.negotiator import DividedAtSea, Member
from remoras.strategy import JOB_DONE, Declaration, Move, Situation, Statable, Statement
from remoras.work import Outlook, Work

PRESENT_ROUNDS = 30
"""A vehicle received at the rally point within as many TDMA frames has arrived."""


LATE = 1.3
"""Factor by which a leg may exceed its expected duration."""


class _Leg(NamedTuple):
    held: tuple[str, ...]
    until_s: float


class Convener(Member["RendezvousSync"]):
    """One vehicle's part: silent when away; a leader assigns jobs at the rally point."""

    def __init__(self, me: str, group: Group, strategy: RendezvousSync) -> None:
        super().__init__(me, group, strategy)
        self._legs: dict[str, _Leg] = {}
        self._to_take: tuple[RoleSpecification, ...] = ()  # own jobs of the next leg, until all others have theirs

    def negotiate(self, situation: Situation) -> Move:
        """Keep silent when away; at the rally point wait for expected members, then assign jobs."""
        work = situation.work
        here = {data.name for data in work.workers if self._is_here(data.name, situation)}
        if work.unfinished and self._me not in here:
            return Move(
                holding=self._me in work.heads, silent=True, expected=self._expected(situation) | set(work.members)
            )
        expected = self._expected(situation)
        if self._me not in work.heads:
            return Move(expected=expected)
        facts: list[Statable] = []
        if self._to_take:
            # Once it leaves, it cannot repeat the others' jobs.
            if here.isdisjoint(situation.unheard):
                facts = [self._given(self._me, role.name) for role in self._to_take]
                self._to_take = ()
        elif work.unfinished and here.issuperset(d.name for d in work.workers) and not self._held(work):
            facts = self._given_out(situation)
        return Move(tuple(Statement((fact,)) for fact in facts), holding=bool(work.unfinished), expected=expected)

    def _held(self, work: Work) -> bool:
        return any(work.held_by(data.name) for data in work.workers)

    def _is_here(self, vehicle: str, situation: Situation) -> bool:
        position_m = situation.work.positions_m.get(vehicle)
        if position_m is None or situation.rally_m is None:
            return False
        frame_s = situation.now_s / situation.round
        silent_s = 0.0 if vehicle == self._me else situation.now_s - situation.heard_s.get(vehicle, -math.inf)
        is_near = distance(position_m, situation.rally_m) <= self._with.meeting_radius_m
        return is_near and silent_s <= PRESENT_ROUNDS * frame_s

    def _expected(self, situation: Situation) -> set[str]:
        work, now_s = situation.work, situation.now_s
        organisation = work.organisation
        with_jobs = [g.name for g in organisation.groups.values() if any(role.job is not None for role in g.roles)]
        expected = {name for group in with_jobs for name in organisation.members(group)}.difference(work.members)
        legs: dict[str, _Leg] = {}
        for data in work.workers:
            if held := tuple(role.name for role in work.held_by(data.name)):
                leg = self._legs.get(data.name)
                if leg is None or leg.held != held:
                    leg = _Leg(held, now_s + LATE * (self._back_s(data, situation) - now_s))
                legs[data.name] = leg
                if now_s < leg.until_s:
                    expected.add(data.name)
        self._legs = legs
        return expected

    def _back_s(self, data: VehicleData, situation: Situation) -> float:
        work = situation.work
        here = Outlook(situation.now_s, work.position_m(data.name))
        return work.arrival_s(here, data, work.held_by(data.name), situation.rally_m)

    def _given_out(self, situation: Situation) -> list[Statable]:
        work = situation.work
        outlooks = {data.name: Outlook(situation.now_s, work.position_m(data.name)) for data in work.workers}
        plan = planned(work, work.vacant, work.workers, outlooks)
        legs = {name: roles[: self._with.jobs_per_leg] for name, roles in plan.roles.items()}
        self._to_take = legs.get(self._me, ())
        return [self._given(name, role.name) for name, roles in legs.items() if name != self._me for role in roles]


@dataclass(frozen=True, slots=True)
class RendezvousSync(DividedAtSea):
    """Rendezvous synchronisation; see the module docstring."""

    jobs_per_leg: Annotated[int, Field(ge=1, le=64, description="maximum jobs of a vehicle between two rendezvous")] = 5
    meeting_radius_m: Annotated[
        float, Field(gt=0.0, le=10_000.0, description="arrival distance from the rally point")
    ] = 40.0

    name: ClassVar[str] = "rendezvous-sync"
    member = Convener
    declaration: ClassVar[Declaration] = Declaration(
        source="rendezvous point synchronisation, cited by Carlesi et al. 2011",
        messages={
            "playsRole": "the head gives a member a job, at a meeting",
            JOB_DONE: "a vehicle has done a job, reported at a meeting",
        },
        meets=True,
    )
    factors: ClassVar[Factors] = Factors("jobs", "head", "all", "meetings", "no", "changes")

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Return the jobs of the first leg; none on replanning, since rendezvous assign them."""
        if any(work.holders(role) for role in work.roles):
            return common_roles(work)
        return common_roles(work) + assignments(work, job_plan(work), self.jobs_per_leg)


STRATEGY = RendezvousSync()
