"""Allocating areas: what a survey takes, when a vehicle will be free, and who had best take what.

Expectations use the data that the whole fleet shares. The vehicles may be slower or faster than their data.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import networkx as nx

from missions.mapping.survey import Point, length_m, zigzag
from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategy import Evidence


@dataclass(frozen=True, slots=True, order=True)
class Outlook:
    """When and where a vehicle is expected to have done what it holds."""

    free_s: float
    position_m: Point


@lru_cache(maxsize=4096)
def _surveys(corners_m: tuple[Point, ...], swath_m: float) -> tuple[tuple[Point, Point, float], ...]:
    """First waypoint, last waypoint and length of the survey from each end that it may begin at."""
    ends = dict.fromkeys(zigzag(corners_m, swath_m, corner)[0] for corner in _box(corners_m))
    found = [(zigzag(corners_m, swath_m, end), end) for end in ends]
    return tuple((end, waypoints[-1], length_m(waypoints)) for waypoints, end in found)


def _box(corners_m: Sequence[Point]) -> list[Point]:
    xs, ys = [x for x, _ in corners_m], [y for _, y in corners_m]
    return [(x, y) for x in (min(xs), max(xs)) for y in (min(ys), max(ys))]


def after(outlook: Outlook, data: VehicleData, corners_m: Sequence[Point]) -> Outlook | None:
    """When and where the vehicle will be free if it surveys an area next; None without a sensor."""
    if data.swath_m <= 0.0 or data.mapping_speed_mps <= 0.0:
        return None
    x_m, y_m = outlook.position_m
    way_m, last, survey_m = min(
        (math.hypot(first[0] - x_m, first[1] - y_m), last, length)
        for first, last, length in _surveys(tuple(corners_m), data.swath_m)
    )
    return Outlook(outlook.free_s + way_m / data.transit_speed_mps + survey_m / data.mapping_speed_mps, last)


def survey_time_s(data: VehicleData, corners_m: Sequence[Point], position_m: Point) -> float:
    """Time that a vehicle at ``position_m`` needs to reach an area and survey it; infinite without a sensor."""
    outlook = after(Outlook(0.0, position_m), data, corners_m)
    return math.inf if outlook is None else outlook.free_s


def open_roles(group: Group, evidence: Evidence) -> list[RoleSpecification]:
    """Roles whose area is not known to be finished."""
    return [role for role in group.roles if role.area is not None and role.area not in evidence.done]


def at_work(vehicle: str, group: Group, organisation: Organisation, evidence: Evidence) -> list[RoleSpecification]:
    """Open roles that the vehicle plays."""
    return [r for r in open_roles(group, evidence) if organisation.plays(vehicle, group.name, r.name)]


def surveyors(group: Group, organisation: Organisation, database: AUVDatabase) -> list[VehicleData]:
    """Members of the group that are able to survey some of its areas, in the order of the nodes."""
    members = set(organisation.members(group.name))
    return [
        data
        for data in database.values()
        if data.name in members
        and data.swath_m > 0.0
        and any(role.area is not None and data.can_play(role.name) for role in group.roles)
    ]


def nearest_first(outlook: Outlook, data: VehicleData, areas: Iterable[tuple[Point, ...]]) -> Outlook:
    """When and where the vehicle has done all ``areas``, always going on with the nearest: so vehicles proceed."""
    left = list(areas)
    while left:
        then = [(o.free_s, number, o) for number, a in enumerate(left) if (o := after(outlook, data, a)) is not None]
        if not then:
            break
        _, number, outlook = min(then)
        del left[number]
    return outlook


class Expectations:
    """When each vehicle will have done what it holds, from when it took or finished something last."""

    def __init__(self) -> None:
        self._since: dict[str, tuple[frozenset[str], Outlook]] = {}

    def of(self, data: VehicleData, roles: Sequence[RoleSpecification], now_s: float, evidence: Evidence) -> Outlook:
        """Outlook of a vehicle that holds ``roles``, not before now."""
        areas = {role.area: evidence.corners_m[role.area] for role in roles if role.area is not None}
        held = frozenset(areas)
        here = Outlook(now_s, evidence.position_m(data.name))
        before, since = self._since.get(data.name, (frozenset[str](), here))
        if not before or not before <= held:  # it was idle, or has finished something
            since = here
        self._since[data.name] = held, since
        outlook = nearest_first(since, data, areas.values())
        return Outlook(max(now_s, outlook.free_s), outlook.position_m)


def assignment(costs_ms: Sequence[Sequence[int | None]]) -> dict[int, int]:
    """Row -> column so that as many rows as possible are assigned, the dearest pair is as cheap as possible, and
    then the sum is least; None forbids a pair. Equals fall the same way in every run.

    >>> assignment([[5, 9], [9, 14]])
    {0: 1, 1: 0}
    >>> assignment([[1, 1], [1, 1]])
    {0: 0, 1: 1}
    """
    pairs = [(cost, r, c) for r, row in enumerate(costs_ms) for c, cost in enumerate(row) if cost is not None]
    if not pairs:
        return {}
    n_columns = 1 + max(c for _, _, c in pairs)

    def matched(limit: int) -> int:
        graph: Any = nx.Graph()
        rows = [("row", r) for r in dict.fromkeys(r for cost, r, _ in pairs if cost <= limit)]
        graph.add_nodes_from(rows)
        graph.add_edges_from((("row", r), ("column", c)) for cost, r, c in pairs if cost <= limit)
        return len(nx.bipartite.hopcroft_karp_matching(graph, rows)) // 2

    limits = sorted({cost for cost, _, _ in pairs})
    most = matched(limits[-1])
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if matched(limits[middle]) == most:
            high = middle
        else:
            low = middle + 1
    graph: Any = nx.DiGraph()
    for cost, r, c in pairs:
        if cost <= limits[low]:
            graph.add_edge("source", ("row", r), capacity=1, weight=0)
            graph.add_edge(("column", c), "sink", capacity=1, weight=0)
            tie_break = r * (n_columns - 1 - c)  # least where lower rows have lower columns
            graph.add_edge(("row", r), ("column", c), capacity=1, weight=cost * 100_000 + tie_break)
    flows = nx.max_flow_min_cost(graph, "source", "sink")
    chosen = {r: c for cost, r, c in pairs if cost <= limits[low] and flows[("row", r)].get(("column", c), 0) == 1}
    return dict(sorted(chosen.items()))


def shared_out(
    group: Group,
    roles: Sequence[RoleSpecification],
    free: Sequence[VehicleData],
    outlooks: Mapping[str, Outlook],
    evidence: Evidence,
    most_each: int,
) -> tuple[RoleAssignment, ...]:
    """Roles with areas for the vehicles ``free``, at most ``most_each`` to each.

    One at a time to everybody, so that the last one to be free is so as early as possible, and of all such
    allocations the one with the least time in total: a bottleneck assignment followed by a minimum-cost one, in whole
    milliseconds. Then the next one to everybody, from where they will be.
    """
    outlook = dict(outlooks)
    vacant = list(roles)
    allocated: list[RoleAssignment] = []
    for _ in range(most_each):
        then = [
            [
                after(outlook[data.name], data, evidence.corners_m[role.area or ""])
                if data.can_play(role.name)
                else None
                for data in free
            ]
            for role in vacant
        ]
        now_s = min((o.free_s for o in outlook.values()), default=0.0)
        costs = [[None if o is None else round(1000.0 * (o.free_s - now_s)) for o in row] for row in then]
        pairs = assignment(costs)
        if not pairs:
            break
        for r, c in pairs.items():
            name, next_outlook = free[c].name, then[r][c]
            allocated.append(RoleAssignment(group.name, vacant[r].name, name))
            if next_outlook is not None:
                outlook[name] = next_outlook
        vacant = [role for r, role in enumerate(vacant) if r not in pairs]
    return tuple(allocated)


def balanced(
    group: Group,
    given: Sequence[RoleAssignment],
    free: Sequence[VehicleData],
    outlooks: Mapping[str, Outlook],
    evidence: Evidence,
) -> tuple[RoleAssignment, ...]:
    """An allocation improved until it helps no more to take an area from the vehicle that is free last.

    The area goes to another vehicle, or two vehicles exchange areas, if the last one of all is then free earlier, or as
    early with less time in total. Every vehicle does its areas nearest first.
    """
    roles = {one.role: group.role(one.role) for one in given}
    held = {data.name: [one.role for one in given if one.vehicle == data.name] for data in free}
    database = {data.name: data for data in free}

    def free_s(name: str, names: Sequence[str]) -> float:
        areas = [evidence.corners_m[role.area] for n in names if (role := roles[n]) is not None and role.area]
        return round(nearest_first(outlooks[name], database[name], areas).free_s, 3)

    ends_s = {name: free_s(name, names) for name, names in held.items()}
    improved = bool(given)
    while improved:
        improved = False
        last = max(ends_s, key=lambda name: (ends_s[name], -database[name].node))
        for role, other in [(role, other) for role in held[last] for other in held if other != last]:
            for back in (None, *held[other]):
                able = database[other].can_play(role) and (back is None or database[last].can_play(back))
                if not able:
                    continue
                own = [*(n for n in held[last] if n != role), *([back] if back else [])]
                others = [*(n for n in held[other] if n != back), role]
                new = {**ends_s, last: free_s(last, own), other: free_s(other, others)}
                if (max(new.values()), sum(new.values())) < (max(ends_s.values()), sum(ends_s.values())):
                    ends_s, held[last], held[other], improved = new, own, others, True
                    break
            if improved:
                break
    return tuple(RoleAssignment(group.name, role, name) for name, names in held.items() for role in names)
