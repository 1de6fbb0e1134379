"""Lanes of a timeline: one for each vehicle, or one for vehicles that are alike, so that a large fleet fits a page.

Vehicles are alike if they held the same roles, whenever that was; where this does not save enough, if they began with
the same role. A folded lane shows at each time the share of its vehicles that a role drives.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import NamedTuple

from visualisation.runs.reading import RoleKey, Span, Tenure

Tenures = Mapping[str, Sequence[Tenure]]
"""Roles by vehicle."""


class LaneRole(NamedTuple):
    """One role of a lane: when each of its vehicles held it, and when it drove them."""

    group: str
    role: str
    held: tuple[tuple[Span, ...], ...]
    active: tuple[tuple[Span, ...], ...]


class VehicleLane(NamedTuple):
    """One vehicle or several, and their roles."""

    vehicles: tuple[str, ...]
    rows: tuple[LaneRole, ...]

    @property
    def is_folded(self) -> bool:
        """True if it stands for several vehicles."""
        return len(self.vehicles) > 1


def one_each(tenures: Tenures) -> list[VehicleLane]:
    """A lane for each vehicle."""
    return _folded(tenures, lambda vehicle: vehicle)


def same_roles(tenures: Tenures) -> list[VehicleLane]:
    """A lane for all vehicles that held the same roles."""
    return _folded(tenures, lambda vehicle: frozenset((tenure.group, tenure.role) for tenure in tenures[vehicle]))


def same_beginning(tenures: Tenures) -> list[VehicleLane]:
    """A lane for all vehicles that began with the same roles."""

    def first(vehicle: str) -> Hashable:
        began = min((span.start_s for tenure in tenures[vehicle] for span in tenure.held), default=0.0)
        return frozenset(
            (tenure.group, tenure.role)
            for tenure in tenures[vehicle]
            if tenure.held and tenure.held[0].start_s == began
        )

    return _folded(tenures, first)


FOLDS: tuple[Callable[[Tenures], list[VehicleLane]], ...] = (one_each, same_roles, same_beginning)
"""Ways to make lanes, each with fewer than the one before."""


def _folded(tenures: Tenures, alike: Callable[[str], Hashable]) -> list[VehicleLane]:
    members: dict[Hashable, list[str]] = {}
    for vehicle in tenures:
        members.setdefault(alike(vehicle), []).append(vehicle)
    return [VehicleLane(tuple(own), _rows(tenures, own)) for own in members.values()]


def _rows(tenures: Tenures, vehicles: Sequence[str]) -> tuple[LaneRole, ...]:
    found: dict[RoleKey, list[Tenure]] = {}
    for vehicle in vehicles:
        for tenure in tenures[vehicle]:
            found.setdefault((tenure.group, tenure.role), []).append(tenure)
    return tuple(
        LaneRole(*key, tuple(tenure.held for tenure in own), tuple(tenure.active for tenure in own))
        for key, own in found.items()
    )


def shares(of_vehicles: Sequence[Sequence[Span]], n_vehicles: int) -> list[tuple[Span, float]]:
    """Share of the vehicles over time: stretches with one share each, those of none left out.

    Args:
        of_vehicles: spans of each vehicle that has some.
        n_vehicles: how many there are in all.

    >>> [(*span, share) for span, share in shares([[Span(0, 4)], [Span(2, 6)]], 2)]
    [(0, 2, 0.5), (2, 4, 1.0), (4, 6, 0.5)]
    """
    steps: dict[float, int] = {}
    for spans in of_vehicles:
        for span in spans:
            steps[span.start_s] = steps.get(span.start_s, 0) + 1
            steps[span.end_s] = steps.get(span.end_s, 0) - 1
    found: list[tuple[Span, float]] = []
    count, start_s = 0, 0.0
    for time_s in sorted(steps):
        if count and time_s > start_s:
            found.append((Span(start_s, time_s), count / n_vehicles))
        count, start_s = count + steps[time_s], time_s
    return found
