"""Dispatcher: run-time job assignment by the group leader, shared by several strategies.

On a change (job done; member without work, gone, absent or not acknowledging), the leader replans the jobs not yet
begun. It states the differences only, and at most ``queue`` jobs per member.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from pydantic import Field

from remoras.database import VehicleData
from remoras.organisation import Group
from remoras.strategies.allocation import AllocationPlan, Engagement, Expectations, affordable, helped, planned, revised
from remoras.strategies.founding import common_roles
from remoras.strategy import Move, Situation, Statable, Statement
from remoras.work import Work, share_left

QUEUE = Field(ge=1, le=64, description="maximum jobs per vehicle, including the current one")
MARGIN = Field(ge=0.0, le=1.0, description="minimum gain, as a share of the remaining time, for moving jobs")
HELP = Field(ge=0.0, le=1e6, description="minimum time saved by helping with another's job (s)")
ACKNOWLEDGE = Field(ge=1, le=10_000, description="TDMA frames for a member to acknowledge a job")

NEXT_JOBS = 2
"""Default ``queue`` of leaders that send next jobs only."""
NOT_HEAD = Move(until_news=True)


@dataclass(frozen=True, slots=True)
class Dispatching:
    """Parameters of a dispatcher.

    Attributes:
        queue: maximum number of held jobs, the current one included.
        margin: share of the remaining time by which the makespan must fall to move jobs.
        help_s: minimum saving (s) of help at another vehicle's job.
        acknowledge_rounds: TDMA frames until an unacknowledged job is reassigned.
        repairs: ``changes`` repairs the plan after any change; the group is not gathered before all work is done.
            ``calls`` repairs it only if a member without work calls or a job is vacant; the group may gather earlier.
            ``never`` keeps each first assignment.
    """

    queue: int
    margin: float
    help_s: float
    acknowledge_rounds: int
    repairs: str = "changes"


class Dispatcher:
    """Job assignment by the leader. Every member has one, since any may succeed the leader."""

    def __init__(self, me: str, group: Group, dispatching: Dispatching) -> None:
        self._me = me
        self._group = group
        self._with = dispatching
        self._unheard_since: dict[tuple[str, str], int] = {}  # round, by (vehicle, role)
        self._expectations = Expectations()
        self._planned_on: object = None
        self._taken: dict[tuple[str, str], tuple[float, float]] = {}  # share left and time due, by (vehicle, role)
        self._was_led = False
        self._given: set[str] = set()  # jobs ever assigned; only for ``never``

    def negotiate(self, situation: Situation) -> Move:
        """As leader, replan after a change and state the differences."""
        work = situation.work
        if self._with.repairs == "never":
            self._given.update(role.name for role in work.unfinished if work.holders(role))
        if self._me not in work.heads:
            self._was_led = True
            return NOT_HEAD
        engaged = {data.name: self._engagement(data, situation) for data in work.workers}
        late = self._unacknowledged(situation)
        said = self._revision(engaged, late, situation) if self._is_due(engaged, late, situation) else []
        statements = self._given_before(work) + [Statement(facts) for facts in self._together(said, work)]
        return Move(tuple(statements), holding=self._holds(engaged, situation))

    def _given_before(self, work: Work) -> list[Statement]:
        """Restate the assignments of the former leader after a succession.

        A member may have missed its own, and may refuse it since it believes this vehicle to hold that job.
        """
        if not self._was_led:
            return []
        self._was_led = False
        given = []
        for role in (role for role in self._group.roles if not role.head):
            path, is_job = self._group.path(role.name), role.job is not None
            for name in work.holders(role) if not is_job or role in work.unfinished else ():
                if name != self._me:
                    left = [(self._me, "leftRole", path)] if is_job and self._me not in work.holders(role) else []
                    given.append(Statement((*left, (name, "playsRole", path))))
        return given

    def _together(self, said: Sequence[Statable], work: Work) -> list[tuple[Statable, ...]]:
        """Group simultaneous facts: release and reassignment of a role share one block.

        A member that received only the reassignment would find no vacancy.
        """
        left = {role: (name, attribute, role) for name, attribute, role in said if attribute == "leftRole"}
        taken = {role for _, attribute, role in said if attribute == "playsRole"}
        blocks = []
        for fact in said:
            _, attribute, role = fact
            if attribute == "playsRole":
                release = [left.pop(role)] if role in left else []
                blocks.append((*release, fact, *self._common(fact, work)))
            elif role not in taken:
                blocks.append((fact,))
        return blocks

    def _common(self, fact: Statable, work: Work) -> list[Statable]:
        """Roles without a job that a vehicle needs together with the assigned job."""
        name, attribute, _ = fact
        if attribute != "playsRole":
            return []
        lacking = [role for role in common_roles(work, {name}) if role.vehicle == name]
        return [(name, "playsRole", self._group.path(assignment.role)) for assignment in lacking]

    def _holds(self, engaged: Mapping[str, Engagement], situation: Situation) -> bool:
        """True if the group must not gather yet.

        With ``calls``, it waits while a job is vacant, or assigned but neither progressed nor overdue; else while work
        is left.
        """
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

    def _engagement(self, data: VehicleData, situation: Situation) -> Engagement:
        work, name, now_s = situation.work, data.name, situation.now_s
        seen_s = now_s if name == self._me else situation.heard_s.get(name, 0.0)
        paths = situation.unheard.get(name, ())
        unheard = [role.name for role in work.unfinished if self._group.path(role.name) in paths]
        return self._expectations.of(data, work.held_by(name), work, now_s, seen_s, unheard)

    def _is_due(self, engaged: Mapping[str, Engagement], late: Collection[object], situation: Situation) -> bool:
        """True if the basis of the last plan has changed; ``calls`` also demands a call or vacancy."""
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
        planned_on = (
            work.done,
            holders,
            frozenset(engaged),
            frozenset(late),
            frozenset(idle),
            len(work.open),
            frozenset(short),
        )
        is_due = planned_on != self._planned_on
        self._planned_on = planned_on
        return is_due

    def _revision(
        self, engaged: Mapping[str, Engagement], late: Collection[tuple[str, str]], situation: Situation
    ) -> list[Statable]:
        work, path = situation.work, self._group.path
        if self._with.repairs == "never":
            return self._first_given(engaged, situation)
        held = {
            (name, role.name)
            for name, engagement in engaged.items()
            for role in (*engagement.begun, *engagement.queued)
        }
        taken = [(name, role) for name, role in sorted(late) if (name, role) in held]
        deaf = {name for name, _ in late}
        free = [data for data in work.workers if data.name not in deaf]
        lost = {role for _, role in taken}
        vacant = [role for role in work.open if not work.holders(role) or role.name in lost]
        plan = revised(work, vacant, free, engaged, situation.now_s, self._with.margin)
        said: list[Statable] = [(name, "leftRole", path(role)) for name, role in taken]
        given: list[Statable] = []
        for data in free:
            engagement = engaged[data.name]
            meant = plan.roles[data.name][: max(0, self._with.queue - len(engagement.begun))]
            said += [(data.name, "leftRole", path(role.name)) for role in engagement.queued if role not in meant]
            given += [(data.name, "playsRole", path(role.name)) for role in meant if role not in engagement.queued]
        return [*said, *given, *self._help(engaged, plan, deaf, situation)]

    def _first_given(self, engaged: Mapping[str, Engagement], situation: Situation) -> list[Statable]:
        """Assign jobs without any former assignment, on top of the jobs held."""
        work = situation.work
        new = [role for role in work.open if not work.holders(role) and role.name not in self._given]
        after = {data.name: engaged[data.name].end(data, work) for data in work.workers}
        plan = planned(work, new, work.workers, after)
        said: list[Statable] = []
        for data in work.workers:
            engagement = engaged[data.name]
            room = max(0, self._with.queue - len(engagement.begun) - len(engagement.queued))
            said += [(data.name, "playsRole", self._group.path(role.name)) for role in plan.roles[data.name][:room]]
        return said

    def _help(
        self, engaged: Mapping[str, Engagement], plan: AllocationPlan, deaf: Collection[str], situation: Situation
    ) -> list[Statable]:
        work = situation.work
        idle = [d for d in work.workers if d.name not in deaf and not engaged[d.name].begun and not plan.roles[d.name]]
        ends_s = {role.name: engagement.outlook.free_s for engagement in engaged.values() for role in engagement.begun}
        found = helped(work, idle, ends_s, situation.now_s, self._with.help_s)
        return [(assignment.vehicle, "playsRole", self._group.path(assignment.role)) for assignment in found]

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
