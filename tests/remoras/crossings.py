"""Crossings: vehicles in one depth layer on conflicting courses, moved by the code of a run."""

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from samples import activity_set, auv

from missions.features.current import Current, in_current
from remoras.activities import Activity, ActivityType
from remoras.behaviours import Behaviour, Reference, Standing, distance_m
from remoras.database import VehicleData
from remoras.functional.layer import FunctionalLayer
from remoras.functional.vital import VITAL_SETS
from remoras.motion import Motion
from remoras.motion.separation import Separation
from remoras.picture import Picture
from remoras.work import Point

BOUNDS_M = (-1000.0, -1000.0, 1000.0, 1000.0)
ARRIVED_M = 20.0
"""As near as vehicles have to come to a rally point."""
REACH_M = 300.0
"""From the middle of a crossing to where they start; so the straight way is 600 m, as in the shipped missions."""
LANE_M = 15.0
"""Between neighbours of one stream."""
SPREAD = 0.1
"""Vehicles are by up to this share faster or slower than 2 m/s, as in ``mapping-patches``."""
JITTER_M = 3.0
GOING = activity_set(("Going", ActivityType.GUIDANCE))


class Going(Standing):
    """Goes to a place and stays there."""

    def __init__(self, place_m: Point, data: VehicleData) -> None:
        self._place_m, self._data = place_m, data

    def reference(self, motion: Motion, picture: Picture) -> Reference:
        to_go_m = distance_m(motion, self._place_m)
        return Reference(self._place_m, self._data.transit_speed_mps if to_go_m > 1.0 else 0.0)


@dataclass
class Errand:
    """A mission that has its vehicle go somewhere."""

    place_m: Point

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        return Going(self.place_m, data)


@dataclass
class Traveller:
    """A vehicle as far as it moves."""

    data: VehicleData
    functional: FunctionalLayer
    goal_m: Point
    is_alive: bool = True
    arrived_s: float | None = None
    way_m: float = 0.0

    @property
    def straight_m(self) -> float:
        return math.dist(self.data.start_m, self.goal_m) - ARRIVED_M


@dataclass(frozen=True)
class Crossing:
    """How a crossing went: least distance (m), pairs that came too near, and the worst over straight way and time."""

    closest_m: float
    n_conflicts: int
    n_arrived: int
    longest_way: float
    longest_time: float


def traveller(
    number: int, start_m: Point, goal_m: Point, speed_mps: float = 2.0, current: Current | None = None, **changes: Any
) -> Traveller:
    """A vehicle that starts on its course."""
    data = auv(f"AUV{number:02d}", start_m=start_m, transit_speed_mps=speed_mps, energy_j=1e9, **changes)
    functional = FunctionalLayer(data, Errand(goal_m), None, {}, BOUNDS_M, Picture())
    if current is not None:
        in_current(functional, current)
    functional.prepare([GOING])
    functional.perform([len(VITAL_SETS)])
    functional.motion.heading_rad = math.atan2(goal_m[1] - start_m[1], goal_m[0] - start_m[0])
    return Traveller(data, functional, goal_m)


def on_circle(n_vehicles: int, draw: random.Random) -> list[tuple[Point, Point]]:
    """Each vehicle goes to the opposite side."""
    turns = [math.tau * number / n_vehicles for number in range(n_vehicles)]
    return [
        (
            (REACH_M * math.cos(turn) + _jitter(draw), REACH_M * math.sin(turn) + _jitter(draw)),
            (-REACH_M * math.cos(turn), -REACH_M * math.sin(turn)),
        )
        for turn in turns
    ]


def in_streams(n_vehicles: int, draw: random.Random) -> list[tuple[Point, Point]]:
    """One half from the west, the other from the south."""
    ways = []
    for offset_m in _lanes(n_vehicles // 2):
        ways.append(((-REACH_M + _jitter(draw), offset_m + _jitter(draw)), (REACH_M, offset_m)))
        ways.append(((offset_m + _jitter(draw), -REACH_M + _jitter(draw)), (offset_m, REACH_M)))
    return ways


def head_on(n_vehicles: int, draw: random.Random) -> list[tuple[Point, Point]]:
    """One half from the west, the other from the east, lane against lane."""
    ways = []
    for offset_m in _lanes(n_vehicles // 2):
        ways.append(((-REACH_M + _jitter(draw), offset_m + _jitter(draw)), (REACH_M, offset_m)))
        ways.append(((REACH_M + _jitter(draw), offset_m + _jitter(draw)), (-REACH_M, offset_m)))
    return ways


KINDS = {"circle": on_circle, "streams": in_streams, "head-on": head_on}


def _lanes(n_lanes: int) -> list[float]:
    return [LANE_M * (number - (n_lanes - 1) / 2) for number in range(n_lanes)]


def _jitter(draw: random.Random) -> float:
    return draw.uniform(-JITTER_M, JITTER_M)


def crossing(kind: str, n_vehicles: int, seed: int, current: Current | None = None) -> list[Traveller]:
    """The vehicles of a crossing, in somewhat different places and at somewhat different speeds for each seed."""
    draw = random.Random(seed)
    ways = KINDS[kind](n_vehicles, draw)
    return [
        traveller(number, start_m, goal_m, 2.0 * draw.uniform(1.0 - SPREAD, 1.0 + SPREAD), current)
        for number, (start_m, goal_m) in enumerate(ways)
    ]


def travel(fleet: Sequence[Traveller], until_s: float = 1200.0) -> Crossing:
    """Let all move until they have arrived."""
    watch = Separation(fleet, 5.0)
    closest_m, now_s, too_near = math.inf, 0.0, set()
    while now_s < until_s and any(one.arrived_s is None for one in fleet):
        now_s += 1.0
        seen = watch.look()
        for one in fleet:
            one.functional.picture.body.now_s = now_s - 1.0
            one.functional.act(1.0, seen.get(one.data.node, ()))
            if one.arrived_s is None and distance_m(one.functional.motion, one.goal_m) <= ARRIVED_M:
                one.arrived_s, one.way_m = now_s, one.functional.motion.distance_m
        too_near |= {(row[1], row[3]) for row in watch.conflicts(now_s)}
        closest_m = min([closest_m, *(math.hypot(near.dx_m, near.dy_m) for near in _all(watch))])
    arrived = [one for one in fleet if one.arrived_s is not None]
    return Crossing(
        closest_m,
        len(too_near),
        len(arrived),
        max((one.way_m / one.straight_m for one in arrived), default=math.inf),
        max((_straight_ways_in(one) for one in arrived), default=math.inf),
    )


def _straight_ways_in(one: Traveller) -> float:
    """How often a vehicle could have gone the straight way in the time that it took."""
    return (one.arrived_s or 0.0) * one.data.transit_speed_mps / one.straight_m


def _all(watch: Separation) -> list[Any]:
    return [near for seen in watch.look().values() for near in seen]
