"""Allocator shared by all shipped strategies: cost, assignment and order of jobs.

Strategies differ in the deciding vehicle, its knowledge and its messages; the decision rule is common:

* ``Work.after`` gives the completion time of the known remainder of a job. Jobs are ordered nearest first.
* A present vehicle keeps a begun job; its expected end precedes all new jobs (``Expectations``).
* Two construction heuristics and a local search minimise the makespan (``search``).
* A plan under way changes only if the makespan falls by a margin (``revised``).
* A vehicle without a job helps at a job with a vacancy if that saves enough time (``helped``).
* Ties fall by job name and vehicle node: neither file order nor vehicle names matter.

Expectations use the static data shared by the fleet; true speeds may differ. The method is ours: the papers leave it
open.
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
    """Jobs of each vehicle, as roles in order of execution, and its completion time (s)."""

    roles: Mapping[str, Roles]
    ends_s: Mapping[str, float]

    @property
    def end_s(self) -> float:
        """Makespan: time (s) at which the last vehicle completes its jobs."""
        return max(self.ends_s.values(), default=0.0)


@dataclass(frozen=True)
class Engagement:
    """Roles held by a vehicle: jobs begun, jobs queued.

    Attributes:
        ending: computes time and place at the end of the begun jobs; evaluated lazily, since rarely needed.
    """

    begun: Roles
    queued: Roles
    ending: Callable[[], Outlook]

    @cached_property
    def outlook(self) -> Outlook:
        """Time and place at which the vehicle completes its begun jobs."""
        return self.ending()

    def end(self, data: VehicleData, work: Work) -> Outlook:
        """Return time and place at which the vehicle completes all held jobs."""
        return work.after_all(self.outlook, data, self.queued)


class Expectations:
    """One vehicle's estimate of the current job of each vehicle and of its completion time."""

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
        """Return the engagement of a vehicle.

        A vehicle turns to the nearest job and is from then on expected to complete it on time. Once parts of the job
        are known to be done, the estimate uses the remainder, from the last known position.

        Args:
            held: its roles.
            now_s: earliest time at which the vehicle is free.
            seen_s: time of its last received position; now if None.
            unheard: names of roles that it has not acknowledged: it may turn to them later than now.
        """
        here = Outlook(now_s, work.position_m(data.name))
        if not held:
            self._at.pop(data.name, None)
            return Engagement((), (), lambda: here)
        current = next((role for role in held if role.name == self._at.get(data.name, ("",))[0]), None)
        if current is None or (current.name in unheard and share_left(work.job(current)) == 1.0):
            current = work.in_order(here, data, held)[0]
            after = work.after(here, data, current)
            self._at[data.name] = current.name, now_s if after is None else after.free_s
        begun = [current, *(role for role in held if role is not current and share_left(work.job(role)) < 1.0)]
        due_s, from_s = self._at[data.name][1], now_s if seen_s is None else seen_s

        def ending() -> Outlook:
            end_s, place_m = expected_end(current, data, work, now_s, from_s, due_s)
            return work.after_all(Outlook(max(now_s, end_s), place_m), data, begun[1:])

        return Engagement(tuple(begun), tuple(role for role in held if role not in begun), ending)


def expected_end(
    role: RoleSpecification, data: VehicleData, work: Work, now_s: float, seen_s: float, due_s: float
) -> Outlook:
    """Time and place at the end of a job due by ``due_s``.

    Once parts of the job are known to be done, it is estimated from the remainder and the last sighting.
    """
    seen = work.after(Outlook(seen_s, work.position_m(data.name)), data, role)
    place_m = work.position_m(data.name) if seen is None else seen.position_m
    if seen is not None and share_left(work.job(role)) < 1.0:
        due_s = seen.free_s if due_s <= now_s else min(due_s, seen.free_s)
    return Outlook(due_s, place_m)


# Planning ----------------------------------------------------------------------------------------


def planned(
    work: Work, roles: Sequence[RoleSpecification], free: Sequence[VehicleData], outlooks: Mapping[str, Outlook]
) -> AllocationPlan:
    """Allocate ``roles`` to the vehicles ``free`` so that the makespan is minimal (heuristic).

    Args:
        outlooks: time and place at which each vehicle is free.
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
            _, _, name, kept[name] = min(ends, key=lambda end: end[:2])
    return kept


def affordable(work: Work, data: VehicleData, engaged: Engagement) -> Roles:
    """Return the queued roles for which the vehicle has the energy."""
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
    """Return a plan for vacant and queued roles; keep the queues unless replanning saves a margin.

    Args:
        engaged: held roles per vehicle; begun jobs stay.
        now_s: time of the plan.
        margin: share of the remaining time by which a new plan must end earlier.
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
    """Assign vehicles without work to other vehicles' jobs with a vacancy, largest saving first.

    If n vehicles need another T for a job, one more with travel time w saves (T - w) / (n + 1).

    Args:
        idle: vehicles that neither have work nor can be given any.
        ends_s: expected end of each job, by role name.
        least_s: minimum saving (s).
        n_holders: number of vehicles per job; the holders of its role if None.
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
        saving_s, _, _, data, role = max(saved, key=lambda option: option[:3])
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
    """Plan all vacant jobs on top of the roles that members hold."""
    outlooks = {
        data.name: work.after_all(Outlook(0.0, work.position_m(data.name)), data, work.held_by(data.name))
        for data in work.workers
    }
    return planned(work, work.vacant, work.workers, outlooks)


def all_jobs(work: Work, help_s: float = math.inf) -> tuple[RoleAssignment, ...]:
    """Return the assignments of ``job_plan``, plus help for idle vehicles if it saves ``help_s``.

    Vehicles with the latest expected end come first, since roles sent at run time take effect in that order.
    """
    plan = job_plan(work)
    jobs = tuple(sorted(assignments(work, plan), key=lambda assignment: -plan.ends_s[assignment.vehicle]))
    ends_s = {}
    for name, roles in plan.roles.items():
        if roles:
            after = work.after(Outlook(0.0, work.position_m(name)), work.database[name], roles[0])
            ends_s[roles[0].name] = plan.ends_s[name] if after is None else after.free_s
    idle = [data for data in work.workers if not plan.roles[data.name] and not work.held_by(data.name)]
    return jobs + tuple(helped(work, idle, ends_s, 0.0, help_s))


def assignments(work: Work, plan: AllocationPlan, most_each: int | None = None) -> tuple[RoleAssignment, ...]:
    """Return the roles of a plan, at most the first ``most_each`` per vehicle; all if None."""
    return tuple(work.assignment(role, name) for name, roles in plan.roles.items() for role in roles[:most_each])
