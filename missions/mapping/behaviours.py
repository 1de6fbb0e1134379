"""How the mapping of an area is carried out: the behaviour that leads a vehicle over it, row by row."""

from __future__ import annotations

from collections.abc import Sequence

from missions.mapping.sensors import mapping_speed_mps
from remoras.behaviours import (
    CAPTURE_M,
    DONE,
    Approach,
    Behaviour,
    Perception,
    Reference,
    attracted,
    distance_m,
)
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.work import Point


class ZigzagExploring(Behaviour):
    """Explores along the rows of a grid: at transit speed to the first point, then as fast as the sensor maps.

    Until it has begun, its stimulus falls with the distance to the first point.

    Args:
        waypoints: ends of the rows, in the order in which they are passed.
        data: of the vehicle.
    """

    def __init__(self, waypoints: Sequence[Point], data: VehicleData) -> None:
        self._waypoints = list(waypoints)
        self._transit_speed_mps = data.transit_speed_mps
        self._speed_mps = mapping_speed_mps(data)
        self._next = 0
        self._approach = Approach(self._transit_speed_mps)

    def _reached_end(self, motion: Motion) -> bool:
        """Pass the waypoints that are reached; True once the last one is."""
        while self._next < len(self._waypoints) and distance_m(motion, self._waypoints[self._next]) <= CAPTURE_M:
            self._next += 1
            self._approach = Approach(self._speed_mps)
        return self._next == len(self._waypoints)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due until the last waypoint is reached; turning at the end of a row is progress."""
        if self._reached_end(motion):
            return DONE
        to_go_m = distance_m(motion, self._waypoints[self._next])
        advance = self._approach.advance(to_go_m, picture.body.now_s, performed)
        if self._next == 0 and not performed:
            return attracted(to_go_m)
        return Perception(1.0, None if advance is None else abs(advance))  # turning at the end of a row is progress

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the next waypoint; None behind the last one."""
        if self._reached_end(motion):
            return None
        speed_mps = self._speed_mps if self._next else self._transit_speed_mps
        return Reference(self._waypoints[self._next], speed_mps)
