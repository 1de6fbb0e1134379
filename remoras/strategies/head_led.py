"""Strategies with a planning leader: one implementation with five factors.

The leader plans for all members of its group by the shared allocator. Each factor can be varied alone: prior knowledge
(``common_plan``), messages (``announces``), joining (``join_s``), plan repair
(``repairs``) and help for waiting vehicles (``help``):

* ``changes`` repairs the plan after any change; the group is not gathered before all work is done;
* ``calls`` repairs it only if a member without work calls or a job is vacant; the group may gather earlier;
* ``never`` keeps each first assignment.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from remoras.errors import StrategyError
from remoras.organisation import Group, RoleAssignment
from remoras.strategies.allocation import AllocationPlan, Engagement, affordable, all_jobs, joining, planned, revised
from remoras.strategies.factors import ALL, NO_JOIN_S, Announces, CommonPlan, Repairs
from remoras.strategies.initial_roles import common_roles
from remoras.strategies.negotiator import JOIN, MARGIN, Member, Placed
from remoras.strategy import JOB_DONE, Move, Situation, Statable, Statement
from remoras.work import Work, share_left

NEXT_JOBS = 2
"""Default ``queue`` of leaders that send next jobs only."""
NOT_HEAD = Move(until_news=True)

TOLD = {
    "playsRole": "a head gives a member a role",
    "leftRole": "a vehicle leaves a role, or its head takes it back",
    JOB_DONE: "a vehicle has done a job",
}


class Dispatcher(Member["HeadLed"]):
    """Job assignment by the leader: it replans jobs not yet begun, and states differences only."""

    def __init__(self, me: str, group: Group, strategy: HeadLed) -> None:
        super().__init__(me, group, strategy)
        self._queue = ALL if strategy.announces == "plan" else getattr(strategy, "queue", NEXT_JOBS)
        self._unheard_since: dict[tuple[str, str], int] = {}  # round, by (vehicle, role)
        self._planned_on: object = None
        self._taken: dict[tuple[str, str], tuple[float, float]] = {}  # share left and time due, by (vehicle, role)
        self._was_led = False
        self._ever_given: set[str] = set()  # jobs ever assigned; only for ``never``

    def negotiate(self, situation: Situation) -> Move:
        """As leader, replan after a change and state the differences."""
        work = situation.work
        if self._with.repairs == "never":
            self._ever_given.update(role.name for role in work.unfinished if work.holders(role))
        if self._me not in work.heads:
            self._was_led = True
            return NOT_HEAD
        engaged = {data.name: self._engaged(data.name, situation) for data in work.workers}
        late = self._unacknowledged(situation)
        changes = self._revision(engaged, late, situation) if self._is_due(engaged, late, situation) else []
        statements = self._given_before(work) + [Statement(facts) for facts in self._together(changes, work)]
        return Move(tuple(statements), holding=self._holds(engaged, situation))

    def _given_before(self, work: Work) -> list[Statement]:
        """Restate the assignments of the former leader after a succession."""
        if not self._was_led:
            return []
        self._was_led = False
        statements = []
        for role in (role for role in self._group.roles if not role.head):
            is_job = role.job is not None
            for name in work.holders(role) if not is_job or role in work.unfinished else ():
                if name != self._me:
                    # The member may refuse the job in the belief that this vehicle holds it.
                    left = [self._left(self._me, role.name)] if is_job and self._me not in work.holders(role) else []
                    statements.append(Statement((*left, self._given(name, role.name))))
        return statements

    def _together(self, facts: Sequence[Statable], work: Work) -> list[tuple[Statable, ...]]:
        """Group simultaneous facts; add roles that a member needs beside the assigned one."""
        left = {role: (name, attribute, role) for name, attribute, role in facts if attribute == "leftRole"}
        taken = {role for _, attribute, role in facts if attribute == "playsRole"}
        blocks = []
        for fact in facts:
            name, attribute, role = fact
            if attribute == "playsRole":
                # In one block, since a member that received only the reassignment would find no vacancy.
                release = [left.pop(role)] if role in left else []
                common = [assignment for assignment in common_roles(work, {name}) if assignment.vehicle == name]
                blocks.append((*release, fact, *(self._given(name, assignment.role) for assignment in common)))
            elif role not in taken:
                blocks.append((fact,))
        return blocks

    def _holds(self, engaged: Mapping[str, Engagement], situation: Situation) -> bool:
        # With ``calls``, the group waits while a job is vacant, or assigned but neither progressed nor overdue.
        work = situation.work
        if self._with.repairs != "calls":
            return bool(work.unfinished)
        taken = {}
        for data in work.workers:
            for role in work.held_by(data.name):
                key = data.name, role.name
                known = self._taken.get(key)
                if known is None or self._group.path(role.name) in situation.unheard.get(data.name, ()):
                    known = share_left(work.job(role)), engaged[data.name].end(data, work).free_s
                taken[key] = known
        self._taken = taken
        shares = {role.name: share_left(work.job(role)) for role in work.unfinished}
        is_awaited = any(
            shares[role] >= share and situation.now_s < due_s for (_, role), (share, due_s) in taken.items()
        )
        return is_awaited or any(not work.holders(role) for role in work.unfinished)

    def _engaged(self, vehicle: str, situation: Situation) -> Engagement:
        held, paths = situation.work.held_by(vehicle), situation.unheard.get(vehicle, ())
        unheard = [role.name for role in held if self._group.path(role.name) in paths]
        return self._engagement(vehicle, held, situation, unheard)

    def _is_due(self, engaged: Mapping[str, Engagement], late: Collection[object], situation: Situation) -> bool:
        work = situation.work
        idle = {name for name, engagement in engaged.items() if not engagement.begun}
        short = frozenset(
            name
            for name, engagement in engaged.items()
            if affordable(work, work.database[name], engagement) != engagement.queued
        )
        if self._with.repairs == "calls":
            calling = {name for name in idle if name == self._me or situation.calls.get(name, 0.0) > 0.0}
            if not (calling or late or work.vacant or short):
                return False
            idle = calling
        holders = tuple(work.holders(role) for role in work.unfinished)
        vehicles = frozenset(engaged), frozenset(late), frozenset(idle), short
        planned_on = work.done, holders, len(work.open), vehicles
        is_due = planned_on != self._planned_on
        self._planned_on = planned_on
        return is_due

    def _revision(
        self, engaged: Mapping[str, Engagement], late: Collection[tuple[str, str]], situation: Situation
    ) -> list[Statable]:
        work = situation.work
        if self._with.repairs == "never":
            return self._first_given(engaged, situation)
        held = {
            (name, role.name)
            for name, engagement in engaged.items()
            for role in (*engagement.begun, *engagement.queued)
        }
        taken = [(name, role) for name, role in sorted(late) if (name, role) in held]
        # A vehicle that does not acknowledge one role would not acknowledge another.
        deaf = {name for name, _ in late}
        free = [data for data in work.workers if data.name not in deaf]
        lost = {role for _, role in taken}
        vacant = [role for role in work.open if not work.holders(role) or role.name in lost]
        plan = revised(work, vacant, free, engaged, situation.now_s, self._with.margin)
        released = [self._left(name, role) for name, role in taken]
        assigned: list[Statable] = []
        for data in free:
            engagement = engaged[data.name]
            meant = plan.roles[data.name][: max(0, self._queue - len(engagement.begun))]
            released += [self._left(data.name, role.name) for role in engagement.queued if role not in meant]
            assigned += [self._given(data.name, role.name) for role in meant if role not in engagement.queued]
        return [*released, *assigned, *self._help(engaged, plan, deaf, situation)]

    def _first_given(self, engaged: Mapping[str, Engagement], situation: Situation) -> list[Statable]:
        work = situation.work
        new = [role for role in work.open if not work.holders(role) and role.name not in self._ever_given]
        after = {data.name: engaged[data.name].end(data, work) for data in work.workers}
        plan = planned(work, new, work.workers, after)
        facts: list[Statable] = []
        for data in work.workers:
            engagement = engaged[data.name]
            room = max(0, self._queue - len(engagement.begun) - len(engagement.queued))
            facts += [self._given(data.name, role.name) for role in plan.roles[data.name][:room]]
        return facts

    def _help(
        self, engaged: Mapping[str, Engagement], plan: AllocationPlan, deaf: Collection[str], situation: Situation
    ) -> list[Statable]:
        work = situation.work
        idle = [d for d in work.workers if d.name not in deaf and not engaged[d.name].begun and not plan.roles[d.name]]
        ends_s = {role.name: engagement.outlook.free_s for engagement in engaged.values() for role in engagement.begun}
        helpers = joining(work, idle, ends_s, situation.now_s, self._with.join_s)
        return [self._given(assignment.vehicle, assignment.role) for assignment in helpers]

    def _unacknowledged(self, situation: Situation) -> set[tuple[str, str]]:
        unheard = [
            (name, role.name)
            for name, paths in situation.unheard.items()
            for role in self._group.roles
            if self._group.path(role.name) in paths
        ]
        self._unheard_since = {key: self._unheard_since.get(key, situation.round) for key in unheard}
        return {
            key
            for key, since in self._unheard_since.items()
            if situation.round - since >= self._with.acknowledge_rounds
        }


@dataclass(frozen=True, slots=True)
class HeadLed(Placed):
    """Leader that plans and assigns; raises StrategyError if two factors exclude each other."""

    margin: Annotated[float, MARGIN] = 0.05
    join_s: Annotated[float, JOIN] = 60.0
    acknowledge_rounds: Annotated[
        int, Field(ge=1, le=10_000, description="TDMA frames for a member to acknowledge a job")
    ] = 400
    common_plan: CommonPlan = "jobs"
    announces: Announces = "plan"
    repairs: Repairs = "changes"

    name: ClassVar[str]
    decides: ClassVar[str] = "head"
    member = Dispatcher

    def __post_init__(self) -> None:
        if self.common_plan == "jobs" and self.announces == "next-jobs":
            excluded = 'common_plan = "jobs", by which all jobs are known at 0 s, excludes announces = "next-jobs"'
            raise StrategyError(
                "common_plan", f'{excluded}; allowed: announces = "plan", or common_plan "none", "missions"'
            )
        if self.repairs == "never" and self.join_s < NO_JOIN_S:
            excluded = f'repairs = "never", by which no vehicle is reassigned, excludes join_s = {self.join_s:g}'
            raise StrategyError(
                "repairs", f'{excluded}; allowed: join_s = {NO_JOIN_S:.0f}, or repairs "changes", "calls"'
            )

        if self.repairs == "calls" and self.help != "calls":
            excluded = f'repairs = "calls", by which idle members call for work, excludes help = "{self.help}"'
            raise StrategyError("repairs", f'{excluded}; allowed: help = "calls", or repairs "changes", "never"')

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Return common roles, and all open jobs unless the leader assigns next jobs only."""
        if self.common_plan == "missions" or (self.repairs == "never" and work.is_begun):
            return common_roles(work)
        jobs = all_jobs(work, self.join_s) if self.announces == "plan" else ()
        if self.common_plan == "jobs" or not work.roles:
            return common_roles(work) + jobs
        # Missions are sent at run time: only vehicles with a job get common roles, since each takes time to send.
        return jobs + common_roles(work, {assignment.vehicle for assignment in jobs})
