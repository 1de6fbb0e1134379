"""The allocator that all shipped strategies share: what a job costs, who had best do it, and in which order.

Strategies differ in who decides, on whose knowledge and by which messages. What they decide by is here:

* **Cost.** When a vehicle will have done a job is said by ``Work.after``, over what is known to be left of it. Of
  several jobs the nearest attracts a vehicle most, so a plan orders jobs in that way too.
* **Work begun stays.** A job that a vehicle is at is not taken from it while it is present; what it is expected to be
  at counts before anything new (``Expectations``).
* **Plan.** Jobs go out in turns, or the longest first; then they are moved and exchanged until the end comes no
  earlier, and the better one of the two plans counts (``search``).
* **Revision.** A plan that is under way is changed only where the end comes earlier by a margin (``revised``).
* **Help.** Who is left without a job may join another one at a job whose role has room, if that saves enough.
* **Ties.** Jobs are taken by name and vehicles by node, so neither the order of a file nor a vehicle's name decides.

Expectations use the data that the whole fleet shares; vehicles may be slower or faster than their data. The method is
ours: the papers that the strategies follow leave it open.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from exchange.arithmetic import distance
from remoras.database import VehicleData
from remoras.organisation import RoleAssignment, RoleSpecification
from remoras.strategies.search import Roles, Search
from remoras.work import Outlook, Work, share_left


@dataclass(frozen=True, slots=True)
class AllocationPlan:
    """Who does what, in which order, and when each will have done it.

    Attributes:
        roles: jobs of each vehicle by their roles, in the order in which they are to be done.
        ends_s: when each vehicle will have done them.
    """

    roles: Mapping[str, Roles]
    ends_s: Mapping[str, float]

    @property
    def end_s(self) -> float:
        """When the last of the vehicles will have done its jobs."""
        return max(self.ends_s.values(), default=0.0)


@dataclass(frozen=True)
class Engagement:
    """What a vehicle holds.

    Attributes:
        begun: the jobs that it has begun.
        queued: those that it has not.
        ending: works out when and where the former end; mostly nobody asks.
    """

    begun: Roles
    queued: Roles
    ending: Callable[[], Outlook]

    @cached_property
    def outlook(self) -> Outlook:
        """When and where the vehicle will have done what it has begun."""
        return self.ending()

    def end(self, data: VehicleData, work: Work) -> Outlook:
        """When and where the vehicle will have done all that it holds."""
        return work.after_all(self.outlook, data, self.queued)


class Expectations:
    """What each vehicle is at, and when it will have done it, as far as another one can tell."""

    def __init__(self) -> None:
        self._at: dict[str, tuple[str, float]] = {}  # role, and when it should have been done

    def of(
        self,
        data: VehicleData,
        held: Sequence[RoleSpecification],
        work: Work,
        now_s: float,
        seen_s: float | None = None,
        unheard: Collection[str] = (),
    ) -> Engagement:
        """What a vehicle holds, and when it has done what it has begun.

        A vehicle turns to the nearest job. From then on it is expected to have done it when its data
        say so; where parts of the job are known to be done, what is left counts from where and when it was seen last.

        Args:
            data: of the vehicle.
            held: what it holds.
            work: as it is known.
            now_s: it is not free before.
            seen_s: when its position was heard; now if None.
            unheard: names of roles of which it is not known to have heard: it turns to them later than now.
        """
        here = Outlook(now_s, work.position_m(data.name))
        if not held:
            self._at.pop(data.name, None)
            return Engagement((), (), lambda: here)
        at = next((role for role in held if role.name == self._at.get(data.name, ("",))[0]), None)
        if at is None or (at.name in unheard and share_left(work.job(at)) == 1.0):
            at = work.in_order(here, data, held)[0]
            then = work.after(here, data, at)
            self._at[data.name] = at.name, now_s if then is None else then.free_s
        begun = [at, *(role for role in held if role is not at and share_left(work.job(role)) < 1.0)]
        due_s, from_s = self._at[data.name][1], now_s if seen_s is None else seen_s

        def ending() -> Outlook:
            return work.after_all(_after(at, data, work, now_s, from_s, due_s), data, begun[1:])

        return Engagement(tuple(begun), tuple(role for role in held if role not in begun), ending)


def _after(
    role: RoleSpecification, data: VehicleData, work: Work, now_s: float, seen_s: float, due_s: float
) -> Outlook:
    """When and where a vehicle has done the job of a role that it should have done by ``due_s``, as seen last."""
    seen = work.after(Outlook(seen_s, work.position_m(data.name)), data, role)
    place_m = work.position_m(data.name) if seen is None else seen.position_m
    if seen is not None and share_left(work.job(role)) < 1.0:
        due_s = seen.free_s if due_s <= now_s else min(due_s, seen.free_s)
    return Outlook(max(now_s, due_s), place_m)


# Planning ----------------------------------------------------------------------------------------


def planned(
    work: Work, roles: Sequence[RoleSpecification], free: Sequence[VehicleData], outlooks: Mapping[str, Outlook]
) -> AllocationPlan:
    """Who of ``free`` does which of ``roles``: the last one to have done all is so as early as can be found.

    Args:
        work: jobs of the group.
        roles: what is to be given out.
        free: vehicles that may be given some of it.
        outlooks: when and where each of them is free.
    """
    free = sorted(free, key=lambda data: data.node)
    if work.energy_j:
        alone = {(d.name, role.name) for d in free for role in roles if not work.affords(outlooks[d.name], d, role)}
        work = replace(work, barred=work.barred | alone)
    held = Search(work, roles, free, outlooks).found()
    ordered = {data.name: work.in_order(outlooks[data.name], data, held[data.name]) for data in free}
    if work.energy_j:
        ordered = _within_energy(work, ordered, free, outlooks)
    ends_s = {data.name: work.after_all(outlooks[data.name], data, ordered[data.name]).free_s for data in free}
    return AllocationPlan(ordered, ends_s)


def _within_energy(
    work: Work, ordered: Mapping[str, Roles], free: Sequence[VehicleData], outlooks: Mapping[str, Outlook]
) -> dict[str, Roles]:
    """A plan without what vehicles cannot finish on their energy: it goes to others that can, else to nobody.

    Args:
        work: jobs of the group.
        ordered: jobs of each vehicle, by their roles, in order.
        free: the vehicles.
        outlooks: when and where each of them is free.
    """
    kept = {data.name: work.affordable(outlooks[data.name], data, ordered[data.name]) for data in free}
    over = [role for data in free for role in ordered[data.name] if role not in kept[data.name]]
    for role in sorted(over, key=lambda role: role.job or ""):
        ends: list[tuple[float, int, str, Roles]] = []
        for data in (vehicle for vehicle in free if work.able(vehicle, role)):
            meant = work.in_order(outlooks[data.name], data, [*kept[data.name], role])
            if work.affordable(outlooks[data.name], data, meant) == meant:
                end_s = work.after_all(outlooks[data.name], data, meant).free_s
                ends.append((round(end_s, 3), data.node, data.name, meant))
        if ends:
            _, _, name, kept[name] = min(ends, key=lambda found: found[:2])
    return kept


def affordable(work: Work, data: VehicleData, engaged: Engagement) -> Roles:
    """What a vehicle holds, has not begun, and has the energy for."""
    if data.name not in work.energy_j:
        return engaged.queued
    fits = work.affordable(engaged.outlook, data, work.in_order(engaged.outlook, data, engaged.queued))
    return tuple(role for role in engaged.queued if role in fits)


def revised(
    work: Work,
    vacant: Sequence[RoleSpecification],
    free: Sequence[VehicleData],
    engaged: Mapping[str, Engagement],
    now_s: float,
    margin: float,
) -> AllocationPlan:
    """A plan under way: what is vacant on top of what is queued, or all of it anew if that ends earlier by a margin.

    Args:
        work: jobs of the group.
        vacant: what nobody holds.
        free: vehicles that take jobs.
        engaged: what each of them holds; what they have begun stays with them.
        now_s: time of the plan.
        margin: by which share of the time left a new plan has to end earlier.
    """
    outlooks = {data.name: engaged[data.name].outlook for data in free}
    queued = {data.name: affordable(work, data, engaged[data.name]) for data in free}
    vacant = [*vacant, *(role for data in free for role in engaged[data.name].queued if role not in queued[data.name])]
    anew = planned(work, [*vacant, *(role for roles in queued.values() for role in roles)], free, outlooks)
    after = {data.name: work.after_all(outlooks[data.name], data, queued[data.name]) for data in free}
    on_top = planned(work, vacant, free, after)
    if on_top.end_s - anew.end_s > margin * max(0.0, on_top.end_s - now_s):
        return anew
    roles = {d.name: (*work.in_order(outlooks[d.name], d, queued[d.name]), *on_top.roles[d.name]) for d in free}
    return AllocationPlan(roles, on_top.ends_s)


# Help --------------------------------------------------------------------------------------------


def helped(
    work: Work,
    idle: Collection[VehicleData],
    ends_s: Mapping[str, float],
    now_s: float,
    least_s: float,
    n_holders: Mapping[str, int] | None = None,
) -> Iterator[RoleAssignment]:
    """Vehicles without work join others at jobs whose roles have room, where it saves most.

    Of n vehicles at a job that takes them another T, one more that needs w to come saves (T - w) / (n + 1).

    Args:
        work: jobs of the group, with their holders.
        idle: vehicles that have no work, and there is none to give them.
        ends_s: by name of a role, when its job will have been done.
        now_s: time of the plan.
        least_s: help has to save as much.
        n_holders: how many are at each job; as many as hold its role if None.
    """
    n_holders = dict(n_holders or {role.name: max(1, len(work.holders(role))) for role in work.open})
    left = sorted(idle, key=lambda data: data.node)
    ends_s = dict(ends_s)
    while left:
        saved = [
            (_saving_s(work, data, role, ends_s[role.name] - now_s, n_holders[role.name]), -data.node, -n, data, role)
            for data in left
            for n, role in enumerate(work.open)
            if role.name in ends_s
            and (role.maximum is None or role.maximum > n_holders[role.name])
            and work.able(data, role)
            and data.name not in work.holders(role)
            and work.affords(Outlook(now_s, work.position_m(data.name)), data, role)
        ]
        if not saved:
            return
        saving_s, _, _, data, role = max(saved, key=lambda found: found[:3])
        if saving_s <= least_s:
            return
        left.remove(data)
        ends_s[role.name] -= saving_s
        n_holders[role.name] += 1
        yield work.assignment(role, data.name)


def _saving_s(work: Work, data: VehicleData, role: RoleSpecification, left_s: float, n_holders: int) -> float:
    way_s = distance(work.position_m(data.name), work.job(role).place_m) / data.transit_speed_mps
    return (left_s - way_s) / (n_holders + 1)


# Before a mission --------------------------------------------------------------------------------


def job_plan(work: Work) -> AllocationPlan:
    """Every open job that nobody holds, for members in addition to what each holds."""
    outlooks = {
        data.name: work.after_all(Outlook(0.0, work.position_m(data.name)), data, work.held_by(data.name))
        for data in work.workers
    }
    return planned(work, work.vacant, work.workers, outlooks)


def all_jobs(work: Work, help_s: float = math.inf) -> tuple[RoleAssignment, ...]:
    """The roles of ``job_plan``, and help for who would be without work where it saves ``help_s``.

    Who is expected to end last comes first: where roles are told at sea, the others can wait.
    """
    plan = job_plan(work)
    given = tuple(sorted(assignments(work, plan), key=lambda assignment: -plan.ends_s[assignment.vehicle]))
    ends_s = {}
    for name, roles in plan.roles.items():
        if roles:
            then = work.after(Outlook(0.0, work.position_m(name)), work.database[name], roles[0])
            ends_s[roles[0].name] = plan.ends_s[name] if then is None else then.free_s
    idle = [data for data in work.workers if not plan.roles[data.name] and not work.held_by(data.name)]
    return given + tuple(helped(work, idle, ends_s, 0.0, help_s))


def assignments(work: Work, plan: AllocationPlan, most_each: int | None = None) -> tuple[RoleAssignment, ...]:
    """The roles of a plan, of each vehicle the first ``most_each``; all if None."""
    return tuple(work.assignment(role, name) for name, roles in plan.roles.items() for role in roles[:most_each])
