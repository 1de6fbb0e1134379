"""Jobs of a mission, and one vehicle's knowledge of their assignment.

A mission declares jobs, a strategy assigns them; neither knows the other's vocabulary. A role names the job of its
holder. A job with prerequisites is open only once they are done.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol, TypeVar

from exchange.arithmetic import distance
from remoras.beliefs import Key, Known
from remoras.database import HOME_MARGIN, AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification

Point = tuple[float, float]


PART = 0.25
"""Share of a job worth the travel if others complete it."""
UNABLE_TO, IS_IMPOSSIBLE = "unableTo", "isImpossible"
"""Attributes for inability of a vehicle, or of all present ones; optional in a mission."""


class Outlook(NamedTuple):
    """Expected completion: time (s) and place.

    >>> from types import SimpleNamespace
    >>> Outlook(10.0, (0.0, 0.0)).stayed((0.0, 8.0), 5.0, SimpleNamespace(transit_speed_mps=2.0))
    Outlook(free_s=19.0, position_m=(0.0, 8.0))
    """

    free_s: float
    position_m: Point

    def stayed(self, place_m: Point, stay_s: float, data: VehicleData) -> Outlook:
        """Return the outlook after travel to a place and a stay there."""
        way_s = distance(self.position_m, place_m) / data.transit_speed_mps
        return Outlook(self.free_s + way_s + stay_s, place_m)


class Job(Protocol):
    """Work to be done once, at a place, by one vehicle, or by as many at once as a member ``n_vehicles`` states.

    >>> @dataclass(frozen=True)
    ... class Visit:
    ...     name: str
    ...     place_m: Point
    ...     stay_s: float = 60.0
    ...     needs: tuple[str, ...] = ()
    ...
    ...     @property
    ...     def done(self) -> Key:
    ...         return "jobDone", self.name
    ...
    ...     def is_able(self, data: VehicleData) -> bool:
    ...         return True
    ...
    ...     def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
    ...         return outlook.stayed(self.place_m, self.stay_s, data)
    >>> buoy: Job = Visit("buoy", (0.0, 50.0))
    >>> share_left(buoy), vehicles_taken(buoy)
    (1.0, 1)
    """

    @property
    def name(self) -> str:
        """Name of its instance in the ontology, unique in the scenario."""

    @property
    def place_m(self) -> Point:
        """Position, for messages and figures."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Jobs that must be done before."""

    @property
    def done(self) -> Key:
        """Fact (attribute, instance) that marks the job as done once known."""

    def is_able(self, data: VehicleData) -> bool:
        """True if a vehicle has the abilities (sensor, arm, depth); roles are checked separately.

        Abilities are static; failures and new requirements are facts: see ``HinderedJob``.
        """

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """Return time and place at which the vehicle is free after this job; None if unable.

        Called thousands of times per run: cache all data of the job alone.
        """


class DivisibleJob(Job, Protocol):
    """Job done in parts, or discovered during the mission.

    Unless ``resumed`` is False, a successor resumes it. Several vehicles may do it, up to the maximum of its role.

    >>> class Survey(DivisibleJob):
    ...     share_left, resumed = 0.25, False
    >>> share_left(Survey()), is_resumed(Survey())
    (0.25, False)
    """

    @property
    def share_left(self) -> float:
        """Remaining share of the job, 0..1; 0 once done."""

    def left(self, facts: Known) -> DivisibleJob | None:
        """Return the remaining job by the known ``facts``; None while it is not known to exist.

        It may depend only on facts about its own instance. Able vehicles stay the same, but see ``HinderedJob``.
        """


class HinderedJob(Job, Protocol):
    """Job with run-time facts on additional requirements, or on lost abilities of vehicles."""

    @property
    def rests_on(self) -> Collection[Key]:
        """Facts read by ``left`` besides those about its own instance."""

    @property
    def hindrances(self) -> tuple[str, ...]:
        """Blocking conditions as text; while unchanged, the able vehicles stay the same."""

    def left(self, facts: Known) -> HinderedJob:
        """Return the remaining job, with ``is_able`` by the known facts."""

    def is_ever_able(self, data: VehicleData) -> bool:
        """True if a vehicle is able under some conditions: then it may be assigned the job."""


def share_left(job: Job) -> float:
    """Return the remaining share of a job, 0..1; 1 for an indivisible one."""
    return getattr(job, "share_left", 1.0)


def vehicles_taken(job: Job) -> int:
    """Return the number of vehicles that a job needs at once: ``n_vehicles``, else 1."""
    return getattr(job, "n_vehicles", 1)


def hindrances(job: Job) -> tuple[str, ...]:
    """Return the blocking conditions of a job as text; empty by default."""
    return getattr(job, "hindrances", ())


def is_ever_able(job: Job, data: VehicleData) -> bool:
    """True if a vehicle may be assigned a job under some conditions; see ``HinderedJob``."""
    asked = getattr(job, "is_ever_able", job.is_able)
    return bool(asked(data))


def is_resumed(job: Job) -> bool:
    """True if a successor resumes the job: a divisible job unless ``resumed`` is False."""
    return hasattr(job, "share_left") and getattr(job, "resumed", True)


def jobs_left(jobs: Mapping[str, Job], facts: Known) -> tuple[dict[str, Job], frozenset[str]]:
    """Return the known jobs, reduced by ``facts`` to their remainder, and the finished ones."""
    left: dict[str, Job] = {}
    done = set()
    for name, job in jobs.items():
        rest = job.left(facts) if hasattr(job, "left") else job
        if rest is None:
            continue
        left[name] = rest
        if facts.get(job.done) is not None or share_left(rest) == 0.0:
            done.add(name)
    return left, frozenset(done)


@dataclass(frozen=True)
class Work:
    """Jobs of one group, as known to one vehicle at one time.

    ``jobs`` are those known, by name, reduced to their remainder; ``done`` those known to be done. ``positions_m`` are
    the last known ones, by default the start. ``unavailable`` vehicles declared to take no jobs. ``is_enough``: the
    goal needs no further work. ``energy_j``: known energy left at ``now_s``, the start time of outlooks; vehicles with
    sufficient energy are missing. ``barred``: (vehicle, role) excluded from assignment. ``given_anew``: jobs reassigned
    despite a report of completion; further reports are ignored. ``unable``: (vehicle, job) by own report.

    >>> from types import SimpleNamespace
    >>> group = Group("Divers", (RoleSpecification("Visitor", job="buoy"),))
    >>> work = Work(group, Organisation(), AUVDatabase(()), {"buoy": SimpleNamespace(needs=())})
    >>> [role.name for role in work.vacant]
    ['Visitor']
    """

    group: Group
    organisation: Organisation
    database: AUVDatabase
    jobs: Mapping[str, Job]
    done: frozenset[str] = frozenset()
    positions_m: Mapping[str, Point] = field(default_factory=dict)
    unavailable: frozenset[str] = frozenset()
    is_enough: bool = False
    energy_j: Mapping[str, float] = field(default_factory=dict)
    now_s: float = 0.0
    barred: frozenset[tuple[str, str]] = frozenset()
    given_anew: frozenset[str] = frozenset()
    unable: frozenset[tuple[str, str]] = frozenset()

    @cached_property  # 0.5 % of a mission
    def roles(self) -> tuple[RoleSpecification, ...]:
        """Roles of the group with a known job, in order of job names."""
        return tuple(sorted((role for role in self.group.roles if role.job in self.jobs), key=lambda r: r.job or ""))

    @cached_property  # 0.5 to 20 % of a mission
    def unfinished(self) -> tuple[RoleSpecification, ...]:
        """Roles with an unfinished job."""
        return tuple(role for role in self.roles if role.job not in self.done)

    @property
    def is_begun(self) -> bool:
        """True if any job is held or done."""
        return any(self.holders(role) or role.job in self.done for role in self.roles)

    @cached_property  # 0.4 % of a mission
    def open(self) -> tuple[RoleSpecification, ...]:
        """Unfinished roles with prerequisites done; once the goal is met, held or reassigned ones."""
        open_roles = tuple(role for role in self.unfinished if self.done.issuperset(self.job(role).needs))
        if not self.is_enough:
            return open_roles
        return tuple(role for role in open_roles if self.holders(role) or role.job in self.given_anew)

    @property
    def vacant(self) -> tuple[RoleSpecification, ...]:
        """Open roles without a holder."""
        return tuple(role for role in self.open if not self.holders(role))

    @cached_property  # 3 % of a mission
    def workers(self) -> tuple[VehicleData, ...]:
        """Members that take jobs and are able to do some job of the group, in node order."""
        members = set(self.members).difference(self.unavailable)
        return tuple(
            data
            for data in self.database.values()
            if data.name in members and any(self.able(data, role) for role in self.roles)
        )

    @cached_property  # 2 to 4 % of a mission
    def has_something_left(self) -> bool:
        """True while the goal needs work, and some job is held or achievable by a worker."""
        # Work beyond the goal does not count: its vehicle is free to answer calls.
        return not self.is_enough and any(
            self.holders(role) or any(self._may_do(worker, role) for worker in self.workers)
            for role in self.unfinished
            if role.job not in self.short_handed
        )

    @cached_property  # 2 % of a mission; the same object until a job changes
    def impossible(self) -> frozenset[str]:
        """Unfinished jobs without holder and able worker, and ``short_handed`` ones."""
        return self.short_handed | frozenset(
            role.job
            for role in self.unfinished
            if role.job and not self.holders(role) and not any(self.able(data, role) for data in self.workers)
        )

    @cached_property  # 3 % of a mission with jobs for several vehicles
    def short_handed(self) -> frozenset[str]:
        """Unfinished jobs that need more vehicles at once than members are able."""
        takes = {role: vehicles_taken(self.job(role)) for role in self.unfinished}
        crew = [self.database[name] for name in set(self.members).difference(self.unavailable)]
        return frozenset(
            role.job
            for role, n_taken in takes.items()
            if role.job and n_taken > 1 and sum(self._has_what_it_takes(data, role) for data in crew) < n_taken
        )

    @property
    def members(self) -> tuple[str, ...]:
        """Vehicles of the group."""
        return self.organisation.members(self.group.name)

    @property
    def heads(self) -> tuple[str, ...]:
        """Leaders of the group."""
        return self.organisation.heads(self.group.name)

    def held_by(self, vehicle: str) -> list[RoleSpecification]:
        """Return a vehicle's unfinished roles, also those not open by the knowledge of this vehicle."""
        holders = self._holders
        return [role for role in self.unfinished if vehicle in holders[role.name]]

    def holders(self, role: RoleSpecification) -> tuple[str, ...]:
        """Return the vehicles with the role."""
        return self._holders[role.name]

    @cached_property  # 2 to 50 % of a mission
    def _holders(self) -> dict[str, tuple[str, ...]]:
        return {role.name: self.organisation.members(self.group.name, role.name) for role in self.group.roles}

    def job(self, role: RoleSpecification) -> Job:
        """Return the job of a role."""
        return self.jobs[role.job or ""]

    def able(self, data: VehicleData, role: RoleSpecification) -> bool:
        """True if the vehicle can play the role beside its own ones, and is able to do its job."""
        is_unable = bool(self.unable) and (data.name, role.job) in self.unable
        return not is_unable and role.job not in self.short_handed and self._has_what_it_takes(data, role)

    def _has_what_it_takes(self, data: VehicleData, role: RoleSpecification) -> bool:
        # Without ``unable`` and ``short_handed``: the vehicle may still help others.
        if self.barred and (data.name, role.name) in self.barred:
            return False
        if role.incompatible and self.organisation.is_excluded(data.name, role):
            return False
        return data.can_play(self.group.name, role.name) and self.job(role).is_able(data)

    def position_m(self, vehicle: str) -> Point:
        """Return the last known position."""
        return self.positions_m.get(vehicle, self.database[vehicle].start_m)

    def after(self, outlook: Outlook, data: VehicleData, role: RoleSpecification) -> Outlook | None:
        """Return time and place after the job of ``role``; None if unable."""
        return self.job(role).after(outlook, data) if self.able(data, role) else None

    def after_all(self, outlook: Outlook, data: VehicleData, roles: Iterable[RoleSpecification]) -> Outlook:
        """Return time and place after all feasible jobs of ``roles``, ordered by ``in_order``."""
        left = self._by_job(roles)
        while left:
            outlook = self.job(self._nearest(left, outlook)).after(outlook, data) or outlook
        return outlook

    def arrival_s(
        self, outlook: Outlook, data: VehicleData, roles: Iterable[RoleSpecification], place_m: Point | None
    ) -> float:
        """Return when (s) a vehicle has done all feasible jobs of ``roles`` and come to a place."""
        end = self.after_all(outlook, data, roles)
        way_m = 0.0 if place_m is None else distance(end.position_m, place_m)
        return end.free_s + way_m / data.transit_speed_mps

    def affordable(
        self, outlook: Outlook, data: VehicleData, roles: Iterable[RoleSpecification]
    ) -> tuple[RoleSpecification, ...]:
        """Return the roles that the vehicle's energy covers with its way home, in the order given.

        Travel to a job uses transit power; the work, the return and the time until ``outlook`` use survey power. A
        resumable job counts if the energy covers the share ``PART`` of it; no role follows it.
        """
        left_j = self.energy_j.get(data.name)
        if left_j is None:
            return tuple(roles)
        survey_w, transit_w = data.power_w(data.survey_speed_mps), data.power_w(data.transit_speed_mps)
        left_j -= survey_w * (outlook.free_s - self.now_s)
        affordable = []
        for role in roles:
            after = self.job(role).after(outlook, data)
            if after is None:
                continue
            all_s = after.free_s - outlook.free_s
            way_s = min(all_s, distance(outlook.position_m, self.job(role).place_m) / data.transit_speed_mps)
            home_s = HOME_MARGIN * distance(after.position_m, data.start_m) / data.survey_speed_mps
            for_job_j = left_j - transit_w * way_s - survey_w * home_s
            job_j = survey_w * (all_s - way_s)
            if job_j <= for_job_j:
                affordable.append(role)
                left_j, outlook = left_j - transit_w * way_s - job_j, after
            # A successor resumes the rest; with its energy spent, the vehicle takes no further role.
            elif PART * job_j <= for_job_j and is_resumed(self.job(role)):
                return (*affordable, role)
        return tuple(affordable)

    def affords(self, outlook: Outlook, data: VehicleData, role: RoleSpecification) -> bool:
        """True if the energy suffices for the job of ``role`` from ``outlook``, see ``affordable``."""
        return data.name not in self.energy_j or bool(self.affordable(outlook, data, [role]))

    def _may_do(self, data: VehicleData, role: RoleSpecification) -> bool:
        return self.able(data, role) and self.affords(Outlook(self.now_s, self.position_m(data.name)), data, role)

    def awaited(self, vehicle: str, now_s: float) -> float:
        """Return the share of the rendezvous wait due to a vehicle, 0..1, see ``Groups.awaited``."""
        held = self._held
        own_s = self._free_at(vehicle, now_s).free_s - now_s if vehicle in held else 0.0
        if own_s <= 0.0:
            return 1.0
        others_s = max((self._free_at(name, now_s).free_s - now_s for name in held if name != vehicle), default=0.0)
        return max(0.0, 1.0 - others_s / own_s)

    def ended(
        self, vehicle: str, caller: str, place_m: Point, waiting: Collection[str], now_s: float, n_helpers: int = 1
    ) -> float:
        """Return the share, 0..1, of a caller's wait at a place that a vehicle ends by going there.

        It is 1 - T / T_else. T is the travel time; T_else is the time until ``n_helpers`` members have done their jobs
        and come, the vehicle included if it has jobs. Members ``waiting`` are not available before.
        """
        way_s = distance(self.position_m(vehicle), place_m) / self.database[vehicle].transit_speed_mps
        come_s = []
        for name in self.members:
            if name != caller and name not in waiting and (name != vehicle or name in self._held):
                free = self._free_at(name, now_s)
                to_come_s = distance(free.position_m, place_m) / self.database[name].transit_speed_mps
                come_s.append(free.free_s - now_s + to_come_s)
        else_s = sorted(come_s)[n_helpers - 1] if len(come_s) >= n_helpers else math.inf
        return max(0.0, 1.0 - way_s / else_s) if else_s > 0.0 else 0.0

    @cached_property  # 2 % of a mission with many helpers
    def _held(self) -> dict[str, list[RoleSpecification]]:
        held: dict[str, list[RoleSpecification]] = {}
        for role in self.unfinished:
            for name in self.holders(role):
                held.setdefault(name, []).append(role)
        return held

    def _free_at(self, vehicle: str, now_s: float) -> Outlook:
        outlook = Outlook(now_s, self.position_m(vehicle))
        return self.after_all(outlook, self.database[vehicle], self._held.get(vehicle, ()))

    def seen(self, positions_m: Mapping[str, Point], now_s: float) -> Work:
        """Return the work at another time (s) and positions; only if no vehicle is short of energy."""
        _ = self.workers, self.open  # cache before copying
        return self._with(positions_m=positions_m, now_s=now_s)

    def with_less(self, jobs: Mapping[str, Job]) -> Work:
        """Return the work with smaller remainders of the same jobs, sharing cached abilities."""
        return self._with(jobs=jobs)

    def _with(self, **fields: Any) -> Work:
        made = object.__new__(Work)
        vars(made).update(vars(self), **fields)
        return made

    def in_order(
        self, outlook: Outlook, data: VehicleData, roles: Iterable[RoleSpecification]
    ) -> tuple[RoleSpecification, ...]:
        """Return ``roles`` in order of execution: nearest job first."""
        left, ordered = self._by_job(roles), list[RoleSpecification]()
        while len(left) > 1:
            ordered.append(self._nearest(left, outlook))
            outlook = self.job(ordered[-1]).after(outlook, data) or outlook
        return (*ordered, *left)

    def _by_job(self, roles: Iterable[RoleSpecification]) -> list[RoleSpecification]:
        return sorted(roles, key=lambda role: role.job or "")

    def _nearest(self, left: list[RoleSpecification], outlook: Outlook) -> RoleSpecification:
        distances_m = [distance(outlook.position_m, self.job(role).place_m) for role in left]
        return left.pop(distances_m.index(min(distances_m)))

    def knowing(self, done: Collection[str]) -> Work:
        """Return the work with additional finished jobs, except reassigned ones."""
        more = frozenset(done) - self.done - self.given_anew
        return replace(self, done=self.done | more) if more else self

    def assignment(self, role: RoleSpecification, vehicle: str) -> RoleAssignment:
        """Return the assignment of ``role`` to ``vehicle``."""
        return RoleAssignment(self.group.name, role.name, vehicle)


K = TypeVar("K")
V = TypeVar("V")


class Computed(Mapping[K, V]):
    """Mapping whose values are computed on lookup, once unless ``anew``."""

    def __init__(self, keys: Collection[K], value_of: Callable[[K], V], anew: bool = False) -> None:
        self._keys, self._value_of, self._is_kept = keys, value_of, not anew
        self._known: dict[K, V] = {}

    def __getitem__(self, key: K) -> V:
        if key in self._known:
            return self._known[key]
        if key not in self._keys:
            raise KeyError(key)
        value = self._value_of(key)
        if self._is_kept:
            self._known[key] = value
        return value

    def __contains__(self, key: object) -> bool:
        return key in self._keys

    def __iter__(self) -> Iterator[K]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)


def precedence(group: Group, jobs: Mapping[str, Job]) -> frozenset[Key]:
    """Return the facts that open jobs of the group: its allocation depends on them."""
    needed = {need for role in group.roles if role.job and role.job in jobs for need in jobs[role.job].needs}
    return frozenset(jobs[need].done for need in needed if need in jobs)
