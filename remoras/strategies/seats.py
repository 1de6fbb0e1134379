"""Seats: who is to hold which role, all at once, where who holds one depends on who holds another.

A mixed integer programme with one variable for each vehicle and role (HiGHS, by SciPy): a role has at least as many
holders as it needs, and no more than it allows; the holder of a role that has to be played with another holds both;
incompatible roles have no holder in common. Least is how often a vehicle holds two roles of one group, or of groups
that are apart; then, how many holders there are. Of all ways in which these are least the first counts: role by role,
vehicle by vehicle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence, Set
from itertools import combinations
from typing import Any

from remoras.organisation import Group, RoleAssignment, RoleSpecification

Row = tuple[dict[int, float], float, float]
"""Weights of variables, and the least and the most of their sum."""


class Seats:
    """One assignment.

    Args:
        roles: groups and roles, those that are given first in front.
        needed: how many holders each has at least.
        able: names of those able to hold each, those first who come first.
        apart: for each group, by name, others that its members should not be in.
    """

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
        """Who holds what; None if not all roles can be filled."""
        fixed: dict[int, int] = {}
        found = self._solved(fixed)
        if found is None:
            return None
        least, values = found
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
        """Behind the variables of the pairs stand those of what should not be: each is 1 where two are held."""
        held: dict[str, list[tuple[str, int]]] = {}
        for (r, name), variable in self._variables.items():
            held.setdefault(name, []).append((self._roles[r][0].name, variable))
        for roles in held.values():
            for (group, one), (other_group, other) in combinations(roles, 2):
                if group == other_group or other_group in self._apart[group]:
                    yield {one: 1.0, other: 1.0, self._n_variables: -1.0}, -1.0, 1.0
                    self._n_variables += 1

    def _solved(self, fixed: Mapping[int, int]) -> tuple[int, list[int]] | None:
        """What is least, and values of the variables that make it so, where some are fixed; None if nothing fits."""
        import numpy as np  # these take a third of a second to load, and few foundings need them
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
        found = milp(costs, constraints=limits, bounds=Bounds(lows, highs), integrality=np.ones(n_all))
        return (round(found.fun), [round(value) for value in found.x[:n_pairs]]) if found.success else None
