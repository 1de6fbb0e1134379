"""Places in the formation: which a role has, and the behaviour that keeps one."""

from __future__ import annotations

from collections.abc import Sequence

from missions.mapping.scenario import MappingScenario
from remoras.behaviours import Positioning
from remoras.database import VehicleData


def formation_of(scenario: MappingScenario) -> dict[tuple[str, str], tuple[str, str]]:
    """Places in the formation by group and role."""
    roles = [(group.name, role) for group in scenario.group for role in group.role]
    return {(group, role.name): role.position for group, role in roles if role.position is not None}


def positioning(
    place: tuple[str, str], leaders: Sequence[str], group: str, data: VehicleData, spacing_m: float
) -> Positioning:
    """To keep a place in the formation; in its middle behind the leader.

    Args:
        place: row and side; leaders: of the group, by name.
        group: its name; data: of the vehicle.
        spacing_m: distance between places.
    """
    row, side = place
    ahead_m = -spacing_m * ((row == "bottom") + (side == "middle"))
    left_m = spacing_m * ((side == "left") - (side == "right"))
    others = tuple(name for name in leaders if name != data.name)
    return Positioning(others, group, (ahead_m, left_m), data)
