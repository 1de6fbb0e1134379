"""Allocator shared by all shipped strategies: cost, assignment and order of jobs.

Strategies differ in the deciding vehicle, its knowledge and its messages; the decision rule is common, see
``docs/model/organisation.md``. Ties fall by job name and vehicle node. Expectations use the static data shared by the
fleet; true speeds may differ. The method is ours: the papers leave it open.

The better of two construction heuristics is improved further: bottleneck assignment in rounds of one job per vehicle,
which suits distant jobs; or each longest job to the vehicle that would then end first (Graham 1969, list scheduling),
which suits unequal lengths. Descent moves up to two jobs between the last vehicle and another one while the makespan
falls, or the total time at equal makespan. At a local optimum each job in turn is moved and the descent repeated
(Lourenço, Martin, Stützle 2003, iterated local search), until ``MOST_PATHS`` or ``MOST_EXCHANGES`` are evaluated. On 13
patches and three vehicles the makespan is within 1 % of the best of 300 random restarts.

Source of the assignment: Burkard, Dell'Amico, Martello 2009: linear bottleneck assignment by threshold; linear sum
assignment by shortest augmenting paths, in the rectangular form of Crouse 2016.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, cycle
from typing import NamedTuple, TypeVar

from exchange.arithmetic import distance
from remoras.database import VehicleData
from remoras.organisation import RoleAssignment, RoleSpecification
from remoras.work import Outlook, Point, Work, share_left

K = TypeVar("K")
V = TypeVar("V")
Roles = tuple[RoleSpecification, ...]


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
    """Roles held by a vehicle: jobs begun, jobs queued."""

    begun: Roles
    queued: Roles
    # Evaluated on demand, since rarely needed.
    ending: Callable[[], Outlook]

    @property
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
        """Return the engagement of a vehicle, expected to complete its nearest job on time.

        Once parts of the job are known to be done, the estimate uses the remainder, from the position received at
        ``seen_s`` (None: now). A vehicle may turn later than now to roles that it has not acknowledged (``unheard``).
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
    """Time and place at the end of a job due by ``due_s``."""
    seen = work.after(Outlook(seen_s, work.position_m(data.name)), data, role)
    place_m = work.position_m(data.name) if seen is None else seen.position_m
    if seen is not None and share_left(work.job(role)) < 1.0:
        due_s = seen.free_s if due_s <= now_s else min(due_s, seen.free_s)
    return Outlook(due_s, place_m)


# Planning ----------------------------------------------------------------------------------------


def planned(
    work: Work, roles: Sequence[RoleSpecification], free: Sequence[VehicleData], outlooks: Mapping[str, Outlook]
) -> AllocationPlan:
    """Allocate ``roles`` to the vehicles ``free`` so that the makespan is minimal (heuristic)."""
    free = sorted(free, key=lambda data: data.node)
    if work.energy_j:
        # Barred at once, since the search itself ignores energy.
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
    """Plan vacant and queued roles; queues stay unless time left falls by a share ``margin``."""
    outlooks = {data.name: engaged[data.name].outlook for data in free}
    queued = {data.name: affordable(work, data, engaged[data.name]) for data in free}
    vacant = [*vacant, *(role for data in free for role in engaged[data.name].queued if role not in queued[data.name])]
    anew = planned(work, [*vacant, *(role for roles in queued.values() for role in roles)], free, outlooks)
    after = {data.name: work.after_all(outlooks[data.name], data, queued[data.name]) for data in free}
    # The alternative: queues stay, vacant roles follow them.
    on_top = planned(work, vacant, free, after)
    if on_top.end_s - anew.end_s > margin * max(0.0, on_top.end_s - now_s):
        return anew
    roles = {d.name: (*work.in_order(outlooks[d.name], d, queued[d.name]), *on_top.roles[d.name]) for d in free}
    return AllocationPlan(roles, on_top.ends_s)


# Help --------------------------------------------------------------------------------------------


def joining(
    work: Work,
    idle: Collection[VehicleData],
    ends_s: Mapping[str, float],
    now_s: float,
    least_s: float,
    n_holders: Mapping[str, int] | None = None,
) -> Iterator[RoleAssignment]:
    """Assign vehicles without work to other vehicles' jobs with a vacancy, largest saving first.

    ``ends_s`` is the expected end of each job, by role name, ``least_s`` the minimum saving (s), ``n_holders`` the
    number of vehicles per job, by default the holders of its role.
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
    # If n vehicles need another T for a job, they end it with one more, after its way w, at (n T + w) / (n + 1).
    return (left_s - way_s) / (n_holders + 1)


# Before a mission --------------------------------------------------------------------------------


def job_plan(work: Work) -> AllocationPlan:
    """Plan all vacant jobs on top of the roles that members hold."""
    outlooks = {
        data.name: work.after_all(Outlook(0.0, work.position_m(data.name)), data, work.held_by(data.name))
        for data in work.workers
    }
    return planned(work, work.vacant, work.workers, outlooks)


def all_jobs(work: Work, join_s: float = math.inf) -> tuple[RoleAssignment, ...]:
    """Return the assignments of ``job_plan``, plus idle vehicles that join where that saves ``join_s``."""
    plan = job_plan(work)
    # The latest expected end first, since roles sent at run time take effect in that order.
    jobs = tuple(sorted(assignments(work, plan), key=lambda assignment: -plan.ends_s[assignment.vehicle]))
    ends_s = {}
    for name, roles in plan.roles.items():
        if roles:
            after = work.after(Outlook(0.0, work.position_m(name)), work.database[name], roles[0])
            ends_s[roles[0].name] = plan.ends_s[name] if after is None else after.free_s
    idle = [data for data in work.workers if not plan.roles[data.name] and not work.held_by(data.name)]
    return jobs + tuple(joining(work, idle, ends_s, 0.0, join_s))


def assignments(work: Work, plan: AllocationPlan, most_each: int | None = None) -> tuple[RoleAssignment, ...]:
    """Return the roles of a plan, at most the first ``most_each`` per vehicle; all if None."""
    return tuple(work.assignment(role, name) for name, roles in plan.roles.items() for role in roles[:most_each])


# Search ------------------------------------------------------------------------------------------

TIE_BREAK = 100_000
"""Weight of a millisecond over any order of ties."""
MANY = 20_000
"""Pairs times the smaller dimension from which SciPy is faster: about 10 ms of this module."""

Costs = Sequence[Sequence[float]]


def assignment(costs_ms: Sequence[Sequence[int | None]]) -> dict[int, int]:
    """Assign rows to columns: most rows, then least maximum cost, then least sum.

    None forbids a pair. Ties are deterministic.

    >>> assignment([[5, 9], [9, 14]])
    {0: 1, 1: 0}
    >>> assignment([[1, 1], [1, 1]])
    {0: 0, 1: 1}
    """
    limits = sorted({cost for row in costs_ms for cost in row if cost is not None})
    if not limits:
        return {}
    n_columns = 1 + max(column for row in costs_ms for column, cost in enumerate(row) if cost is not None)
    most = _n_pairs(costs_ms, limits[-1])
    limit = limits[bisect_left(limits, most, key=lambda limit: _n_pairs(costs_ms, limit))]
    weights = [  # ties are least where lower rows have lower columns
        [
            None if cost is None or cost > limit else cost * TIE_BREAK + row * (n_columns - 1 - column)
            for column, cost in enumerate(costs[:n_columns])
        ]
        for row, costs in enumerate(costs_ms)
    ]
    fewer = min(len(costs_ms), n_columns)
    none = 1 + fewer * max(weight for of in weights for weight in of if weight is not None)  # a row more is worth any
    pairs = least([[none if weight is None else weight for weight in of] for of in weights])
    return {row: column for row, column in pairs.items() if weights[row][column] is not None}


def _n_pairs(costs_ms: Sequence[Sequence[int | None]], limit: int) -> int:
    over = [[cost is None or cost > limit for cost in row] for row in costs_ms]
    return sum(not over[row][column] for row, column in least(over).items())


def least(costs: Costs) -> dict[int, int]:
    """Assign as many rows as possible to columns, at minimum sum, by shortest augmenting paths."""
    n_rows, n_columns = len(costs), len(costs[0])
    if n_rows * n_columns * min(n_rows, n_columns) > MANY:
        # For large problems only: loading SciPy takes a third as long as a whole mission.
        from scipy.optimize import linear_sum_assignment

        return dict(zip(*(indices.tolist() for indices in linear_sum_assignment(costs)), strict=True))
    if n_rows > n_columns:
        turned = least(list(zip(*costs, strict=True)))
        return dict(sorted((row, column) for column, row in turned.items()))
    row_prices, column_prices = [0.0] * n_rows, [0.0] * n_columns
    column_of: dict[int, int] = {}
    row_of: dict[int, int] = {}
    for begin in range(n_rows):
        ways, before = [math.inf] * n_columns, [begin] * n_columns  # before: the row from which each column is reached
        left, reached = list(range(n_columns - 1, -1, -1)), list[int]()
        row, way = begin, 0.0
        while True:
            nearest, place = math.inf, -1
            for n, column in enumerate(left):
                cost = way + costs[row][column] - row_prices[row] - column_prices[column]
                if cost < ways[column]:
                    ways[column], before[column] = cost, row
                if ways[column] < nearest or (ways[column] == nearest and column not in row_of):
                    nearest, place = ways[column], n
            way, column, left[place] = nearest, left[place], left[-1]
            left.pop()
            reached.append(column)
            if column not in row_of:
                break
            row = row_of[column]
        row_prices[begin] += way
        for index in reached:
            column_prices[index] -= way - ways[index]
            if index in row_of:
                row_prices[row_of[index]] += way - ways[index]
        row = -1
        while row != begin:
            row = before[column]
            row_of[column] = row
            column, column_of[row] = column_of.get(row, -1), column
    return dict(sorted(column_of.items()))


Held = list[int]
"""Jobs of each vehicle, as bits."""
Effort = tuple[float, float]
"""Objective, lexicographic: makespan, then sum of all ends (s), to the millisecond."""

MOST_PATHS, MOST_EXCHANGES = 4000, 20_000
"""New paths of single vehicles, and exchanges (these bound large fleets) per search."""
SHAPES = ((1, 0), (1, 1), (1, 2), (2, 1))
"""Numbers of jobs that the last vehicle gives to another one and takes back."""


class Draft(NamedTuple):
    """Plan: jobs and end (s) of each vehicle, and its objective."""

    held: Held
    ends_s: list[float]
    effort: Effort


class _Kept(dict[K, V]):
    """Values by key, each computed when first asked for."""

    def __init__(self, value_of: Callable[[K], V]) -> None:
        self._value_of = value_of

    def __missing__(self, key: K) -> V:
        value = self[key] = self._value_of(key)
        return value


class _Stop(NamedTuple):
    """Place of a vehicle: jobs by how near they are, and time and place after each (None if unable)."""

    nearest: Sequence[int]
    legs: _Kept[int, Outlook | None]


class Search:
    """Search for a job allocation of minimum makespan, with caches of job durations."""

    def __init__(
        self,
        work: Work,
        roles: Sequence[RoleSpecification],
        free: Sequence[VehicleData],
        outlooks: Mapping[str, Outlook],
    ) -> None:
        self._roles = sorted(roles, key=lambda role: role.job or "")
        self._free = sorted(free, key=lambda data: data.node)
        self._outlooks = [outlooks[data.name] for data in self._free]
        self._places_m = [work.job(role).place_m for role in self._roles]
        self._jobs = [work.job(role) for role in self._roles]
        self._able = [sum(1 << r for r, role in enumerate(self._roles) if work.able(data, role)) for data in self._free]
        paths = {(work.group.name, role.name): r for r, role in enumerate(self._roles)}
        self._excluding = [
            1 << r | 1 << paths[other]
            for r, role in enumerate(self._roles)
            for other in role.incompatible & paths.keys()
        ]
        # Durations are kept by start position: they must not depend on the time of day.
        vehicles = range(len(self._free))
        self._stops = [_Kept[Point, _Stop](partial(self._stop, vehicle)) for vehicle in vehicles]
        self._ends_s = [_Kept[int, float](partial(self._end_s, vehicle)) for vehicle in vehicles]
        self._subsets = _Kept(_subsets)
        self._nearest = _Kept(self._by_nearness)
        self._n_paths = self._n_exchanges = 0

    @property
    def _is_over(self) -> bool:
        return self._n_paths >= MOST_PATHS or self._n_exchanges >= MOST_EXCHANGES

    def found(self) -> dict[str, Roles]:
        """Return the best plan: roles of each vehicle, in order of job names."""
        if not self._free:
            return {}
        begun = (self._in_turns(), self._longest_first())
        descended = [self._descended(held, self._ends_of(held)) for held in begun]
        held = self._kicked(min(descended, key=lambda plan: plan.effort))
        return {
            data.name: tuple(role for r, role in enumerate(self._roles) if jobs >> r & 1)
            for data, jobs in zip(self._free, held, strict=True)
        }

    # Paths

    def _after(self, vehicle: int, outlook: Outlook, role: int) -> Outlook | None:
        return self._jobs[role].after(outlook, self._free[vehicle]) if self._able[vehicle] >> role & 1 else None

    def _stop(self, vehicle: int, at_m: Point) -> _Stop:
        return _Stop(self._nearest[at_m], _Kept(partial(self._after, vehicle, Outlook(0.0, at_m))))

    def _ends_of(self, held: Held) -> list[float]:
        return [ends_s[jobs] for ends_s, jobs in zip(self._ends_s, held, strict=True)]

    def _end_s(self, vehicle: int, jobs: int) -> float:
        """End (s) of a vehicle's jobs in the order of ``Work.in_order``; inf for incompatible roles."""
        self._n_paths += 1
        if any(jobs & both == both for both in self._excluding):  # incompatible roles
            return math.inf
        (end_s, at_m), stops = self._outlooks[vehicle], self._stops[vehicle]
        left = jobs
        while left:
            stop = stops[at_m]
            for role in stop.nearest:
                if left >> role & 1:
                    break
            left ^= 1 << role
            if (leg := stop.legs[role]) is not None:
                end_s, at_m = end_s + leg[0], leg[1]
        # Rounding errors of another order of summation must decide no tie.
        return round(end_s, 3)

    def _by_nearness(self, at_m: Point) -> list[int]:
        far_m = [distance(at_m, place_m) for place_m in self._places_m]
        return sorted(range(len(far_m)), key=far_m.__getitem__)

    # Two plans to begin with

    def _in_turns(self) -> Held:
        outlooks = list(self._outlooks)
        held = [0] * len(self._free)
        vacant = list(range(len(self._roles)))
        while vacant:
            now_s = min(outlook.free_s for outlook in outlooks)
            rows = [[self._after(vehicle, at, role) for vehicle, at in enumerate(outlooks)] for role in vacant]
            costs = [[None if leg is None else round(1000.0 * (leg.free_s - now_s)) for leg in row] for row in rows]
            pairs = assignment(costs)
            if not pairs:
                break
            for row, vehicle in pairs.items():
                held[vehicle] |= 1 << vacant[row]
                outlooks[vehicle] = rows[row][vehicle] or outlooks[vehicle]
            vacant = [role for row, role in enumerate(vacant) if row not in pairs]
        return held

    def _longest_first(self) -> Held:
        held = [0] * len(self._free)
        for role in sorted(range(len(self._roles)), key=lambda role: -self._length_s(role)):
            ends_s = [
                (self._ends_s[vehicle][held[vehicle] | 1 << role], vehicle)
                for vehicle, able in enumerate(self._able)
                if able >> role & 1
            ]
            if ends_s:
                held[min(ends_s)[1]] |= 1 << role
        return held

    def _length_s(self, role: int) -> float:
        start, job = Outlook(0.0, self._places_m[role]), self._jobs[role]
        able = [data for vehicle, data in enumerate(self._free) if self._able[vehicle] >> role & 1]
        legs = [job.after(start, data) for data in able]
        return round(min((leg.free_s for leg in legs if leg is not None), default=0.0), 3)

    # Improvement

    def _kicked(self, best: Draft) -> Held:
        places = [(r, v) for r in range(len(self._roles)) for v in range(len(self._free)) if self._able[v] >> r & 1]
        n_useless = 0  # kicks since the last improvement
        holders = self._holders(best.held)
        for role, vehicle in cycle(places):
            if self._is_over or n_useless == len(places):
                break
            n_useless += 1
            if (before := holders.get(role)) == vehicle:
                continue
            held, ends_s = list(best.held), list(best.ends_s)
            held[vehicle] |= 1 << role
            ends_s[vehicle] = self._ends_s[vehicle][held[vehicle]]
            if before is not None:
                held[before] ^= 1 << role
                ends_s[before] = self._ends_s[before][held[before]]
            kicked = self._descended(held, ends_s)
            if kicked.effort < best.effort:
                best, n_useless = kicked, 0
                holders = self._holders(best.held)
        return best.held

    def _holders(self, held: Held) -> dict[int, int]:
        return {
            role: vehicle for vehicle, jobs in enumerate(held) for role in range(len(self._roles)) if jobs >> role & 1
        }

    def _descended(self, held: Held, ends_s: list[float]) -> Draft:
        effort: Effort | None = _effort(ends_s)
        while effort is not None:
            least = effort
            effort = None if self._is_over else self._improved(held, ends_s, least)
        return Draft(held, ends_s, least)

    def _improved(self, held: Held, ends_s: list[float], before: Effort) -> Effort | None:
        """Apply the first improving exchange in place; None without one."""
        end_s = before[0]
        # Only a change of the last vehicle's jobs can lower the makespan.
        last, ends_of = ends_s.index(end_s), self._ends_s
        for kept, other, taken in self._exchanges(last, held):
            self._n_exchanges += 1
            if (then_s := ends_of[last][kept]) > end_s or (other_s := ends_of[other][taken]) > end_s:
                continue
            after_s = list(ends_s)
            after_s[last], after_s[other] = then_s, other_s
            if (effort := _effort(after_s)) < before:
                held[last], held[other] = kept, taken
                ends_s[:] = after_s
                return effort
        return None

    def _exchanges(self, last: int, held: Held) -> Iterator[tuple[int, int, int]]:
        """Yield the jobs of ``last`` after an exchange, the other vehicle, and its jobs."""
        mine, able, subsets = held[last], self._able, self._subsets
        for n_away, n_back in SHAPES:
            if mine.bit_count() < n_away:
                continue
            for other, theirs in enumerate(held):
                if other != last and (backs := subsets[theirs & able[last], n_back]):
                    for away in subsets[mine & able[other], n_away]:
                        for back in backs:
                            yield mine & ~away | back, other, theirs & ~back | away


def _subsets(of: tuple[int, int]) -> list[int]:
    """Return all sets of so many of these jobs."""
    jobs, count = of
    bits = [1 << role for role in range(jobs.bit_length()) if jobs >> role & 1]
    return [sum(subset) for subset in combinations(bits, count)]


def _effort(ends_s: Sequence[float]) -> Effort:
    return max(ends_s), round(math.fsum(ends_s), 3)
