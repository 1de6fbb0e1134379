"""Fixed partition: a plan before the dive, no communication. The floor of a comparison.

Each vehicle does its assigned jobs and goes to the rally point. Jobs linked by prerequisites form a chain for one
vehicle, in an order that the prerequisites allow, since no vehicle learns of others' finished jobs. The leader leaves
for the next rendezvous at a prearranged time: the expected arrival of the last vehicle, plus ``margin``. Deviations
stay unknown. A job that comes up is done by the vehicle that discovers it, after its own jobs, nearest first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.authority import Authority
from remoras.beliefs import Key
from remoras.database import VehicleData
from remoras.organisation import Group, RoleAssignment, RoleSpecification
from remoras.strategies.allocation import all_jobs
from remoras.strategies.factors import Factors
from remoras.strategies.initial_roles import common_roles
from remoras.strategies.negotiator import DividedAtSea, Member
from remoras.strategy import Declaration, Move, Situation, Statement
from remoras.work import Job, Outlook, Point, Work


@dataclass(frozen=True)
class ChainOfJobs:
    """Chain of jobs of one vehicle, presented as one job; ``needs`` are from outside the chain."""

    group: str
    links: tuple[tuple[str, Job], ...]
    needs: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the first job."""
        return self.links[0][1].name

    @property
    def place_m(self) -> Point:
        """Start position (m)."""
        return self.links[0][1].place_m

    @property
    def done(self) -> Key:
        """Completion fact of the last job."""
        return self.links[-1][1].done

    def is_able(self, data: VehicleData) -> bool:
        """True if the vehicle is able to do every job of the chain."""
        return all(data.can_play(self.group, role) and job.is_able(data) for role, job in self.links)

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Time and place at which the vehicle completes the chain; None if unable."""
        if not self.is_able(data):
            return None
        for _, job in self.links:
            end = job.after(outlook, data)
            if end is None:
                return None
            outlook = end
        return outlook


def chains(work: Work) -> list[tuple[RoleSpecification, ...]]:
    """Partition roles into chains linked by prerequisites, each in a feasible order."""
    linked: list[list[RoleSpecification]] = []
    for role in work.roles:
        joined = [chain for chain in linked if any(_are_linked(role, other, work) for other in chain)]
        linked = [chain for chain in linked if chain not in joined]
        linked.append([*(other for chain in joined for other in chain), role])
    return [_in_order(chain, work) for chain in linked]


def _are_linked(role: RoleSpecification, other: RoleSpecification, work: Work) -> bool:
    return role.job in work.job(other).needs or other.job in work.job(role).needs


def _in_order(roles: list[RoleSpecification], work: Work) -> tuple[RoleSpecification, ...]:
    left = sorted(roles, key=work.roles.index)
    ordered: list[RoleSpecification] = []
    while left:
        waiting = {role.job for role in left}
        role = next(role for role in left if waiting.isdisjoint(work.job(role).needs))
        left.remove(role)
        ordered.append(role)
    return tuple(ordered)


def chained(work: Work) -> Work:
    """Replace the unfinished part of each chain by one job of its first role."""
    longer = [chain for chain in chains(work) if len(chain) > 1]
    if not longer:
        return work
    unseen: set[str] = set()
    jobs = dict(work.jobs)
    for chain in longer:
        left = [role for role in chain if role in work.unfinished]
        if not left:
            continue
        is_begun = any(work.holders(role) for role in chain)
        # A begun chain stays with its vehicle: no part of it is vacant.
        unseen.update(role.name for role in left[0 if is_begun and not work.holders(left[0]) else 1 :])
        within = {role.job for role in chain}
        needs = tuple(need for role in left for need in work.job(role).needs if need not in within)
        jobs[left[0].job or ""] = ChainOfJobs(
            work.group.name, tuple((role.name, work.job(role)) for role in left), needs
        )
    roles = tuple(role for role in work.group.roles if role.name not in unseen)
    return replace(work, group=replace(work.group, roles=roles), jobs=jobs)


class Timetable(Member["FixedPartition"]):
    """One vehicle's copy of the plan: its next job and the time of the rendezvous."""

    def __init__(self, me: str, group: Group, strategy: FixedPartition) -> None:
        super().__init__(me, group, strategy)
        self._meeting_s: float | None = None
        self._to_follow: tuple[RoleSpecification, ...] = ()
        self._planned: frozenset[str] = frozenset()
        self._met = False

    def negotiate(self, situation: Situation) -> Move:
        """Take the next role of a chain or a discovered one, or declare the group gathered."""
        work = situation.work
        if self._meeting_s is None:
            self._meeting_s = self._expected_s(situation)
            plan = [chain for chain in chains(work) if self._me in work.holders(chain[0])]
            me = work.database[self._me]
            self._to_follow = tuple(role for _, *rest in plan for role in rest if work.able(me, role))
            self._planned = frozenset(role.name for role in work.roles)
        held = work.held_by(self._me)
        following = [role for role in self._to_follow if role in work.vacant] or self._come_up(situation)
        if not held and following:
            return Move((self._takes(following[0].name),), holding=True)
        if situation.now_s < self._meeting_s or held:
            return Move(holding=True)
        if self._met or self._group.rally_point is None or self._me not in work.heads:
            return Move()
        self._met = True
        return Move((Statement(((self._group.name, "gatheredAt", self._group.rally_point),), told=False),))

    def _come_up(self, situation: Situation) -> Sequence[RoleSpecification]:
        work, data = situation.work, situation.work.database[self._me]
        new = [role for role in work.vacant if role.name not in self._planned and work.able(data, role)]
        return work.in_order(Outlook(situation.now_s, work.position_m(self._me)), data, new) if new else ()

    def _expected_s(self, situation: Situation) -> float:
        # As known before the dive, so that all members compute the same time.
        plan = chained(replace(situation.work, done=frozenset(), positions_m={}))
        arrivals_s = (
            plan.arrival_s(Outlook(0.0, data.start_m), data, plan.held_by(data.name), situation.rally_m)
            for data in plan.workers
        )
        return (1.0 + self._with.margin) * max(arrivals_s, default=0.0)


@dataclass(frozen=True, slots=True)
class FixedPartition(DividedAtSea):
    """Strategy without communication; see the module docstring."""

    margin: Annotated[
        float, Field(ge=0.0, le=100.0, description="margin of rendezvous times over expected arrivals, as a share")
    ] = 0.15

    name: ClassVar[str] = "fixed-partition"
    member = Timetable
    declaration: ClassVar[Declaration] = Declaration(
        source="the floor that any communication has to beat",
        messages={},
        communicates=False,
        authorities=frozenset({Authority.FOLLOW}),
        private_jobs=True,
    )
    factors: ClassVar[Factors] = Factors("jobs", "nobody", "all", "nothing", "no", "never")

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        return common_roles(work) + all_jobs(chained(work))


STRATEGY = FixedPartition()
