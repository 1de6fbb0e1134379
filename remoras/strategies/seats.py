"""Seats: who is to hold which role, all at once, where who holds one depends on who holds another.

A mixed integer programme with one variable for each vehicle and role (HiGHS, by SciPy): a role has at least as many
holders as it needs, and no more than it allows; the holder of a role that has to be played with another holds both;
incompatible roles have no holder in common. Least is how many roles vehicles hold beside another one of the same group,
or of a group beside it. Of all ways in which that is least the first counts: role by role, vehicle by vehicle, and no
more holders than that takes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from remoras.organisation import Group, RoleAssignment, RoleSpecification

Row = tuple[dict[int, float], float, float]
"""Weights of variables, and the least and the most of their sum."""


def place_of(group: Group) -> tuple[bool, str]:
    """What groups have in common of which a vehicle should be in one alone: that they are within the same group."""
    return group.within is not None, group.within or group.name


class Seats:
    """One assignment.

    Args:
        roles: groups and roles, those that are given first in front.
        needed: how many holders each has at least.
        able: names of those able to hold each, those first who come first.
    """

    def __init__(
        self, roles: Sequence[tuple[Group, RoleSpecification]], needed: Sequence[int], able: Sequence[Sequence[str]]
    ) -> None:
        self._roles, self._needed, self._able = roles, needed, able
        pairs = [(r, name) for r, names in enumerate(able) for name in names]
        self._variables = {pair: n for n, pair in enumerate(pairs)}
        self._doubled = self._places()
        self._rows = [*self._counts(), *self._couplings(), *self._doublings()]

    def filled(self) -> tuple[RoleAssignment, ...] | None:
        """Who holds what; None if not all roles can be filled."""
        fixed: dict[int, int] = {}
        least = self._least(fixed)
        if least is None:
            return None
        for r, names in enumerate(self._able):
            left = self._needed[r]
            for name in names:
                variable = self._variables[r, name]
                fixed[variable] = 1 if left > 0 else 0
                if self._least(fixed) != least:
                    fixed[variable] = 1 - fixed[variable]
                left -= fixed[variable]
        return tuple(
            RoleAssignment(self._roles[r][0].name, self._roles[r][1].name, name)
            for (r, name), variable in self._variables.items()
            if fixed[variable]
        )

    def _places(self) -> list[list[int]]:
        """Variables of which a vehicle should have one: its roles in a group, or in groups within the same one."""

        def place(pair: tuple[int, str]) -> tuple[str, bool, str]:
            return pair[1], *place_of(self._roles[pair[0]][0])

        alike = groupby(sorted(self._variables, key=place), key=place)
        found = [[self._variables[pair] for pair in pairs] for _, pairs in alike]
        return [variables for variables in found if len(variables) > 1]

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
        """Behind the variables of the pairs stand those of the places: how many roles are held beside another one."""
        for n, variables in enumerate(self._doubled, len(self._variables)):
            yield {**dict.fromkeys(variables, 1.0), n: -1.0}, -float(len(variables)), 1.0

    def _least(self, fixed: dict[int, int]) -> int | None:
        """Least number of roles held beside others, where some variables are fixed; None if nothing fits."""
        import numpy as np  # these take a third of a second to load, and few foundings need them
        from scipy.optimize import Bounds, LinearConstraint, milp

        n_pairs, n_all = len(self._variables), len(self._variables) + len(self._doubled)
        if not n_pairs or any(not weights and low > 0.0 for weights, low, _ in self._rows):
            return None if any(self._needed) else 0
        matrix = np.zeros((len(self._rows), n_all))
        for row, (weights, _, _) in enumerate(self._rows):
            matrix[row, list(weights)] = list(weights.values())
        lows, highs = np.zeros(n_all), np.ones(n_all)
        highs[n_pairs:] = np.inf
        for variable, value in fixed.items():
            lows[variable] = highs[variable] = value
        costs = np.zeros(n_all)
        costs[n_pairs:] = 1.0
        limits: Any = LinearConstraint(matrix, [low for _, low, _ in self._rows], [high for _, _, high in self._rows])
        found = milp(costs, constraints=limits, bounds=Bounds(lows, highs), integrality=np.ones(n_all))
        return round(found.fun) if found.success else None
