"""Work: the jobs of a mission, and what one vehicle knows of who does them.

A mission brings jobs; a strategy divides them among vehicles. Neither knows the other's words: a visit, a docking and a
search are divided alike. A role names the job that its holder does. A job may need others to be done before it: it
is open, and offered to vehicles, only once they are.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple, Protocol

from exchange.arithmetic import distance
from remoras.beliefs import Key, Known
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification

Point = tuple[float, float]


PART = 0.25
"""Share of a job that is worth the way where others go on with the rest."""
UNABLE_TO, IS_IMPOSSIBLE = "unableTo", "isImpossible"
"""By what vehicles say that they, or all who are there, are not able to do a job; some missions have no such words."""
HOME_MARGIN = 1.25
"""Energy kept for the way home, as a multiple of what the way takes."""


class Outlook(NamedTuple):
    """When (s) and where a vehicle is expected to have done what it holds."""

    free_s: float
    position_m: Point

    def stayed(self, place_m: Point, stay_s: float, data: VehicleData) -> Outlook:
        """The outlook of a vehicle that goes to a place next, and stays there."""
        way_s = distance(self.position_m, place_m) / data.transit_speed_mps
        return Outlook(self.free_s + way_s + stay_s, place_m)


class Job(Protocol):
    """Something to be done once by one vehicle, at a place.

    A runnable example::

        @dataclass(frozen=True)
        class Visit:
            name: str
            place_m: Point
            stay_s: float = 60.0
            needs: tuple[str, ...] = ()

            @property
            def done(self) -> Key:
                return "jobDone", self.name

            def is_able(self, data: VehicleData) -> bool:
                return True

            def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
                return outlook.stayed(self.place_m, self.stay_s, data)
    """

    @property
    def name(self) -> str:
        """Name of its instance in the ontology, unique in the scenario."""
        ...

    @property
    def place_m(self) -> Point:
        """Where it is, for messages and pictures."""
        ...

    @property
    def needs(self) -> tuple[str, ...]:
        """Jobs that must be done before it may be begun."""
        ...

    @property
    def done(self) -> Key:
        """The fact (attribute, instance) that says, once it is known, that the job is done."""
        ...

    def is_able(self, data: VehicleData) -> bool:
        """True if a vehicle has what the job takes (a sensor, an arm, the depth); roles are asked for apart.

        What it has is static; what has failed of that, and what the job has turned out to take, are facts: see
        ``HinderedJob``.
        """
        ...

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        """When and where the vehicle will be free if it does this job next; None if it is not able.

        Asked thousands of times in a run: remember what depends on the job alone.
        """
        ...


class DivisibleJob(Job, Protocol):
    """A job done in parts, of which a vehicle may know that some are done, or that comes up during the mission.

    Whoever takes it over goes on where the other stopped, unless ``resumed`` is False. Several vehicles may do it
    together, if its role has room.
    """

    @property
    def share_left(self) -> float:
        """Share of the whole job that is left, 0..1; 0 once it is done."""
        ...

    def left(self, facts: Known) -> DivisibleJob | None:
        """The job as far as it is left to a vehicle that knows ``facts``; None while it is not known to exist.

        Facts about other instances than the job's own may not matter: the answer is kept until one about it comes. As
        long as something is left, the same vehicles are able to do it, but for what ``HinderedJob`` says.
        """
        ...


class HinderedJob(Job, Protocol):
    """A job of which facts say at sea that it takes more than was planned, or that vehicles lack what it takes."""

    @property
    def rests_on(self) -> Collection[Key]:
        """Facts, beside those about its own instance, that ``left`` looks at."""
        ...

    @property
    def hindrances(self) -> tuple[str, ...]:
        """What is in the way, in words; nobody else is able to do the job while they stay the same."""
        ...

    def left(self, facts: Known) -> HinderedJob:
        """The job as far as it is left, of which ``is_able`` answers by what is known."""
        ...

    def is_ever_able(self, data: VehicleData) -> bool:
        """True if a vehicle is able to do it under some hindrances: then it may be given the job."""
        ...


def share_left(job: Job) -> float:
    """Share of a job that is left, 0..1; a job that is not divisible is left whole until it is done."""
    return getattr(job, "share_left", 1.0)


def vehicles_taken(job: Job) -> int:
    """How many vehicles a job takes at once: one, unless it has an attribute ``n_vehicles``."""
    return getattr(job, "n_vehicles", 1)


def hindrances(job: Job) -> tuple[str, ...]:
    """What is in the way of a job, in words, see ``HinderedJob``; nothing where it says nothing."""
    return getattr(job, "hindrances", ())


def is_ever_able(job: Job, data: VehicleData) -> bool:
    """True if a vehicle may be given a job, whatever is known of it; see ``HinderedJob``."""
    asked = getattr(job, "is_ever_able", job.is_able)
    return bool(asked(data))


def is_resumed(job: Job) -> bool:
    """True if who takes the job over goes on where another stopped: so with a divisible job that does not deny it."""
    return hasattr(job, "share_left") and getattr(job, "resumed", True)


def jobs_left(jobs: Mapping[str, Job], facts: Known) -> tuple[dict[str, Job], frozenset[str]]:
    """Jobs as a vehicle that knows ``facts`` sees them: those it knows of, as far as they are left, and those done.

    Args:
        jobs: of the mission, by name.
        facts: of the vehicle.
    """
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
    """The jobs of one group, as one vehicle knows them at one moment.

    Attributes:
        group: the group; its roles name the jobs.
        organisation: who plays which role.
        database: static data of all vehicles.
        jobs: jobs of the mission that are known to exist, by name, as far as they are left.
        done: jobs known to be done.
        positions_m: last positions known, by vehicle; the start counts where none has been heard.
        unavailable: vehicles that take no jobs, by what they said themselves.
        is_enough: the goal of the mission asks for no more than is done.
        energy_j: what vehicles have left at ``now_s``, as far as is known; who has enough for the mission is missing.
        now_s: time from which outlooks count.
        barred: (vehicle, role) of jobs that a vehicle is not to be given.
        given_anew: jobs that were given anew although they were said to be done; who repeats that is not believed.
        unable: (vehicle, job) where a vehicle says of itself that each of its ways to do the job has failed.
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

    @cached_property
    def roles(self) -> tuple[RoleSpecification, ...]:
        """Roles of the group with a job that is known to exist, by the name of the job."""
        return tuple(sorted((role for role in self.group.roles if role.job in self.jobs), key=lambda r: r.job or ""))

    @cached_property
    def unfinished(self) -> tuple[RoleSpecification, ...]:
        """Roles whose job is not known to be done."""
        return tuple(role for role in self.roles if role.job not in self.done)

    @cached_property
    def open(self) -> tuple[RoleSpecification, ...]:
        """Unfinished roles whose job may be begun: all that it needs is known to be done.

        What the goal spares nobody begins: of that only jobs are open that somebody has or that were given anew.
        """
        found = tuple(role for role in self.unfinished if self.done.issuperset(self.job(role).needs))
        if not self.is_enough:
            return found
        return tuple(role for role in found if self.holders(role) or role.job in self.given_anew)

    @property
    def vacant(self) -> tuple[RoleSpecification, ...]:
        """Open roles that nobody plays."""
        return tuple(role for role in self.open if not self.holders(role))

    @cached_property
    def workers(self) -> tuple[VehicleData, ...]:
        """Members that take jobs and are able to do some job of the group, in the order of the nodes."""
        members = set(self.members).difference(self.unavailable)
        return tuple(
            data
            for data in self.database.values()
            if data.name in members and any(self.able(data, role) for role in self.roles)
        )

    @cached_property
    def has_something_left(self) -> bool:
        """True while the goal asks for more, and there is a job that somebody holds or that a worker is able to do.

        What the goal spares may stay undone: its vehicle is free to answer calls.
        """
        return not self.is_enough and any(
            self.holders(role) or any(self._may_do(worker, role) for worker in self.workers)
            for role in self.unfinished
            if role.job not in self.short_handed
        )

    @cached_property
    def impossible(self) -> frozenset[str]:
        """Unfinished jobs that nobody holds and no member which takes jobs is able to do, and ``short_handed`` ones."""
        return self.short_handed | frozenset(
            role.job
            for role in self.unfinished
            if role.job and not self.holders(role) and not any(self.able(data, role) for data in self.workers)
        )

    @cached_property
    def short_handed(self) -> frozenset[str]:
        """Unfinished jobs that take more vehicles at once than members which take jobs are able to do them."""
        takes = {role: vehicles_taken(self.job(role)) for role in self.unfinished}
        crew = [self.database[name] for name in set(self.members).difference(self.unavailable)]
        return frozenset(
            role.job
            for role, n_taken in takes.items()
            if role.job and n_taken > 1 and sum(self._has_what_it_takes(data, role) for data in crew) < n_taken
        )

    @property
    def members(self) -> tuple[str, ...]:
        """Vehicles of the group, by name."""
        return self.organisation.members(self.group.name)

    @property
    def heads(self) -> tuple[str, ...]:
        """Vehicles that supervise the group."""
        return self.organisation.heads(self.group.name)

    def held_by(self, vehicle: str) -> list[RoleSpecification]:
        """Unfinished roles that the vehicle plays; whoever gave it a role may have known that it is open."""
        holders = self._holders
        return [role for role in self.unfinished if vehicle in holders[role.name]]

    def holders(self, role: RoleSpecification) -> tuple[str, ...]:
        """Vehicles that play the role."""
        return self._holders[role.name]

    @cached_property
    def _holders(self) -> dict[str, tuple[str, ...]]:
        """By role of the group, who plays it."""
        return {role.name: self.organisation.members(self.group.name, role.name) for role in self.group.roles}

    def job(self, role: RoleSpecification) -> Job:
        """The job of a role."""
        return self.jobs[role.job or ""]

    def able(self, data: VehicleData, role: RoleSpecification) -> bool:
        """True if the vehicle can play the role, beside those that it plays, and has what its job takes."""
        is_unable = bool(self.unable) and (data.name, role.job) in self.unable
        return not is_unable and role.job not in self.short_handed and self._has_what_it_takes(data, role)

    def _has_what_it_takes(self, data: VehicleData, role: RoleSpecification) -> bool:
        """The same of one of several at a job: whoever has waited there in vain may still help."""
        if self.barred and (data.name, role.name) in self.barred:
            return False
        if role.incompatible and self.organisation.is_excluded(data.name, role):
            return False
        return data.can_play(self.group.name, role.name) and self.job(role).is_able(data)

    def position_m(self, vehicle: str) -> Point:
        """Where the vehicle was last known to be."""
        return self.positions_m.get(vehicle, self.database[vehicle].start_m)

    def after(self, outlook: Outlook, data: VehicleData, role: RoleSpecification) -> Outlook | None:
        """When and where the vehicle will be free if it does the job of ``role`` next; None if it is not able."""
        return self.job(role).after(outlook, data) if self.able(data, role) else None

    def after_all(self, outlook: Outlook, data: VehicleData, roles: Iterable[RoleSpecification]) -> Outlook:
        """When and where the vehicle has done the jobs of ``roles`` that it is able to do, see ``in_order``."""
        left = self._by_job(roles)
        while left:
            outlook = self.job(self._nearest(left, outlook)).after(outlook, data) or outlook
        return outlook

    def affordable(
        self, outlook: Outlook, data: VehicleData, roles: Iterable[RoleSpecification]
    ) -> tuple[RoleSpecification, ...]:
        """Those of ``roles``, in the order given, that the vehicle's energy lasts for, and for the way home after.

        Ways are made in transit, all else at survey speed; up to the outlook the vehicle is taken to work. Of a job on
        which others go on, a part is worth the way: it is the last then.

        Args:
            outlook: when and where it is free.
            data: of the vehicle.
            roles: in the order in which it would do their jobs.
        """
        left_j = self.energy_j.get(data.name)
        if left_j is None:
            return tuple(roles)
        survey_w, transit_w = data.power_w(data.survey_speed_mps), data.power_w(data.transit_speed_mps)
        left_j -= survey_w * (outlook.free_s - self.now_s)
        found = []
        for role in roles:
            then = self.job(role).after(outlook, data)
            if then is None:
                continue
            all_s = then.free_s - outlook.free_s
            way_s = min(all_s, distance(outlook.position_m, self.job(role).place_m) / data.transit_speed_mps)
            home_s = HOME_MARGIN * distance(then.position_m, data.start_m) / data.survey_speed_mps
            for_job_j = left_j - transit_w * way_s - survey_w * home_s
            job_j = survey_w * (all_s - way_s)
            if job_j <= for_job_j:
                found.append(role)
                left_j, outlook = left_j - transit_w * way_s - job_j, then
            elif PART * job_j <= for_job_j and is_resumed(self.job(role)):
                return (*found, role)
        return tuple(found)

    def affords(self, outlook: Outlook, data: VehicleData, role: RoleSpecification) -> bool:
        """True if the vehicle's energy lasts for the job of ``role`` once it is free, see ``affordable``."""
        return data.name not in self.energy_j or bool(self.affordable(outlook, data, [role]))

    def _may_do(self, data: VehicleData, role: RoleSpecification) -> bool:
        """True if the vehicle is able to do the job of ``role``, and can afford it from where it is."""
        return self.able(data, role) and self.affords(Outlook(self.now_s, self.position_m(data.name)), data, role)

    def awaited(self, vehicle: str, now_s: float) -> float:
        """How much of the wait for the meeting of the group is for a vehicle: 0..1, see ``Groups.awaited``."""
        held = self._held
        own_s = self._free_at(vehicle, now_s).free_s - now_s if vehicle in held else 0.0
        if own_s <= 0.0:
            return 1.0
        others_s = max((self._free_at(name, now_s).free_s - now_s for name in held if name != vehicle), default=0.0)
        return max(0.0, 1.0 - others_s / own_s)

    def ended(
        self, vehicle: str, caller: str, place_m: Point, waiting: Collection[str], now_s: float, n_helpers: int = 1
    ) -> float:
        """Share of a caller's wait at a place that a vehicle ends by going there at once, 0..1.

        It is 1 - T / T_else: T is the time of the way, T_else the time after which enough members will have done what
        they hold and come; the vehicle itself is among them if it holds something. Where enough others are there as
        soon, nothing is ended.

        Args:
            vehicle: that might go; caller: who waits.
            place_m: where.
            waiting: members that wait themselves, whose jobs will not be done before; the caller may be missing.
            now_s: the time now.
            n_helpers: number of members that the caller waits for.
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

    @cached_property
    def _held(self) -> dict[str, list[RoleSpecification]]:
        """By vehicle, the unfinished roles that it plays."""
        held: dict[str, list[RoleSpecification]] = {}
        for role in self.unfinished:
            for name in self.holders(role):
                held.setdefault(name, []).append(role)
        return held

    def _free_at(self, vehicle: str, now_s: float) -> Outlook:
        """When and where a vehicle will have done the jobs that it holds."""
        at = Outlook(now_s, self.position_m(vehicle))
        return self.after_all(at, self.database[vehicle], self._held.get(vehicle, ()))

    def seen(self, positions_m: Mapping[str, Point], now_s: float) -> Work:
        """The same work at another moment, where nobody is short of energy: all that is known of it stays known.

        Args:
            positions_m: last positions known; now_s: time from which outlooks count.
        """
        _ = self.workers, self.open  # known once for all moments
        made = object.__new__(Work)
        made.__dict__.update(self.__dict__, positions_m=positions_m, now_s=now_s)
        return made

    def with_less(self, jobs: Mapping[str, Job]) -> Work:
        """The same work where less is left of the same jobs, none of them done since: who may do which stays known."""
        made = object.__new__(Work)
        made.__dict__.update(self.__dict__, jobs=jobs)
        return made

    def in_order(
        self, outlook: Outlook, data: VehicleData, roles: Iterable[RoleSpecification]
    ) -> tuple[RoleSpecification, ...]:
        """The order in which the vehicle turns to the jobs of ``roles``: of several the nearest attracts most."""
        left, ordered = self._by_job(roles), list[RoleSpecification]()
        while len(left) > 1:
            ordered.append(self._nearest(left, outlook))
            outlook = self.job(ordered[-1]).after(outlook, data) or outlook
        return (*ordered, *left)

    def _by_job(self, roles: Iterable[RoleSpecification]) -> list[RoleSpecification]:
        return sorted(roles, key=lambda role: role.job or "")

    def _nearest(self, left: list[RoleSpecification], outlook: Outlook) -> RoleSpecification:
        """Take out the role whose job is nearest, of equals the first."""
        distances_m = [distance(outlook.position_m, self.job(role).place_m) for role in left]
        return left.pop(distances_m.index(min(distances_m)))

    def knowing(self, done: Collection[str]) -> Work:
        """The same work where jobs ``done`` are known to be done too, but for those given anew."""
        more = frozenset(done) - self.done - self.given_anew
        return replace(self, done=self.done | more) if more else self

    def assignment(self, role: RoleSpecification, vehicle: str) -> RoleAssignment:
        """``vehicle`` plays ``role`` of the group."""
        return RoleAssignment(self.group.name, role.name, vehicle)


class WorksSeen(Mapping[str, Work]):
    """The same works at another moment, see ``Work.seen``: each is made when it is looked up.

    Args:
        works: of the groups, by name.
        positions_m, now_s: as ``Work.seen`` has them.
    """

    def __init__(self, works: Mapping[str, Work], positions_m: Mapping[str, Point], now_s: float) -> None:
        self._works = works
        self._positions_m, self._now_s = positions_m, now_s
        self._seen: dict[str, Work] = {}

    def __getitem__(self, group: str) -> Work:
        seen = self._seen.get(group)
        if seen is None:
            seen = self._seen[group] = self._works[group].seen(self._positions_m, self._now_s)
        return seen

    def __contains__(self, group: object) -> bool:
        return group in self._works

    def __iter__(self) -> Iterator[str]:
        return iter(self._works)

    def __len__(self) -> int:
        return len(self._works)


class Awaited(Mapping[str, float]):
    """By group, how much of the wait for its meeting is for a vehicle, see ``Work.awaited``: worked out when asked for.

    Args:
        works: of the groups, by name, at one moment.
        vehicle: its name; now_s: the moment.
    """

    def __init__(self, works: Mapping[str, Work], vehicle: str, now_s: float) -> None:
        self._works = works
        self._vehicle, self._now_s = vehicle, now_s
        self._known: dict[str, float] = {}

    def __getitem__(self, group: str) -> float:
        share = self._known.get(group)
        if share is None:
            share = self._known[group] = self._works[group].awaited(self._vehicle, self._now_s)
        return share

    def __iter__(self) -> Iterator[str]:
        return iter(self._works)

    def __len__(self) -> int:
        return len(self._works)


ALL_HAVE_ENOUGH: Mapping[str, float] = MappingProxyType({})
"""``Work.energy_j`` where energy need not be looked at."""


def works(
    organisation: Organisation,
    database: AUVDatabase,
    jobs: Mapping[str, Job],
    done: frozenset[str],
    positions_m: Mapping[str, Point],
    unavailable: frozenset[str] = frozenset(),
    is_enough: bool = False,
    energy_j: Mapping[str, float] = ALL_HAVE_ENOUGH,
    now_s: float = 0.0,
    given_anew: frozenset[str] = frozenset(),
    unable: frozenset[tuple[str, str]] = frozenset(),
) -> dict[str, Work]:
    """The work of every group, by its name; see ``Work`` for the arguments."""
    known = positions_m, unavailable, is_enough, energy_j, now_s
    return {
        name: Work(group, organisation, database, jobs, done, *known, given_anew=given_anew, unable=unable)
        for name, group in organisation.groups.items()
    }


def precedence(group: Group, jobs: Mapping[str, Job]) -> frozenset[Key]:
    """Facts that open jobs of the group: an allocation of its roles rests on them."""
    needed = {need for role in group.roles if role.job and role.job in jobs for need in jobs[role.job].needs}
    return frozenset(jobs[need].done for need in needed if need in jobs)
