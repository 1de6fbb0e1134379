"""Allocating jobs: when a vehicle will be free, and who had best do what.

Expectations use the data that the whole fleet shares. The vehicles may be slower or faster than their data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import networkx as nx

from remoras.database import VehicleData
from remoras.organisation import RoleAssignment, RoleSpecification
from remoras.work import Outlook, Work


class Expectations:
    """When each vehicle will have done what it holds, from when it took or finished something last."""

    def __init__(self) -> None:
        self._since: dict[str, tuple[frozenset[str | None], Outlook]] = {}

    def of(self, data: VehicleData, roles: Sequence[RoleSpecification], now_s: float, work: Work) -> Outlook:
        """Outlook of a vehicle that holds ``roles``, not before now."""
        held = frozenset(role.job for role in roles)
        here = Outlook(now_s, work.position_m(data.name))
        before, since = self._since.get(data.name, (frozenset[str | None](), here))
        if not before or not before <= held:  # it was idle, or has finished something
            since = here
        self._since[data.name] = held, since
        outlook = work.after_all(since, data, {role.job: role for role in roles}.values())
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
    work: Work,
    roles: Sequence[RoleSpecification],
    free: Sequence[VehicleData],
    outlooks: Mapping[str, Outlook],
    most_each: int,
) -> tuple[RoleAssignment, ...]:
    """Roles with jobs for the vehicles ``free``, at most ``most_each`` to each.

    One at a time to everybody, so that the last one to be free is so as early as possible, and of all such
    allocations the one with the least time in total: a bottleneck assignment followed by a minimum-cost one, in whole
    milliseconds. Then the next one to everybody, from where they will be.

    Args:
        work: jobs of the group.
        roles: what is to be given out.
        free: vehicles that may be given some of it.
        outlooks: when and where each of them is free.
        most_each: most roles for a vehicle.
    """
    outlook = dict(outlooks)
    vacant = list(roles)
    allocated: list[RoleAssignment] = []
    for _ in range(most_each):
        then = [[work.after(outlook[data.name], data, role) for data in free] for role in vacant]
        now_s = min((o.free_s for o in outlook.values()), default=0.0)
        costs = [[None if o is None else round(1000.0 * (o.free_s - now_s)) for o in row] for row in then]
        pairs = assignment(costs)
        if not pairs:
            break
        for r, c in pairs.items():
            name, next_outlook = free[c].name, then[r][c]
            allocated.append(work.assignment(vacant[r], name))
            if next_outlook is not None:
                outlook[name] = next_outlook
        vacant = [role for r, role in enumerate(vacant) if r not in pairs]
    return tuple(allocated)


def balanced(
    work: Work, given: Sequence[RoleAssignment], free: Sequence[VehicleData], outlooks: Mapping[str, Outlook]
) -> tuple[RoleAssignment, ...]:
    """An allocation improved until it helps no more to take a job from the vehicle that is free last.

    The job goes to another vehicle, or two vehicles exchange jobs, if the last one of all is then free earlier, or as
    early with less time in total. Every vehicle does its jobs nearest first.

    Args:
        work: jobs of the group.
        given: the allocation.
        free: vehicles that may have a part in it.
        outlooks: when and where each of them is free before it.
    """
    roles = {one.role: role for one in given if (role := work.group.role(one.role)) is not None}
    held = {data.name: tuple(one.role for one in given if one.vehicle == data.name) for data in free}
    database = {data.name: data for data in free}

    def free_s(name: str, names: Sequence[str]) -> float:
        return round(work.after_all(outlooks[name], database[name], [roles[n] for n in names]).free_s, 3)

    def improved() -> tuple[dict[str, tuple[str, ...]], dict[str, float]] | None:
        last = max(ends_s, key=lambda name: (ends_s[name], -database[name].node))
        for change in _exchanges(last, held, lambda name, role: work.able(database[name], roles[role])):
            then_s = {**ends_s, **{name: free_s(name, names) for name, names in change.items()}}
            if (max(then_s.values()), sum(then_s.values())) < (max(ends_s.values()), sum(ends_s.values())):
                return {**held, **change}, then_s
        return None

    ends_s = {name: free_s(name, names) for name, names in held.items()}
    while given and (better := improved()) is not None:
        held, ends_s = better
    return tuple(RoleAssignment(work.group.name, role, name) for name, names in held.items() for role in names)


def _exchanges(
    last: str, held: Mapping[str, tuple[str, ...]], able: Callable[[str, str], bool]
) -> Iterator[dict[str, tuple[str, ...]]]:
    """What two vehicles hold after ``last`` has given another one of its roles, for nothing or for one of the other."""
    for role in held[last]:
        for other in held:
            if other == last or not able(other, role):
                continue
            kept = tuple(name for name in held[last] if name != role)
            yield {last: kept, other: (*held[other], role)}
            for back in held[other]:
                if able(last, back):
                    rest = tuple(name for name in held[other] if name != back)
                    yield {last: (*kept, back), other: (*rest, role)}


def all_jobs(work: Work) -> tuple[RoleAssignment, ...]:
    """Every open role that nobody plays, given to members in addition to what each has still to do."""
    outlooks = {
        data.name: work.after_all(Outlook(0.0, work.position_m(data.name)), data, work.held_by(data.name))
        for data in work.workers
    }
    given = shared_out(work, work.vacant, work.workers, outlooks, len(work.vacant))
    return balanced(work, given, work.workers, outlooks)
