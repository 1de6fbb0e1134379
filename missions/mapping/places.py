"""Places in the formation: which a role has, and the behaviour that keeps one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from missions.mapping.scenario import MappingScenario
from remoras.avoidance import clearance_m
from remoras.behaviours import Positioning
from remoras.database import VehicleData

ROOM = 1.25
"""A place is this many times as far from the leader as the two keep clear: the leader has moved on since it was heard.

Nearer, followers drive their leader before them, at full speed and away from where it has to go.
"""


def formation_of(scenario: MappingScenario) -> dict[tuple[str, str], tuple[str, str]]:
    """Places in the formation by group and role."""
    roles = [(group.name, role) for group in scenario.group for role in group.role]
    return {(group, role.name): role.position for group, role in roles if role.position is not None}


def room_of(vehicles: Iterable[VehicleData], separation_m: float) -> dict[str, float]:
    """How far from a vehicle, by name, a place has to be (m), so that who holds it is not in its way in transit.

    Args:
        vehicles: of the fleet.
        separation_m: that they keep.
    """
    return {
        data.name: ROOM * clearance_m(separation_m, data.transit_speed_mps, data.turn_rate_radps) for data in vehicles
    }


def positioning(
    place: tuple[str, str],
    leaders: Sequence[str],
    group: str,
    data: VehicleData,
    spacing_m: float,
    room_m: Mapping[str, float],
) -> Positioning:
    """To keep a place in the formation; in its middle behind the leader.

    Args:
        place: row and side; leaders: of the group, by name.
        group: its name; data: of the vehicle.
        spacing_m: distance between places, as the mission has it.
        room_m: least distance from each vehicle; the widest of the leaders and the vehicle itself counts.
    """
    spacing_m = max(spacing_m, room_m[data.name], *(room_m[name] for name in leaders))
    row, side = place
    ahead_m = -spacing_m * ((row == "bottom") + (side == "middle"))
    left_m = spacing_m * ((side == "left") - (side == "right"))
    others = tuple(name for name in leaders if name != data.name)
    return Positioning(others, group, (ahead_m, left_m), data)
