"""How each activity is carried out, and how it perceives its own stimulus and progress.

A behaviour belongs to one activity set of one vehicle. Every tick it is asked ``perceive``; if its set is in the
decision and it guides, it is asked ``reference`` for a target and a speed. It sees the vehicle's own motion and
a ``Picture``: what the vehicle has heard or worked out, never the truth. To add an activity, write a class and
name it in the mission's activity table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from remoras.database import VehicleData
from remoras.executive.satisfaction import Progress
from remoras.motion import Motion

Point = tuple[float, float]
CAPTURE_M = 1.0
"""A waypoint counts as reached within this distance."""
FAR_M = 10_000.0
"""At this distance an area that nobody has begun is half the stimulus that it is nearby."""
STEADY_M = 0.05
"""Approaching by less than this in a tick is standing still."""


@dataclass(slots=True)
class Picture:
    """What a vehicle knows at this moment that its behaviours look at.

    Attributes:
        positions: last position known of each vehicle, by name; headings from the last two of them.
        heard_s: when a packet of each peer was last heard, by name.
        gathered: groups believed to be together at their rally point.
        planning_due: the social layer has something to plan.
        last_news_s: when a peer's contribution to the mission was last heard of.
        last_yield_s: when the vehicle's own work last yielded something.
        collision: bearing and urgency 0..1 of a vehicle on collision course, else None.
        battery: fraction left; reserve: fraction needed to get home, with margin.
        frame_s: length of a TDMA frame, in which everybody may speak once; infinite where nobody speaks.
        outside: how far, in metres, the vehicle is outside the area of operations.
    """

    now_s: float = 0.0
    positions: dict[str, Point] = field(default_factory=dict)
    headings: dict[str, float] = field(default_factory=dict)
    heard_s: dict[str, float] = field(default_factory=dict)
    gathered: set[str] = field(default_factory=set)
    planning_due: bool = False
    last_news_s: float = -math.inf
    last_yield_s: float = -math.inf
    collision: tuple[float, float] | None = None
    battery: float = 1.0
    reserve: float = 0.0
    outside_m: float = 0.0
    frame_s: float = math.inf

    def saw(self, name: str, position: Point) -> None:
        """A newer position of a vehicle is known."""
        before = self.positions.get(name)
        if before is not None and before != position:
            self.headings[name] = math.atan2(position[1] - before[1], position[0] - before[0])
        self.positions[name] = position


class Perception(NamedTuple):
    """Stimulus 0..1, and how the activity is getting on (None: it has nothing to get on with).

    ``done``: all there was to do has been done; it will not come back.
    """

    stimulus: float
    progress: Progress | None = None
    done: bool = False


class Reference(NamedTuple):
    """What guidance asks of the control."""

    target_m: Point
    speed_mps: float


class Behaviour(Protocol):
    """What an activity set needs to be carried out; one object per vehicle and set."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception: ...

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """Target and speed, or None for an activity that does not guide."""
        ...


IDLE = Perception(0.0)
DONE = Perception(0.0, done=True)
DUE = Perception(1.0)
ADVANCING = Perception(1.0, Progress.FORWARD)
STANDING = Perception(1.0, Progress.NONE)
RETREATING = Perception(1.0, Progress.BACKWARD)


def distance_m(motion: Motion, point: Point) -> float:
    dx_m, dy_m = point[0] - motion.x_m, point[1] - motion.y_m
    return math.sqrt(dx_m * dx_m + dy_m * dy_m)


class _Approach:
    """Is the vehicle getting nearer to where it wants to be?"""

    def __init__(self) -> None:
        self._last_m: float | None = None

    def judge(self, to_go_m: float, performed: bool) -> Perception:
        last_m, self._last_m = self._last_m, to_go_m if performed else None
        if last_m is None or not performed:
            return DUE
        nearer_m = last_m - to_go_m
        return ADVANCING if nearer_m > STEADY_M else RETREATING if nearer_m < -STEADY_M else STANDING


class Standing:
    """No guidance: something that is always worth doing, such as listening or sending signals."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return DUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return None


class Planning(Standing):
    """Organising and planning: due while the social layer has something to plan."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return DUE if picture.planning_due else IDLE


class Supervision(Standing):
    """Gathering information as a leader: content while news of the mission keeps coming in."""

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        fresh = picture.now_s - picture.last_news_s <= self._patience_s
        return ADVANCING if fresh else DUE


class Working(Standing):
    """Productive work: gets on while it yields something new every now and then."""

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if not performed or picture.last_yield_s == -math.inf:  # on the way to where there is work
            return DUE
        return ADVANCING if picture.now_s - picture.last_yield_s <= self._patience_s else STANDING


class ZigzagExploring:
    """Along the rows of a grid: at transit speed to the first point, then at survey speed.

    Until it has begun, it is the less of a stimulus the farther away the first point is.
    """

    def __init__(self, waypoints: Sequence[Point], data: VehicleData) -> None:
        self._waypoints = list(waypoints)
        self._data = data
        self._next = 0
        self._approach = _Approach()

    def _reached_end(self, motion: Motion) -> bool:
        """Pass the waypoints that are reached; True behind the last one."""
        while self._next < len(self._waypoints) and distance_m(motion, self._waypoints[self._next]) <= CAPTURE_M:
            self._next += 1
            self._approach = _Approach()
        return self._next == len(self._waypoints)

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if self._reached_end(motion):
            return DONE
        to_go_m = distance_m(motion, self._waypoints[self._next])
        perceived = self._approach.judge(to_go_m, performed)
        if self._next == 0 and not performed:
            return Perception(1.0 / (1.0 + to_go_m / FAR_M))
        return ADVANCING if perceived is RETREATING else perceived  # turning at the end of a row is progress

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        if self._reached_end(motion):
            return None
        speed_mps = self._data.mapping_speed_mps if self._next else self._data.transit_speed_mps
        return Reference(self._waypoints[self._next], speed_mps)


class Homing:
    """To a rally point, and waiting there until the group is together."""

    def __init__(self, point: Point, radius_m: float, group: str, data: VehicleData) -> None:
        self._point = point
        self._radius_m = radius_m
        self._group = group
        self._data = data
        self._approach = _Approach()

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if self._group in picture.gathered:
            return IDLE
        return self._approach.judge(distance_m(motion, self._point), performed)

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        arrived = distance_m(motion, self._point) <= self._radius_m
        return Reference(self._point, 0.0 if arrived else self._data.transit_speed_mps)


class FollowingLeader:
    """Towards the leader where it was last heard, keeping a distance."""

    def __init__(self, leaders: Sequence[str], distance_m: float, data: VehicleData) -> None:
        self._leaders = leaders
        self._distance_m = distance_m
        self._data = data
        self._approach = _Approach()

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        leader = self._leader(picture)
        if leader is None or (to_go_m := distance_m(motion, leader)) <= self._distance_m:
            return IDLE
        perceived = self._approach.judge(to_go_m, performed)
        return STANDING if perceived is RETREATING else perceived  # a leader that leads on is no setback

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        leader = self._leader(picture)
        return None if leader is None else Reference(leader, self._data.transit_speed_mps)

    def _leader(self, picture: Picture) -> Point | None:
        return next((picture.positions[name] for name in self._leaders if name in picture.positions), None)


class LeadingFollowers:
    """Waits for followers that fall behind while the group moves together."""

    def __init__(self, followers: Sequence[str], group: str, distance_m: float) -> None:
        self._followers = followers
        self._group = group
        self._distance_m = distance_m

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        if self._group not in picture.gathered:
            return IDLE
        behind = any(
            distance_m(motion, picture.positions[name]) > self._distance_m
            for name in self._followers
            if name in picture.positions
        )
        return DUE if behind else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference(motion.position_m, 0.0)


class Positioning:
    """Takes its place in the formation, relative to the leader's position and course, once together."""

    def __init__(self, leaders: Sequence[str], group: str, offset_m: Point, data: VehicleData) -> None:
        self._leaders = leaders
        self._group = group
        self._offset_m = offset_m  # ahead of the leader, to its left
        self._data = data
        self._approach = _Approach()

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        place = self._place(picture)
        if place is None:
            return IDLE
        perceived = self._approach.judge(distance_m(motion, place), performed)
        return STANDING if perceived is RETREATING else perceived

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        place = self._place(picture)
        if place is None:
            return None
        in_place = distance_m(motion, place) <= CAPTURE_M
        return Reference(place, 0.0 if in_place else self._data.transit_speed_mps)

    def _place(self, picture: Picture) -> Point | None:
        if self._group not in picture.gathered:
            return None
        leader = next((name for name in self._leaders if name in picture.headings), None)
        if leader is None:
            return None
        x_m, y_m = picture.positions[leader]
        heading = picture.headings[leader]
        ahead_m, left_m = self._offset_m
        return (
            x_m + ahead_m * math.cos(heading) - left_m * math.sin(heading),
            y_m + ahead_m * math.sin(heading) + left_m * math.cos(heading),
        )


class Evading:
    """Vital: turns away from a vehicle on collision course."""

    def __init__(self, data: VehicleData) -> None:
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return IDLE if picture.collision is None else Perception(picture.collision[1])

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        if picture.collision is None:
            return None
        away = picture.collision[0] + math.pi / 2.0  # both turn to their left, so they pass
        target = motion.x_m + 50.0 * math.cos(away), motion.y_m + 50.0 * math.sin(away)
        return Reference(target, self._data.survey_speed_mps)


class ReturningHome:
    """Vital: goes home while the battery still lasts for the way, and stays there."""

    def __init__(self, data: VehicleData) -> None:
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return DUE if performed or picture.battery <= picture.reserve else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        arrived = distance_m(motion, self._data.start_m) <= CAPTURE_M
        return Reference(self._data.start_m, 0.0 if arrived else self._data.survey_speed_mps)


class ReturningToArea:
    """Vital: goes back into the area of operations."""

    def __init__(self, centre_m: Point, data: VehicleData) -> None:
        self._centre_m = centre_m
        self._data = data

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return DUE if picture.outside_m > 0.0 else IDLE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference(self._centre_m, self._data.transit_speed_mps)
