"""How a find is inspected: the behaviour that takes a vehicle there, slows it down, and keeps it on site."""

from __future__ import annotations

import math

from missions.mapping.scenario import FindsTable
from remoras.behaviours import (
    ADVANCING,
    CAPTURE_M,
    DONE,
    DUE,
    FAILED,
    IDLE,
    STUCK,
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

BRAKING_S = 2.0
"""A vehicle begins to slow down so much earlier than it must."""
PATIENCE_S = 60.0
"""A vehicle that has been on site so much longer than any find takes has a sensor that shows nothing."""
NO_WAY_S = 300.0
"""A vehicle that comes no nearer for so long makes no way: the water carries it off as fast as it may go."""
NEARER_M = 1.0


class Inspecting(Behaviour):
    """Goes to a find in transit and stays on site until the sensor has seen enough, which nobody can tell before.

    Args:
        find: its name.
        finds: how near and how slowly it is inspected, and how long that may take.
        data: of the vehicle.
    """

    def __init__(self, find: str, finds: FindsTable, data: VehicleData) -> None:
        self._find = find
        self._finds = finds
        self._transit_mps = data.transit_speed_mps
        fast_mps, slow_mps = data.transit_speed_mps, finds.close_speed_mps
        braking_m = (fast_mps - slow_mps) * (fast_mps + slow_mps) / (2.0 * data.acceleration_mps2)
        self._slow_within_m = finds.close_radius_m + max(0.0, braking_m) + BRAKING_S * data.transit_speed_mps
        self._approach = Approach(data.transit_speed_mps)
        self._on_site_s = 0.0
        self._seen_s: float | None = None
        self._nearest_m, self._nearest_s = math.inf, 0.0  # since it performs it

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due once the find is known, the less the farther away; on site it advances for as long as a find may take.

        It has failed where nothing is seen on site for longer, or the vehicle makes no way.
        """
        place_m, now_s = self._place(picture), picture.body.now_s
        if place_m is None:
            return IDLE
        if picture.facts.get(("inspectedBy", self._find)) is not None:
            return DONE
        to_go_m = distance_m(motion, place_m)
        is_on_site = performed and to_go_m <= self._finds.close_radius_m
        if is_on_site and self._seen_s is not None:
            self._on_site_s += now_s - self._seen_s
        self._seen_s = now_s if is_on_site else None
        if not performed or to_go_m < self._nearest_m - NEARER_M:
            self._nearest_m, self._nearest_s = to_go_m if performed else math.inf, now_s
        makes_no_way = not is_on_site and now_s - self._nearest_s > NO_WAY_S
        if makes_no_way:
            return STUCK
        if self._on_site_s > self._finds.longest_stay_s + PATIENCE_S:
            return FAILED
        if to_go_m <= self._finds.close_radius_m:
            return ADVANCING if performed else DUE
        advance = self._approach.advance(to_go_m, now_s, performed)
        return Perception(attracted(to_go_m).stimulus, None if advance is None else max(0.0, advance))

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the find in transit, slowly over the last metres; there it stays. None while it is not known."""
        place_m = self._place(picture)
        if place_m is None:
            return None
        to_go_m = distance_m(motion, place_m)
        if to_go_m <= CAPTURE_M:
            return Reference(place_m, 0.0)
        if to_go_m > self._slow_within_m:
            return Reference(place_m, self._transit_mps)
        return Reference(place_m, self._finds.close_speed_mps, is_over_ground=True)

    def _place(self, picture: Picture) -> Point | None:
        place_m: Point | None = picture.facts.get(("foundAt", self._find))
        return place_m
