"""The strategy of the REMORAS paper: founded before the mission, allocated by the head of the group.

Form: every founding role goes to the vehicles able to play it, as many as it allows, those with the most energy
first; a head needs the social layer; a role may have to be played by the holder of another (a Coordinator is
the Tactician of the group above).
Adapt: roles without an area go to every member able to play them. Areas go to members so that the last one is
finished as early as possible, and of all such allocations the one with the least work in total: a bottleneck
assignment followed by a minimum-cost one, in whole milliseconds so that ties fall the same way everywhere.
Source: Carlesi, Michel, Jouvencel, Ferber 2011, sections IV and VII; costs and optimisation are ours.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx

from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.strategy import Evidence
from remoras.survey import Point, length_m, zigzag


def survey_time_s(data: VehicleData, corners_m: Sequence[Point], position_m: Point) -> float:
    """Time that a vehicle at ``position_m`` needs to reach an area and survey it; infinite without a sensor."""
    if data.swath_m <= 0.0 or data.mapping_speed_mps <= 0.0:
        return math.inf
    waypoints = zigzag(corners_m, data.swath_m, position_m)
    way_s = math.dist(position_m, waypoints[0]) / data.transit_speed_mps
    return way_s + length_m(waypoints) / data.mapping_speed_mps


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

    def flow(limit: int) -> dict[int, int]:
        graph = nx.DiGraph()
        for cost, r, c in pairs:
            if cost <= limit:
                graph.add_edge("source", ("row", r), capacity=1, weight=0)
                graph.add_edge(("column", c), "sink", capacity=1, weight=0)
                tie_break = r * (n_columns - 1 - c)  # least where lower rows have lower columns
                graph.add_edge(("row", r), ("column", c), capacity=1, weight=cost * 100_000 + tie_break)
        if not graph:
            return {}
        flows = nx.max_flow_min_cost(graph, "source", "sink")
        return {r: c for cost, r, c in pairs if cost <= limit and flows.get(("row", r), {}).get(("column", c), 0) == 1}

    most = len(flow(max(cost for cost, _, _ in pairs)))
    limits = sorted({cost for cost, _, _ in pairs})
    low, high = 0, len(limits) - 1
    while low < high:
        middle = (low + high) // 2
        if len(flow(limits[middle])) == most:
            high = middle
        else:
            low = middle + 1
    return dict(sorted(flow(limits[low]).items()))


@dataclass(frozen=True, slots=True)
class Remoras:
    """Roles allocated by the head of each group; see the module's text."""

    name: str = "remoras"

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        organisation = Organisation.of(groups)
        founding = [(group.name, role) for group in groups for role in group.roles if role.founding]
        founded: set[tuple[str, str]] = set()
        while ready := [
            (group, role)
            for group, role in founding
            if (group, role.name) not in founded and (role.played_by is None or role.played_by in founded)
        ]:
            for group, role in ready:
                founded.add((group, role.name))
                for data in self._founders(database, organisation, role):
                    organisation, _ = organisation.assign(data.name, group, role.name)
        return organisation

    @staticmethod
    def _founders(database: AUVDatabase, organisation: Organisation, role: RoleSpecification) -> list[VehicleData]:
        able = [data for data in database.able_to_play(role.name) if data.social_layer or not role.head]
        if role.played_by is not None:
            holders = organisation.members(*role.played_by)
            able = [data for data in able if data.name in holders]
        able.sort(key=lambda data: (-data.energy_j, data.node))
        return able if role.maximum is None else able[: role.maximum]

    def adapt(self, group: Group, organisation: Organisation, evidence: Evidence) -> tuple[RoleAssignment, ...]:
        members = [
            evidence.database[name] for name in evidence.database.names if organisation.is_member(name, group.name)
        ]
        allocated: list[RoleAssignment] = []
        for role in group.roles:
            if not role.founding and role.area is None:
                held = organisation.members(group.name, role.name)
                able = [data.name for data in members if data.can_play(role.name) and data.name not in held]
                free = len(able) if role.maximum is None else max(0, role.maximum - len(held))
                allocated += [RoleAssignment(group.name, role.name, name) for name in able[:free]]
        vacant = [
            role
            for role in group.roles
            if role.area is not None
            and role.area not in evidence.done
            and not organisation.members(group.name, role.name)
        ]
        while vacant:  # more areas than members: a member takes another one when all have one
            costs: list[list[int | None]] = [
                [self._cost_ms(data, role, evidence) for data in members] for role in vacant
            ]
            pairs = assignment(costs)
            if not pairs:
                break
            allocated += [RoleAssignment(group.name, vacant[r].name, members[c].name) for r, c in pairs.items()]
            vacant = [role for r, role in enumerate(vacant) if r not in pairs]
        return tuple(a for a in allocated if not organisation.plays(a.vehicle, a.group, a.role))

    @staticmethod
    def _cost_ms(data: VehicleData, role: RoleSpecification, evidence: Evidence) -> int | None:
        if not data.can_play(role.name) or role.area is None:
            return None
        position = evidence.positions_m.get(data.name, data.start_m)
        time_s = survey_time_s(data, evidence.corners_m[role.area], position)
        return round(1000.0 * time_s) if math.isfinite(time_s) else None


STRATEGY = Remoras()
