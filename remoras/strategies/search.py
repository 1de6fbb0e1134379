"""The search for a plan: who does which jobs, so that the last vehicle has done its own as early as can be found.

Two plans are made and improved, the better one counts. In the first, jobs go out in turns, one to each vehicle, by a
bottleneck assignment (``matching``); it suits jobs far apart. In the second, the longest job goes out first, always to
the vehicle that would then have done all of its own first (Graham 1969, list scheduling); it suits jobs of unequal
length. Improving takes up to two jobs from the vehicle that is free last for up to two of another one, as long as the
end comes earlier, or as early with less time in total. At a local optimum each job in turn is put elsewhere, and that
is improved again (Lourenço, Martin, Stützle 2003, iterated local search), until ``MOST_PATHS`` paths were looked at. On
13 patches and three vehicles the end is within 1 % of the best of 300 random restarts.

Most of what a search looks at does not help. Whether an exchange between the vehicle that is free last and another one
helps follows from what these two hold, but for one case: a third may be free as late. So of a pair of which nothing
has helped, and nothing would without a third, it is kept what they held, and only what is held otherwise is tried.

A vehicle's jobs are the bits of an integer, so that a path is looked at once. What a job takes is looked up by where
the vehicle comes from: it must not depend on the time of day.

Who had best do what, one job to each: a bottleneck assignment followed by one of minimum cost.

Source: Burkard, Dell'Amico, Martello 2009: linear bottleneck assignment by a threshold, with as many pairs as
augmenting paths can make; linear sum assignment by shortest augmenting paths, in the rectangular form of Crouse 2016.
SciPy has the same, and is asked where there are many pairs: to load it takes a third as long as a whole mission.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, cycle
from typing import NamedTuple

from exchange.arithmetic import distance
from remoras.database import VehicleData
from remoras.organisation import RoleSpecification
from remoras.work import Job, Outlook, Point, Work

TIE_BREAK = 100_000
"""A pair that costs a millisecond more is worse than any fall of ties."""
MANY = 20_000
"""Pairs times rows (or columns, if these are fewer) from which on SciPy is asked: about 10 ms of this module."""

Costs = Sequence[Sequence[float]]


def assignment(costs_ms: Sequence[Sequence[int | None]]) -> dict[int, int]:
    """Row -> column so that as many rows as possible are assigned, the dearest pair is as cheap as possible, and
    then the sum is least; None forbids a pair. Equals fall the same way in every run.

    >>> assignment([[5, 9], [9, 14]])
    {0: 1, 1: 0}
    >>> assignment([[1, 1], [1, 1]])
    {0: 0, 1: 1}
    """
    limits = sorted({cost for row in costs_ms for cost in row if cost is not None})
    if not limits:
        return {}
    n_columns = 1 + max(column for row in costs_ms for column, cost in enumerate(row) if cost is not None)
    limit = _bottleneck(limits, lambda most: _n_pairs(costs_ms, most))
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


def _bottleneck(limits: Sequence[int], n_pairs: Callable[[int], int]) -> int:
    """The least cost to which pairs may be limited so that as many rows are assigned as without a limit."""
    most = n_pairs(limits[-1])
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if n_pairs(limits[middle]) == most:
            high = middle
        else:
            low = middle + 1
    return limits[low]


def _n_pairs(costs_ms: Sequence[Sequence[int | None]], limit: int) -> int:
    """How many rows can have a column of their own that costs no more than a limit, by augmenting paths."""
    allowed = [[c for c, cost in enumerate(row) if cost is not None and cost <= limit] for row in costs_ms]
    column_of: dict[int, int] = {}
    row_of: dict[int, int] = {}
    for begin in range(len(allowed)):
        before: dict[int, int] = {}  # the row from which each column is reached
        rows = [begin]
        while rows:
            row = rows.pop()
            for column in allowed[row]:
                if column in before:
                    continue
                before[column] = row
                if column in row_of:
                    rows.append(row_of[column])
                    continue
                rows.clear()
                _exchange(begin, column, before, column_of, row_of)
                break
    return len(column_of)


def _exchange(
    begin: int, column: int, before: Mapping[int, int], column_of: dict[int, int], row_of: dict[int, int]
) -> None:
    """Give each row on the path from a row to a column the next column on it."""
    row = -1
    while row != begin:
        row = before[column]
        was = column_of.get(row, -1)
        row_of[column], column_of[row], column = row, column, was


def least(costs: Costs) -> dict[int, int]:
    """Row -> column, in the order of rows, so that the sum is least; as many as the fewer of the two.

    Args:
        costs: whole numbers, one of each row and column.
    """
    n_rows, n_columns = len(costs), len(costs[0])
    if n_rows * n_columns * min(n_rows, n_columns) > MANY:
        from scipy.optimize import linear_sum_assignment

        return dict(zip(*(indices.tolist() for indices in linear_sum_assignment(costs)), strict=True))
    if n_rows > n_columns:
        turned = least(list(zip(*costs, strict=True)))
        return dict(sorted((row, column) for column, row in turned.items()))
    row_prices, column_prices = [0.0] * n_rows, [0.0] * n_columns
    column_of: dict[int, int] = {}
    row_of: dict[int, int] = {}
    for row in range(n_rows):
        _augment(costs, row, row_prices, column_prices, column_of, row_of)
    return dict(sorted(column_of.items()))


def _augment(
    costs: Costs,
    begin: int,
    row_prices: list[float],
    column_prices: list[float],
    column_of: dict[int, int],
    row_of: dict[int, int],
) -> None:
    """Give a row a column along the shortest path of exchanges: Dijkstra's, over costs less the prices of both ends."""
    shortest = [math.inf] * len(column_prices)
    before: dict[int, int] = {}  # the row from which each column is reached
    open_columns = list(range(len(column_prices) - 1, -1, -1))
    reached_rows, reached_columns = [begin], list[int]()
    row, way, column = begin, 0.0, -1
    while column < 0:
        nearest, found = math.inf, -1
        for place, other in enumerate(open_columns):
            then = way + costs[row][other] - row_prices[row] - column_prices[other]
            if then < shortest[other]:
                shortest[other], before[other] = then, row
            ends = other not in row_of
            if shortest[other] < nearest or (ends and shortest[other] == nearest):
                nearest, found = shortest[other], place
        way, last = nearest, open_columns.pop()
        at = last
        if found < len(open_columns):
            at, open_columns[found] = open_columns[found], last
        if at not in row_of:
            column = at
        else:
            row = row_of[at]
            reached_rows.append(row)
        reached_columns.append(at)
    row_prices[begin] += way
    for other in reached_rows[1:]:
        row_prices[other] += way - shortest[column_of[other]]
    for other in reached_columns:
        column_prices[other] -= way - shortest[other]
    _exchange(begin, column, before, column_of, row_of)


Roles = tuple[RoleSpecification, ...]
Held = list[int]
"""Jobs of each vehicle, as bits."""
Effort = tuple[float, float]
"""What is to be least: the end, then the ends of all in total (s), both to the millisecond."""

NOTHING = -1
"""Stands for what no vehicle holds."""
MOST_PATHS = 4000
"""Paths of single vehicles that are looked at in one search."""
SHAPES = ((1, 0), (1, 1), (1, 2), (2, 1))
"""How many jobs the last vehicle gives to another one, and gets from it."""


class Draft(NamedTuple):
    """Jobs of each vehicle, when each has done them (s), and what that comes to."""

    held: Held
    ends_s: list[float]
    effort: Effort


class _Legs(dict[int, Outlook | None]):
    """When and where a vehicle has done each job, from an outlook; None if it is not able. Jobs by their place."""

    def __init__(self, jobs: Sequence[Job], able: int, data: VehicleData, outlook: Outlook) -> None:
        self._given = jobs, able, data, outlook

    def __missing__(self, role: int) -> Outlook | None:
        jobs, able, data, outlook = self._given
        leg = self[role] = jobs[role].after(outlook, data) if able >> role & 1 else None
        return leg


class Search:
    """One search; it remembers what jobs take.

    Args:
        work: jobs of the group.
        roles: what is to be given out.
        free: vehicles that may be given some of it.
        outlooks: when and where each of them is free.
    """

    def __init__(
        self,
        work: Work,
        roles: Sequence[RoleSpecification],
        free: Sequence[VehicleData],
        outlooks: Mapping[str, Outlook],
    ) -> None:
        self._work = work
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
        self._alike = _alike(self._free)
        self._first_legs = [
            self._legs_at(v, Outlook(0.0, outlook.position_m)) for v, outlook in enumerate(self._outlooks)
        ]
        self._legs: dict[tuple[int, int, Point], Outlook | None] = {}  # behind the first
        self._sums: dict[tuple[int, int], list[int]] = {}
        self._nearest: dict[Point, list[int]] = {}  # roles by how near to a place they are
        self._ends_s: list[dict[int, float]] = [{} for _ in self._free]
        self._barren: dict[tuple[int, int], Held] = {}  # by who is last and holds what: with whom no exchange helps
        self._n_paths = 0

    def found(self) -> dict[str, Roles]:
        """The best plan: roles of each vehicle, by the names of their jobs."""
        if not self._free:
            return {}
        begun = (self._in_turns(), self._longest_first())
        descended = [self._descended(held, [self._end_s(*of) for of in enumerate(held)]) for held in begun]
        held = self._kicked(min(descended, key=lambda plan: plan.effort))
        return {
            data.name: tuple(role for r, role in enumerate(self._roles) if jobs >> r & 1)
            for data, jobs in zip(self._free, held, strict=True)
        }

    # Paths

    def _legs_at(self, vehicle: int, outlook: Outlook) -> _Legs:
        return _Legs(self._jobs, self._able[vehicle], self._free[vehicle], outlook)

    def _leg(self, vehicle: int, role: int, from_m: Point) -> Outlook | None:
        """How long a vehicle takes for a job from a place, and where that ends; None if it is not able."""
        key = vehicle, role, from_m
        if key in self._legs:
            return self._legs[key]
        able = self._able[vehicle] >> role & 1
        leg = self._legs[key] = self._jobs[role].after(Outlook(0.0, from_m), self._free[vehicle]) if able else None
        return leg

    def _end_s(self, vehicle: int, jobs: int) -> float:
        """When a vehicle has done jobs in the order in which it turns to them, see ``Work.in_order``."""
        known = self._ends_s[vehicle]
        end_s = known.get(jobs)
        if end_s is not None:
            return end_s
        self._n_paths += 1
        if any(jobs & both == both for both in self._excluding):  # of roles that nobody may play together
            known[jobs] = math.inf
            return math.inf
        end_s, start_m = self._outlooks[vehicle]
        left, at_m = jobs, start_m
        while left:
            role = self._next(left, at_m) if left & (left - 1) else left.bit_length() - 1
            left ^= 1 << role
            leg = self._first_legs[vehicle][role] if at_m is start_m else self._leg(vehicle, role, at_m)
            if leg is not None:
                end_s, at_m = end_s + leg[0], leg[1]
        known[jobs] = end_s = round(end_s, 3)
        return end_s

    def _next(self, jobs: int, at_m: Point) -> int:
        """Which of several jobs is nearest to a place, of equals the first."""
        first, last = (jobs & -jobs).bit_length() - 1, jobs.bit_length() - 1
        if jobs == 1 << first | 1 << last:
            places_m = self._places_m
            return first if distance(at_m, places_m[first]) <= distance(at_m, places_m[last]) else last
        for role in self._nearest.get(at_m) or self._by_nearness(at_m):
            if jobs >> role & 1:
                break
        return role

    def _by_nearness(self, at_m: Point) -> list[int]:
        far_m = [distance(at_m, place_m) for place_m in self._places_m]
        found = self._nearest[at_m] = sorted(range(len(far_m)), key=far_m.__getitem__)
        return found

    # Two plans to begin with

    def _in_turns(self) -> Held:
        """Jobs given out in turns, one to each vehicle that is able, from where it will then be."""
        outlooks = list(self._outlooks)
        held = [0] * len(self._free)
        vacant = list(range(len(self._roles)))
        while vacant:
            now_s = min(outlook.free_s for outlook in outlooks)
            legs = [
                self._legs_at(vehicle, outlook) if outlook.free_s or held[vehicle] else self._first_legs[vehicle]
                for vehicle, outlook in enumerate(outlooks)
            ]
            then = [[leg[role] for leg in legs] for role in vacant]
            costs = [[None if leg is None else round(1000.0 * (leg.free_s - now_s)) for leg in row] for row in then]
            pairs = assignment(costs)
            if not pairs:
                break
            for row, vehicle in pairs.items():
                held[vehicle] |= 1 << vacant[row]
                outlooks[vehicle] = then[row][vehicle] or outlooks[vehicle]
            vacant = [role for row, role in enumerate(vacant) if row not in pairs]
        return held

    def _longest_first(self) -> Held:
        """Jobs given out one by one, the longest first, each to the vehicle that then has done its own first."""
        held = [0] * len(self._free)
        for role in sorted(range(len(self._roles)), key=lambda role: -self._length_s(role)):
            ends_s = [
                (self._end_s(vehicle, held[vehicle] | 1 << role), vehicle)
                for vehicle, able in enumerate(self._able)
                if able >> role & 1
            ]
            if ends_s:
                held[min(ends_s)[1]] |= 1 << role
        return held

    def _length_s(self, role: int) -> float:
        """How long the job takes the fastest vehicle that is there; of vehicles that are alike one is asked."""
        there, job = Outlook(0.0, self._places_m[role]), self._jobs[role]
        able = [next((v for v in alike if self._able[v] >> role & 1), None) for alike in self._alike]
        legs = [job.after(there, self._free[vehicle]) for vehicle in able if vehicle is not None]
        return round(min((leg.free_s for leg in legs if leg is not None), default=0.0), 3)

    # Improvement

    def _kicked(self, best: Draft) -> Held:
        """The plan after putting each job elsewhere and improving that, as often as it helps and paths are left."""
        places = [(r, v) for r in range(len(self._roles)) for v in range(len(self._free)) if self._able[v] >> r & 1]
        n_useless = 0  # since the last one that helped: after all of them, none will
        for role, vehicle in cycle(places):
            if self._n_paths >= MOST_PATHS or n_useless == len(places):
                break
            n_useless += 1
            if best.held[vehicle] >> role & 1:
                continue
            kicked = self._descended(*self._put(role, vehicle, best))
            if kicked.effort < best.effort:
                best, n_useless = kicked, 0
        return best.held

    def _put(self, role: int, vehicle: int, plan: Draft) -> tuple[Held, list[float]]:
        """A plan, and its ends, in which a vehicle has a job, whoever had it."""
        held, ends_s, bit = list(plan.held), list(plan.ends_s), 1 << role
        before = next((at for at, jobs in enumerate(held) if jobs & bit), vehicle)
        held[before] &= ~bit
        held[vehicle] |= bit
        for at in (before, vehicle):
            ends_s[at] = self._end_s(at, held[at])
        return held, ends_s

    def _descended(self, held: Held, ends_s: list[float]) -> Draft:
        """These lists, improved until it helps no more to take jobs from the vehicle that is free last."""
        effort: Effort | None = _effort(ends_s)
        while effort is not None:
            least = effort
            effort = self._improved(held, ends_s, least) if self._n_paths < MOST_PATHS else None
        return Draft(held, ends_s, least)

    def _improved(self, held: Held, ends_s: list[float], before: Effort) -> Effort | None:
        """Make the first exchange that helps, and say what effort is left; None if there is none."""
        end_s = before[0]
        last = ends_s.index(end_s)
        barren = self._barren.get((last, held[last]))
        others = range(len(held)) if barren is None else [at for at, of in enumerate(barren) if held[at] != of]
        fruitful = set[int]()
        for kept, other, taken in self._exchanges(last, held, others):
            then_s, other_s = self._end_s(last, kept), 0.0
            if then_s > end_s or (other_s := self._end_s(other, taken)) > end_s:
                continue
            after_s = list(ends_s)
            after_s[last], after_s[other] = then_s, other_s
            if (effort := _effort(after_s)) < before:
                held[last], held[other] = kept, taken
                ends_s[:] = after_s
                return effort
            if then_s < end_s and other_s < end_s:  # a third is free as late
                fruitful.add(other)
        tried = self._barren[last, held[last]] = list(held)
        for at in fruitful:
            tried[at] = NOTHING
        return None

    def _exchanges(self, last: int, held: Held, others: Iterable[int]) -> Iterator[tuple[int, int, int]]:
        """What ``last`` holds, one of others, and what that holds, after one exchange between the two."""
        mine, able, some = held[last], self._able, self._sums
        for n_given, n_back in SHAPES:
            for other in others:
                theirs = held[other]
                ours, back_of = mine & able[other], theirs & able[last]
                if other == last or not ours or (n_back and not back_of):
                    continue
                backs = some.get((back_of, n_back)) or self._some(back_of, n_back)
                for given in some.get((ours, n_given)) or self._some(ours, n_given):
                    for back in backs:
                        yield mine & ~given | back, other, theirs & ~back | given

    def _some(self, jobs: int, count: int) -> list[int]:
        """Every choice of so many of ``jobs``."""
        key = jobs, count
        if key not in self._sums:
            bits = [1 << role for role in range(jobs.bit_length()) if jobs >> role & 1]
            self._sums[key] = [sum(some) for some in combinations(bits, count)]
        return self._sums[key]


def _effort(ends_s: Sequence[float]) -> Effort:
    return max(ends_s), round(math.fsum(ends_s), 3)


def _alike(vehicles: Sequence[VehicleData]) -> list[list[int]]:
    """Vehicles, by their places, that differ in nothing but who they are, where they start and what they may play."""
    kinds: list[VehicleData] = []
    found: list[list[int]] = []
    for place, data in enumerate(vehicles):
        kind = replace(data, name="", node=0, start_m=(0.0, 0.0), playable_roles=())
        if kind not in kinds:
            kinds.append(kind)
            found.append([])
        found[kinds.index(kind)].append(place)
    return found
