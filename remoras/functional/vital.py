"""What a vehicle needs to live: it keeps its distance, comes home on its last energy and stays where it operates.

These activities are the vehicle's own, whatever its mission, and come before all others: while one of them has a
stimulus it is performed, the first of them in this order, whatever objectives and influence signals weigh. So a mission
can neither forget nor override them. Sending influence signals belongs here too, as what a vehicle does in any case.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.behaviours import CAPTURE_M, DUE, IDLE, Behaviour, Perception, Reference, Standing, distance_m
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Point

ROUTINE_IMPORTANCE = 0.1
"""Importance of what a vehicle does in any case."""
SAFETY_M = 5.0
"""Distance that two vehicles at one depth keep."""
HORIZON_S = 30.0
"""A collision farther ahead than this is not yet a concern."""
EVADE_M = 50.0
"""Distance of the target that a vehicle evades to; it only gives the direction."""

Bounds = tuple[float, float, float, float]
"""Borders of the area of operations: x_min, y_min, x_max, y_max (m)."""


class Neighbour(NamedTuple):
    """Another vehicle close by, as the obstacle sonar sees it: its position from here, and its velocity."""

    dx_m: float
    dy_m: float
    vx_mps: float
    vy_mps: float


def time_to_collision_s(
    neighbour: Neighbour, own_vx_mps: float, own_vy_mps: float, safety_m: float, horizon_s: float
) -> float | None:
    """Time (s) until a neighbour is closest; None unless it then passes within ``safety_m`` and within ``horizon_s``.

    Velocities are taken as constant: t = -d.v / v.v with d the relative position and v the relative velocity.

    Args:
        neighbour: as the obstacle sonar sees it.
        own_vx_mps, own_vy_mps: velocity of this vehicle.
        safety_m: distance to be kept; horizon_s: how far ahead to look.

    >>> time_to_collision_s(Neighbour(20.0, 1.0, -1.0, 0.0), 1.0, 0.0, safety_m=5.0, horizon_s=30.0)
    10.0
    >>> time_to_collision_s(Neighbour(20.0, 9.0, -1.0, 0.0), 1.0, 0.0, safety_m=5.0, horizon_s=30.0)
    """
    vx_mps = neighbour.vx_mps - own_vx_mps
    vy_mps = neighbour.vy_mps - own_vy_mps
    closing = -(neighbour.dx_m * vx_mps + neighbour.dy_m * vy_mps)
    speed_squared = vx_mps * vx_mps + vy_mps * vy_mps
    if closing <= 0.0 or speed_squared == 0.0:
        return None
    time_s = closing / speed_squared
    if time_s > horizon_s:
        return None
    miss_x_m = neighbour.dx_m + vx_mps * time_s
    miss_y_m = neighbour.dy_m + vy_mps * time_s
    return time_s if miss_x_m * miss_x_m + miss_y_m * miss_y_m < safety_m * safety_m else None


def most_urgent(neighbours: Iterable[Neighbour], motion: Motion) -> tuple[float, float] | None:
    """Bearing (rad) and urgency 0..1 of the neighbour to be avoided first; None without a collision course."""
    worst: tuple[float, float] | None = None
    for neighbour in neighbours:
        time_s = time_to_collision_s(neighbour, *motion.velocity_mps, SAFETY_M, HORIZON_S)
        if time_s is not None and (worst is None or 1.0 - time_s / HORIZON_S > worst[1]):
            worst = math.atan2(neighbour.dy_m, neighbour.dx_m), 1.0 - time_s / HORIZON_S
    return worst


class Evading(Behaviour):
    """Turns away from a vehicle on collision course, to the left of its bearing."""

    def __init__(self, data: VehicleData) -> None:
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """As due as the collision is urgent."""
        return IDLE if picture.body.collision is None else Perception(picture.body.collision[1])

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """At a right angle to the bearing of the other; None without a collision course."""
        if picture.body.collision is None:
            return None
        away = picture.body.collision[0] + math.pi / 2.0  # both turn to their left, so they pass
        target = motion.x_m + EVADE_M * math.cos(away), motion.y_m + EVADE_M * math.sin(away)
        return Reference(target, self._data.survey_speed_mps)


class ReturningHome(Behaviour):
    """Goes home once no more energy is left than the way takes with a margin, and stays there."""

    def __init__(self, data: VehicleData) -> None:
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due from the reserve on, and as long as it is performed."""
        return DUE if performed or picture.body.battery <= picture.body.reserve else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To where the vehicle started; stay there on arrival."""
        arrived = distance_m(motion, self._data.start_m) <= CAPTURE_M
        return Reference(self._data.start_m, 0.0 if arrived else self._data.survey_speed_mps)


class ReturningToArea(Behaviour):
    """Goes back into the area of operations.

    Args:
        centre_m: of the area of operations.
        data: of the vehicle.
    """

    def __init__(self, centre_m: Point, data: VehicleData) -> None:
        self._centre_m = centre_m
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due outside the area of operations."""
        return DUE if picture.body.outside_m > 0.0 else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the centre in transit."""
        return Reference(self._centre_m, self._data.transit_speed_mps)


def _vital(name: str) -> ActivitySet:
    return ActivitySet(None, ActivityKind.VITAL, (Activity(name, ActivityType.GUIDANCE),), 1.0)


VITAL_SETS = (
    ActivitySet(
        None,
        ActivityKind.INDIVIDUAL,
        (Activity("SendingInfluenceSignals", ActivityType.COMMUNICATION),),
        ROUTINE_IMPORTANCE,
    ),
    _vital("Evading"),
    _vital("ReturningHome"),
    _vital("ReturningToArea"),
)
"""What every vehicle considers, in this order, before the activities of its objectives."""

VITAL_NAMES = frozenset(activity_set.name for activity_set in VITAL_SETS)
"""Names that no activity of a mission may have."""


def vital_behaviour(activity: Activity, data: VehicleData, bounds_m: Bounds) -> Behaviour:
    """The behaviour of the vital set which ``activity`` leads.

    Args:
        activity: the first one of a set of ``VITAL_SETS``.
        data: of the vehicle.
        bounds_m: area of operations.
    """
    match activity.name:
        case "Evading":
            return Evading(data)
        case "ReturningHome":
            return ReturningHome(data)
        case "ReturningToArea":
            x_min, y_min, x_max, y_max = bounds_m
            return ReturningToArea(((x_min + x_max) / 2.0, (y_min + y_max) / 2.0), data)
    return Standing()
