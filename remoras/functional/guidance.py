"""Guidance: velocities for activities, with detours around stationary vehicles.

The reference of the guiding activity gives a velocity through the water. Signals of nearby vehicles attract and repel
(``remoras.motion.attraction``); avoidance has the last word (``remoras.motion.avoidance``). It looks a few seconds
ahead, so a vehicle stops before a gap between two others that is too narrow, and makes a ``Detour``.

Headway: a current may exceed the speed that a fault has left. A vehicle that comes no nearer to its target for
`NO_WAY_S` leaves its job; on the way to a rally point or home, it withdraws from the mission. Holding a place or being
near another vehicle does not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from exchange.arithmetic import distance, length
from remoras.behaviours import Reference
from remoras.database import VehicleData
from remoras.motion import Leg, Motion, advance, follow
from remoras.motion.attraction import (
    HINDERED_S,
    LANES,
    NO_PULLS,
    PRESSED,
    Courses,
    GuidanceTable,
    Pulls,
    ahead,
    attracted_velocity,
    repelled,
    vehicle_at,
    yields,
)
from remoras.motion.avoidance import Bounds, HalfPlane, Neighbour, Velocity, clear_velocity, walls_of, within_walls
from remoras.picture import Peers
from remoras.work import Point

STUCK_S, FUTILE_S = 20.0, 3.0
"""Standing time (s) before a detour starts, and on a detour before it is abandoned."""
STANDS_MPS, WANTS_MPS = 0.1, 0.3
"""Stationary: velocity below the former (m/s) while a speed above the latter is wanted."""
SEPARATIONS = 4.0
"""Length of a detour in separations; nearer to the target, the vehicle waits instead."""
BACK = (-0.5, 0.0)
TURNS: tuple[Velocity, ...] = ((0.0, -0.5), (0.0, 0.5), BACK)
"""Directions of a detour, as (ahead, left) of the course: right, left, back; at half speed."""


class Detour:
    """Detour of one vehicle around others, which keep ``separation_m``."""

    def __init__(self, separation_m: float) -> None:
        self._aside_m = SEPARATIONS * separation_m
        self._left_m = 0.0
        self._stood_s = 0.0
        self._n_ended = 0

    @property
    def is_on(self) -> bool:
        """True during a detour."""
        return self._left_m > 0.0

    def turned(self, goal: Velocity) -> Velocity:
        """Return a velocity (m/s) turned aside during a detour; else the same object."""
        if not self.is_on:
            return goal
        ahead, left = TURNS[self._n_ended % len(TURNS)]
        return goal[0] * ahead - goal[1] * left, goal[1] * ahead + goal[0] * left

    def note(self, stands: bool, speed_mps: float, to_go_m: float, dt_s: float) -> None:
        """Update with whether others leave no room, the speed (m/s) and the distance to the target (m)."""
        self._stood_s = self._stood_s + dt_s if stands and to_go_m > self._aside_m else 0.0
        if self.is_on:
            is_futile = self._stood_s >= FUTILE_S
            self._left_m = 0.0 if is_futile else self._left_m - speed_mps * dt_s
            if not self.is_on:
                is_back = TURNS[self._n_ended % len(TURNS)] == BACK and not is_futile
                self._stood_s, self._left_m = 0.0, self._aside_m if is_back else 0.0
                self._n_ended += 1
        elif self._stood_s >= STUCK_S:
            self._stood_s, self._left_m = 0.0, self._aside_m


class Passage(Protocol):
    """Passage through a reef."""

    def way_m(self, from_m: Point, to_m: Point) -> Sequence[Point]:
        """Return waypoints from one place to another, the latter included."""

    def walls(self, at_m: Point) -> Sequence[HalfPlane]:
        """Return velocity constraints (m/s) that keep a vehicle out of the reef."""


class Guidance:
    """Motion of one vehicle, whose ``motion`` is changed in every tick.

    ``go`` moves towards a target and returns a leg, as ``remoras.motion.advance``; a real body replaces it. ``error_m``
    is the believed minus the true position; guidance uses the believed one. ``passage``: through a reef that cannot be
    crossed elsewhere, or None. ``flow_mps``: velocity of the water (x east, y north). ``most_mps``: greatest speed that
    the vehicle can reach now. ``withdraws``, ``yields_to``: whether it yields to a call stronger than its own, and its
    strength, 0..1. ``queues``: the vehicle ahead, in its way, goes the same way. ``hindered_s``: remaining time (s) for
    which it counts as obstructed by an oncoming vehicle. ``stopped_s``: time (s) for which others have left it no room.
    """

    def __init__(
        self,
        motion: Motion,
        data: VehicleData,
        bounds_m: Bounds,
        constants: GuidanceTable,
    ) -> None:
        self.motion = motion
        self.data = data
        self.bounds_m = bounds_m
        self.constants = constants
        self.go: Callable[[Motion, VehicleData, Point, float, float], Leg | None] = advance
        self._detour = Detour(constants.separation_m)
        self.error_m: Point = (0.0, 0.0)
        self.passage: Passage | None = None
        self.flow_mps: Velocity = (0.0, 0.0)
        self._pulls = NO_PULLS
        self._courses = Courses()
        self.withdraws = self.queues = False
        self.yields_to = self.hindered_s = self.stopped_s = 0.0
        self._yielded: str | None = None  # vehicle it yielded to in the last tick
        self._greatest_speed_mps = max(data.transit_speed_mps, data.survey_speed_mps)
        self.slow_down(1.0)

    @property
    def ground_mps(self) -> float:
        """Speed over ground (m/s)."""
        return self.motion.speed_mps

    def slow_down(self, factor: float) -> None:
        """Reduce every speed to this share, 0..1."""
        self._speed_factor, self.most_mps = factor, factor * self._greatest_speed_mps

    def heed(self, pulls: Pulls, peers: Peers) -> None:
        """Set attraction and repulsion inputs until the next decision."""
        self._pulls = pulls
        if pulls.is_among_equals:
            self._courses.note(peers)

    def move(
        self,
        reference: Reference | None,
        neighbours: Sequence[Neighbour],
        positions_m: Mapping[str, Point],
        since_s: float,
        dt_s: float,
    ) -> Leg | None:
        """Move for ``dt_s`` as neighbours allow; return the motion if steady afterwards, else None."""
        self.withdraws = self.queues = False
        self.yields_to = 0.0
        if reference is None:
            target_m, speed_mps = self.motion.position_m, 0.0
        else:
            (x_m, y_m), speed_mps, *_ = reference
            off_x_m, off_y_m = self.error_m
            target_m, most_mps = (x_m - off_x_m, y_m - off_y_m), self._greatest_speed_mps
            speed_mps = self._speed_factor * (speed_mps if speed_mps <= most_mps else most_mps)
        motion = self.motion
        if self.passage is not None:
            off_x_m, off_y_m = self.error_m
            here_m = motion.x_m + off_x_m, motion.y_m + off_y_m
            x_m, y_m = self.passage.way_m(here_m, (target_m[0] + off_x_m, target_m[1] + off_y_m))[0]
            target_m = x_m - off_x_m, y_m - off_y_m
        target_m, speed_mps = self._aim(target_m, speed_mps, dt_s)
        self.hindered_s -= dt_s
        stopped_s, self.stopped_s = self.stopped_s + dt_s, 0.0
        if neighbours:
            goal = _velocity(motion, target_m, speed_mps, dt_s)
            velocity = self._clear_of(neighbours, goal, positions_m)
            speed_now_mps = length(*velocity)
            if stands := speed_now_mps < STANDS_MPS and length(*goal) > WANTS_MPS:
                self.stopped_s = stopped_s
            # Among equals that exchange signals, the more satisfied one yields instead.
            if not self._pulls.equals:
                to_go_m = length(target_m[0] - motion.x_m, target_m[1] - motion.y_m)
                self._detour.note(stands, speed_now_mps, to_go_m, dt_s)
            # A velocity has no target: an unchanged one is left to ``go``, which stops there.
            if velocity is not goal:
                follow(motion, self.data, velocity, dt_s)
                return None
        leg = self.go(motion, self.data, target_m, speed_mps, dt_s)
        if leg is None or self.hindered_s > 0.0 or self.passage is not None or (neighbours and leg.way_m > 0.0):
            return None
        return leg

    def _aim(self, target_m: Point, speed_mps: float, dt_s: float) -> tuple[Point, float]:
        return target_m, speed_mps

    def _clear_of(self, neighbours: Sequence[Neighbour], goal: Velocity, positions_m: Mapping[str, Point]) -> Velocity:
        """Return the velocity (m/s) after signals and avoidance; ``goal`` itself if unchanged."""
        weights, pulls = self.constants, self._pulls
        position_m = self.motion.x_m + self.error_m[0], self.motion.y_m + self.error_m[1]
        most_mps = self.most_mps
        walls = self.walls(position_m)
        preferred = goal
        if self._detour.is_on and not pulls.equals:
            preferred = within_walls(walls, self._detour.turned(goal), most_mps)
        if pulls.answered and weights.attraction > 0.0:
            preferred = within_walls(
                walls, attracted_velocity(goal, position_m, pulls, positions_m, weights.attraction), most_mps
            )
        clear = self._clear(preferred, neighbours, walls)
        if clear is not None and pulls.is_among_equals and weights.repulsion > 0.0:
            pushed = self._withdrawn(goal, preferred, neighbours, positions_m)
            if pushed is not preferred:
                preferred = within_walls(walls, pushed, most_mps)
                clear = self._clear(preferred, neighbours, walls)
        if not self.withdraws:
            self._yielded = None
        return preferred if clear is None else clear

    def _withdrawn(
        self, goal: Velocity, preferred: Velocity, neighbours: Sequence[Neighbour], positions_m: Mapping[str, Point]
    ) -> Velocity:
        """Return the velocity (m/s) that yields to the vehicle ahead; else the preferred one."""
        motion, weights = self.motion, self.constants
        nearest = ahead(goal, neighbours, LANES * weights.separation_m)
        if nearest is None:
            return preferred
        at_m = motion.x_m + nearest.dx_m, motion.y_m + nearest.dy_m
        off_m = self.error_m
        other = vehicle_at((at_m[0] + off_m[0], at_m[1] + off_m[1]), positions_m)
        if other is None:
            return preferred
        is_against = self._courses.is_against(other, goal)
        strength = yields(self._pulls, self.data.name, other, is_against, other == self._yielded)
        is_in_way = is_against or other in self._pulls.passed  # a withdrawing vehicle obstructs until it is clear
        self.queues = strength == 0.0 and not is_in_way
        if is_in_way:
            self.hindered_s = HINDERED_S
        if strength == 0.0:
            return preferred
        self.withdraws, self.yields_to, self._yielded = True, strength, other
        return repelled(motion.position_m, at_m, min(1.0, weights.repulsion) * self.most_mps)

    def walls(self, position_m: Point) -> Sequence[HalfPlane]:
        """Return velocity constraints (m/s) that keep a vehicle within its bounds."""
        walls: list[HalfPlane] = walls_of(self.bounds_m, *position_m)
        return walls if self.passage is None else [*walls, *self.passage.walls(position_m)]

    def _clear(
        self, preferred: Velocity, neighbours: Sequence[Neighbour], walls: Sequence[HalfPlane]
    ) -> Velocity | None:
        return clear_velocity(
            preferred,
            self.motion.velocity_mps,
            neighbours,
            self.constants.separation_m * (PRESSED if self._pulls.is_among_equals else 1.0),
            self.data.turn_rate_radps,
            self.most_mps,
            walls,
        )


def _velocity(motion: Motion, target_m: Point, speed_mps: float, dt_s: float) -> Velocity:
    dx_m, dy_m = target_m[0] - motion.x_m, target_m[1] - motion.y_m
    range_m = length(dx_m, dy_m)
    share = min(speed_mps, range_m / dt_s) / range_m if range_m > 0.0 else 0.0
    return share * dx_m, share * dy_m


NO_WAY_S = 300.0
"""Time (s) without progress after which a vehicle makes no headway."""
NEARER_M, AT_M = 1.0, 5.0
"""Least progress (m), and distance (m) at which the target counts as reached."""


class Headway:
    """Progress of one vehicle to its target; ``is_lost`` is True from timeout to next progress."""

    def __init__(self) -> None:
        self.is_lost = False
        self._target_m: Point | None = None
        self._nearest_m, self._since_s = math.inf, 0.0

    def is_missing(self, reference: Reference | None, motion: Motion, now_s: float) -> bool:
        """Update with the position; return True each time ``NO_WAY_S`` pass without progress."""
        # Without a reference, as behind an obstructing vehicle, or at speed 0 the interval restarts.
        if reference is None or reference.speed_mps == 0.0:
            self._target_m = None
            return False
        to_go_m = distance(motion.position_m, reference.target_m)
        if reference.target_m != self._target_m:
            self._target_m, self._nearest_m, self._since_s = reference.target_m, to_go_m, now_s
        elif to_go_m < self._nearest_m - NEARER_M or to_go_m <= AT_M:
            self._nearest_m, self._since_s, self.is_lost = to_go_m, now_s, False
        elif now_s - self._since_s > NO_WAY_S:
            self._since_s, self.is_lost = now_s, True
            return True
        return False
