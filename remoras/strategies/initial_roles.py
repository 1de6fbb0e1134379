"""Initial role assignment, common to all shipped strategies: only job allocation differs.

If all minima can be filled together (at least one holder of a leader role), they are. Preferred are vehicles that list
the role earlier among their playable founding roles, then those with most energy. A second role in a group, or on
another branch of the same nesting, is given only if unavoidable. Others fill vacancies.

If the greedy order fails, a mixed-integer programme decides (``Seats``; HiGHS by SciPy): one binary variable per
vehicle and role; it minimises double roles, then holders, with ties in order of roles and vehicles. Source: Carlesi,
Michel, Jouvencel, Ferber 2011, sections IV, VII.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence, Set
from itertools import combinations
from typing import Any

from remoras.database import AUVDatabase, VehicleData
from remoras.group_hierarchy import apart
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.work import Work

Row = tuple[dict[int, float], float, float]
"""Constraint: weights of variables, lower and upper bound of their sum."""


class Seats:
    """Initial role assignment as one optimisation problem; groups ``apart`` share no members."""

    def __init__(
        self,
        roles: Sequence[tuple[Group, RoleSpecification]],
        needed: Sequence[int],
        able: Sequence[Sequence[str]],
        apart: Mapping[str, Set[str]],
    ) -> None:
        self._roles, self._needed, self._able, self._apart = roles, needed, able, apart
        pairs = [(r, name) for r, names in enumerate(able) for name in names]
        self._variables = {pair: n for n, pair in enumerate(pairs)}
        self._n_variables = len(pairs)
        self._rows = [*self._counts(), *self._couplings(), *self._doublings()]

    def filled(self) -> tuple[RoleAssignment, ...] | None:
        """Return the assignments; None if infeasible."""
        fixed: dict[int, int] = {}
        solution = self._solved(fixed)
        if solution is None:
            return None
        least, values = solution
        # Of equal optima the first in order of roles and vehicles: fix one variable after the other.
        for r, names in enumerate(self._able):
            left = self._needed[r]
            for name in names:
                variable = self._variables[r, name]
                fixed[variable] = wanted = 1 if left > 0 else 0
                if values[variable] != wanted:
                    other = self._solved(fixed)
                    if other is not None and other[0] == least:
                        values = other[1]
                    else:
                        fixed[variable] = 1 - wanted
                left -= fixed[variable]
        return tuple(
            RoleAssignment(self._roles[r][0].name, self._roles[r][1].name, name)
            for (r, name), variable in self._variables.items()
            if fixed[variable]
        )

    def _counts(self) -> Iterator[Row]:
        for r, names in enumerate(self._able):
            most = self._roles[r][1].maximum
            holders = {self._variables[r, name]: 1.0 for name in names}
            yield holders, float(self._needed[r]), math.inf if most is None else float(most)

    def _couplings(self) -> Iterator[Row]:
        keys = [(group.name, role.name) for group, role in self._roles]
        for (r, name), variable in self._variables.items():
            role = self._roles[r][1]
            if role.played_by is not None:
                other = self._variables.get((keys.index(role.played_by), name)) if role.played_by in keys else None
                yield ({variable: 1.0}, 0.0, 0.0) if other is None else ({variable: 1.0, other: -1.0}, -1.0, 0.0)
            for excluded in role.incompatible:
                other = self._variables.get((keys.index(excluded), name)) if excluded in keys else None
                if other is not None:
                    yield {variable: 1.0, other: 1.0}, 0.0, 1.0

    def _doublings(self) -> Iterator[Row]:
        held: dict[str, list[tuple[str, int]]] = {}
        for (r, name), variable in self._variables.items():
            held.setdefault(name, []).append((self._roles[r][0].name, variable))
        for roles in held.values():
            for (group, variable), (other_group, other) in combinations(roles, 2):
                if group == other_group or other_group in self._apart[group]:
                    # A further variable, 1 if both roles are held: the objective counts these.
                    yield {variable: 1.0, other: 1.0, self._n_variables: -1.0}, -1.0, 1.0
                    self._n_variables += 1

    def _solved(self, fixed: Mapping[int, int]) -> tuple[int, list[int]] | None:
        import numpy as np  # loading takes 0.3 s and is rarely needed
        from scipy.optimize import Bounds, LinearConstraint, milp
        from scipy.sparse import csr_array

        n_pairs, n_all = len(self._variables), self._n_variables
        if any(not weights and low > 0.0 for weights, low, _ in self._rows):
            return None
        if not n_pairs:
            return 0, []
        at = [(row, variable, weight) for row, (of, _, _) in enumerate(self._rows) for variable, weight in of.items()]
        rows, columns, weights = zip(*at, strict=True)
        matrix = csr_array((weights, (rows, columns)), shape=(len(self._rows), n_all))
        lows, highs = np.zeros(n_all), np.ones(n_all)
        for variable, value in fixed.items():
            lows[variable] = highs[variable] = value
        costs = np.ones(n_all)
        costs[n_pairs:] = 1.0 + n_pairs  # one doubling less is worth any holders
        limits: Any = LinearConstraint(matrix, [low for _, low, _ in self._rows], [high for _, _, high in self._rows])
        optimum = milp(costs, constraints=limits, bounds=Bounds(lows, highs), integrality=np.ones(n_all))
        return (round(optimum.fun), [round(value) for value in optimum.x[:n_pairs]]) if optimum.success else None


Founding = tuple[Group, RoleSpecification]


def founded(database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
    """Return the groups with their founding roles assigned: ``form`` of every shipped strategy."""
    founders = _Founders(database, groups)
    return founders.all_others(founders.needed())


class _Founders:
    def __init__(self, database: AUVDatabase, groups: Sequence[Group]) -> None:
        self._database, self._groups, self._apart = database, groups, apart(groups)
        self._founding = list(_in_order([(group, role) for group in groups for role in group.roles if role.founding]))
        names = {name for group, role in self._founding for name in (role.name, group.path(role.name))}
        self._ranks = {data.name: _ranks(data, names) for data in database.values()}
        self._eligible = {(group.name, role.name): self._suited(group, role) for group, role in self._founding}

    def needed(self) -> Organisation:
        """Fill the minimum of each founding role: greedily, or exactly if that leaves a flaw."""
        greedy = Organisation.of(self._groups)
        for group, role in self._founding:
            for data in self._able(greedy, group, role)[: _n_needed(role)]:
                greedy, _ = greedy.assign(data.name, group.name, role.name)
        is_filled = all(self._is_filled(greedy, *place) for place in self._founding)
        if is_filled and not self._n_doubled(greedy):
            return greedy
        able = [[data.name for data in suited] for suited in self._eligible.values()]
        best = Seats(self._founding, [_n_needed(role) for _, role in self._founding], able, self._apart).filled()
        if best is None:
            return greedy
        exact = Organisation.of(self._groups, best)
        return greedy if is_filled and self._n_doubled(greedy) <= self._n_doubled(exact) else exact

    def all_others(self, organisation: Organisation) -> Organisation:
        while True:
            room = [
                (0 if group.within is None else len(organisation.members(group.name)), number, group, role, able[0])
                for number, (group, role) in enumerate(self._founding)
                if (able := self._left(organisation, group, role))
            ]
            if not room:
                return organisation
            _, _, group, role, data = min(room, key=lambda seat: seat[:2])
            organisation, _ = organisation.assign(data.name, group.name, role.name)

    def _left(self, organisation: Organisation, group: Group, role: RoleSpecification) -> list[VehicleData]:
        if role.maximum is not None and len(organisation.members(group.name, role.name)) >= role.maximum:
            return []
        able = self._able(organisation, group, role)
        return [data for data in able if not self._is_taken(organisation, data.name, group)]

    def _suited(self, group: Group, role: RoleSpecification) -> list[VehicleData]:
        able = self._database.able_to_play(group.name, role.name)
        able = tuple(data for data in able if data.social_layer or not role.head)
        return sorted(able, key=lambda data: (self._rank(data, group, role), -data.energy_j, data.node))

    def _able(self, organisation: Organisation, group: Group, role: RoleSpecification) -> list[VehicleData]:
        able = [
            data
            for data in self._eligible[group.name, role.name]
            if (role.played_by is None or organisation.plays(data.name, *role.played_by))
            and not organisation.is_excluded(data.name, role)
            and not organisation.plays(data.name, group.name, role.name)
        ]
        return sorted(able, key=lambda data: self._is_taken(organisation, data.name, group))

    def _rank(self, data: VehicleData, group: Group, role: RoleSpecification) -> int:
        ranks = self._ranks[data.name]
        return min(ranks.get(role.name, len(ranks)), ranks.get(group.path(role.name), len(ranks)))

    def _is_taken(self, organisation: Organisation, vehicle: str, group: Group) -> bool:
        return any(organisation.is_member(vehicle, name) for name in (group.name, *self._apart[group.name]))

    def _is_filled(self, organisation: Organisation, group: Group, role: RoleSpecification) -> bool:
        return len(organisation.members(group.name, role.name)) >= _n_needed(role)

    def _n_doubled(self, organisation: Organisation) -> int:
        pairs = (pair for name in self._database for pair in combinations(organisation.roles_of(name), 2))
        return sum(a.group == b.group or b.group in self._apart[a.group] for a, b in pairs)


def _n_needed(role: RoleSpecification) -> int:
    return max(1, role.minimum) if role.head else role.minimum


def _ranks(data: VehicleData, founding: Collection[str]) -> dict[str, int]:
    return {name: n for n, name in enumerate(name for name in data.playable_roles if name in founding)}


def _in_order(founding: list[Founding]) -> Iterator[Founding]:
    """Yield leader roles, then the roles of groups with a leader."""
    done: set[tuple[str, str]] = set()
    while ready := [
        (group, role)
        for group, role in founding
        if (group.name, role.name) not in done and (role.played_by is None or role.played_by in done)
    ]:
        led = {group.name for group, role in founding if role.head and (group.name, role.name) in done}
        heads_first = [(group, role) for group, role in ready if role.head or group.name in led]
        for group, role in heads_first or ready:
            done.add((group.name, role.name))
            yield group, role


def common_roles(work: Work, working: Collection[str] | None = None) -> tuple[RoleAssignment, ...]:
    """Return roles without a job for ``working`` (None: all) members; others only fill minima."""
    group, organisation, database = work.group, work.organisation, work.database
    members = [name for name in database.names if organisation.is_member(name, group.name)]
    allocated: list[RoleAssignment] = []
    for role in group.roles:
        if role.founding or role.job is not None:
            continue
        held = organisation.members(group.name, role.name)
        able = [
            name
            for name in members
            if database[name].can_play(group.name, role.name)
            and name not in held
            and not organisation.is_excluded(name, role)
        ]
        free = len(able) if role.maximum is None else max(0, role.maximum - len(held))
        if working is not None:
            able.sort(key=lambda name: name not in working)
            n_demanded = role.minimum - len(held)
            free = min(free, max(sum(name in working for name in able), n_demanded))
        allocated += [work.assignment(role, name) for name in able[:free]]
    return tuple(allocated)
