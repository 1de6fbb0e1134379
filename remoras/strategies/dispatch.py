"""The dispatcher: what the head of a group does about jobs during the mission, under several strategies.

Whenever something has changed (a job is done, somebody is without work, has left, is absent, does not acknowledge), it
plans anew what nobody has begun, by the allocator that all share, and states what its plan changes. Members whose turn
it is not are told of their next jobs only, ``queue`` at a time.
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

QUEUE = Field(ge=1, le=64, description="most jobs that a vehicle holds, the one it is at included")
MARGIN = Field(
    ge=0.0, le=1.0, description="share of the time left by which the end has to come earlier for jobs to be moved"
)
HELP = Field(ge=0.0, le=1e6, description="time that helping at another's job has to save (s)")
ACKNOWLEDGE = Field(ge=1, le=10_000, description="TDMA frames that a member may take to acknowledge a job")

NEXT_JOBS = 2
"""Queue of a head that tells next jobs only, where it is no parameter."""
NOT_HEAD = Move(until_news=True)


@dataclass(frozen=True, slots=True)
class Dispatching:
    """How a head gives out jobs.

    Attributes:
        queue: most jobs that a vehicle holds.
        margin: share of the time left by which the end has to come earlier for jobs to be moved.
        help_s: time that helping at another's job has to save.
        acknowledge_rounds: TDMA frames that a member may take to acknowledge a job.
        repairs: ``changes``: the plan is mended when something has changed, and the group does not count as gathered
            while there is work left. ``calls``: only while somebody without work calls for it, or something is vacant,
            and the group may gather where members have begun the work and given way. ``never``: what was given once
            stays as it was given.
    """

    queue: int
    margin: float
    help_s: float
    acknowledge_rounds: int
    repairs: str = "changes"


class Dispatcher:
    """The head's part, for each member: another may come to lead. Other members have nothing to decide."""

    def __init__(self, me: str, group: Group, dispatching: Dispatching) -> None:
        self._me = me
        self._group = group
        self._with = dispatching
        self._unheard_since: dict[tuple[str, str], int] = {}  # round, by (vehicle, role)
        self._expectations = Expectations()
        self._planned_on: object = None
        self._taken: dict[tuple[str, str], tuple[float, float]] = {}  # share left and time due, by (vehicle, role)
        self._was_led = False
        self._given: set[str] = set()  # jobs that somebody has been given, where nothing is mended

    def negotiate(self, situation: Situation) -> Move:
        """Plan anew if something has changed, and state what that changes."""
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
        """Roles that a former head gave, on succeeding it: who never heard of its own would be waited for in vain.

        A member may have heard that this vehicle has such a job, and would refuse it as taken.
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
        """What is said at once: a role that changes hands is left and taken in one block, which counts whole.

        Who heard that it is to take a role, and not that another one left it, would find no room.
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
        """Roles without a job that a vehicle needs with a job which it is given."""
        name, attribute, _ = fact
        if attribute != "playsRole":
            return []
        lacking = [role for role in common_roles(work, {name}) if role.vehicle == name]
        return [(name, "playsRole", self._group.path(assignment.role)) for assignment in lacking]

    def _holds(self, engaged: Mapping[str, Engagement], situation: Situation) -> bool:
        """True while the group has work left; where members may give way, while a job is vacant or still to be begun.

        Who was given a job is waited for until it gets on with it, or should have done it.
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
        """What a vehicle is at and holds, as far as this one can tell."""
        work, name, now_s = situation.work, data.name, situation.now_s
        seen_s = now_s if name == self._me else situation.heard_s.get(name, 0.0)
        paths = situation.unheard.get(name, ())
        unheard = [role.name for role in work.unfinished if self._group.path(role.name) in paths]
        return self._expectations.of(data, work.held_by(name), work, now_s, seen_s, unheard)

    def _is_due(self, engaged: Mapping[str, Engagement], late: Collection[object], situation: Situation) -> bool:
        """True if something has changed since the last plan and, with ``calls``, somebody calls for work."""
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
        """Roles that change hands, by the plan of now."""
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
        """Jobs that nobody was ever given, by a plan on top of what each vehicle holds."""
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
        """(vehicle, role) that this vehicle stated too long ago without an acknowledgement."""
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
