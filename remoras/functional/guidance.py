"""Guidance: activities to velocities, with detours around vehicles that stand.

Keeping clear (``remoras.avoidance``) looks a few seconds ahead, so a vehicle that heads between two others which stand
too close together stops before them, and nobody of them has a reason to move. Once it has stood so for ``STUCK_S`` it
goes to the right of its course for a few separations; if nothing comes of that, the next time to the left; then back
and to the right from there. Where somebody near signals how content it is, a vehicle makes no detour: the more content
gives way, see ``remoras.attraction``.

What the decision guides the vehicle to gives a velocity. Signals of those who are near attract and repel, see
``remoras.attraction``: so far it is what the vehicle prefers. Keeping clear of neighbours has the last word, see
``remoras.avoidance``; where that leaves a vehicle standing, it goes round them, see ``remoras.functional.guidance``.
Where nobody is near, guidance is carried out as it is. Velocities are through the water.

Headway: whether a vehicle comes nearer to where it is guided, whatever else moves it.

A current may be faster than what a fault has left of a vehicle's speed. The vehicle notices: for ``NO_WAY_S`` it was
not nearer to its target than before. Then it gives up its job, and if it makes none on the way to a meeting or home,
it withdraws from the mission. Whoever holds a place, or is near another one, waits for no headway.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from exchange.arithmetic import distance, length
from remoras.attraction import (
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
from remoras.avoidance import Bounds, HalfPlane, Neighbour, Velocity, clear_velocity, walls_of, within_walls
from remoras.behaviours import Reference
from remoras.database import VehicleData
from remoras.motion import Motion, advance, follow
from remoras.picture import Peers
from remoras.work import Point

STUCK_S, FUTILE_S = 20.0, 3.0
"""For so long a vehicle stands before others until it goes round them, or on its way round until it leaves that."""
STANDS_MPS, WANTS_MPS = 0.1, 0.3
"""It stands if others leave it less than the former of a speed of more than the latter."""
SEPARATIONS = 4.0
"""So many separations it goes aside; where the target is nearer than that, it waits: somebody stands there."""
BACK = (-0.5, 0.0)
TURNS: tuple[Velocity, ...] = ((0.0, -0.5), (0.0, 0.5), BACK)
"""Where it goes, as (ahead, to the left) of its course: right, left, back; at half its speed, to turn short."""


class Detour:
    """The way of one vehicle round others.

    Args:
        separation_m: distance that vehicles keep.
    """

    def __init__(self, separation_m: float) -> None:
        self._aside_m = SEPARATIONS * separation_m
        self._left_m = 0.0
        self._stood_s = 0.0
        self._n_ended = 0

    @property
    def is_on(self) -> bool:
        """True while the vehicle goes round others."""
        return self._left_m > 0.0

    def turned(self, goal: Velocity) -> Velocity:
        """The velocity (m/s) of a goal, turned aside during a detour; else the same object."""
        if not self.is_on:
            return goal
        ahead, left = TURNS[self._n_ended % len(TURNS)]
        return goal[0] * ahead - goal[1] * left, goal[1] * ahead + goal[0] * left

    def note(self, goal: Velocity, velocity: Velocity, to_go_m: float, dt_s: float) -> None:
        """Note what others leave of a goal's velocity (m/s) for ``dt_s``, with so far to go to the target."""
        speed_mps = length(*velocity)
        stands = speed_mps < STANDS_MPS and length(*goal) > WANTS_MPS and to_go_m > self._aside_m
        self._stood_s = self._stood_s + dt_s if stands else 0.0
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
    """A passage through a reef."""

    def way_m(self, from_m: Point, to_m: Point) -> Sequence[Point]:
        """Places by which a vehicle comes from one place to another, the last of them the other one."""
        ...

    def walls(self, at_m: Point) -> Sequence[HalfPlane]:
        """Velocities (m/s) that do not take a vehicle at a place into the reef."""
        ...


class Guidance:
    """Moves one vehicle.

    Args:
        motion: of the vehicle; is changed in every tick.
        data: its limits.
        bounds_m: of the area of operations.
        constants: distance that it keeps from others in its depth layer, and weights of signals.

    Attributes:
        motion, data, bounds_m, constants: the same, for what takes its place.
        go: moves towards a target, as ``remoras.motion.advance`` does; a body that is not simulated takes its place.
        error_m: where the vehicle takes itself to be, from where it is; guidance goes by the former.
        passage: through a reef that no vehicle crosses elsewhere; None without one.
        flow_mps: velocity of the water, (x east, y north).
        withdraws: True while the vehicle gives way to a call that is stronger than its own.
        queues: True while who is ahead of it, and in its way, goes the same way.
        yields_to: strength of the call to which it gives way, 0..1; 0 if to none.
        hindered_s: above zero for ``HINDERED_S`` from when who is ahead of it, and in its way, did not go the same way.
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
        self.go: Callable[[Motion, VehicleData, Point, float, float], None] = advance
        self._detour = Detour(constants.separation_m)
        self.error_m: Point = (0.0, 0.0)
        self.passage: Passage | None = None
        self.flow_mps: Velocity = (0.0, 0.0)
        self._pulls = NO_PULLS
        self._courses = Courses()
        self.withdraws = self.queues = False
        self.yields_to = self.hindered_s = 0.0
        self._yielded: str | None = None  # to whom, in the last tick
        self._greatest_speed_mps = max(data.transit_speed_mps, data.survey_speed_mps)
        self._speed_factor = 1.0

    @property
    def most_mps(self) -> float:
        """The speed that the vehicle can go at now (m/s)."""
        return self._speed_factor * self._greatest_speed_mps

    @property
    def ground_mps(self) -> float:
        """Speed over ground (m/s)."""
        return self.motion.speed_mps

    def slow_down(self, factor: float) -> None:
        """Let the vehicle go at this share of every speed from now on."""
        self._speed_factor = factor

    def heed(self, pulls: Pulls, peers: Peers) -> None:
        """Let signals pull like this until the next decision; peers are where they were heard last."""
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
    ) -> None:
        """Move for ``dt_s`` as far as neighbours allow; without a reference, slow down to a stop.

        Args:
            reference: of the activity that guides.
            neighbours: what the obstacle sonar sees.
            positions_m: where others were heard last, by name.
            since_s: true time at which the motion begins; dt_s: for how long.
        """
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
        if neighbours:
            goal = _velocity(motion, target_m, speed_mps, dt_s)
            velocity = self._clear_of(neighbours, goal, positions_m)
            if not self._pulls.equals:
                to_go_m = length(target_m[0] - motion.x_m, target_m[1] - motion.y_m)
                self._detour.note(goal, velocity, to_go_m, dt_s)
            if velocity is not goal:
                follow(motion, self.data, velocity, dt_s)
                return
        self.go(motion, self.data, target_m, speed_mps, dt_s)

    def _aim(self, target_m: Point, speed_mps: float, dt_s: float) -> tuple[Point, float]:
        """Where to head for through the water, and how fast, to come to a target; 0 to slow down to a stop."""
        return target_m, speed_mps

    def _clear_of(self, neighbours: Sequence[Neighbour], goal: Velocity, positions_m: Mapping[str, Point]) -> Velocity:
        """The velocity (m/s) that signals and neighbours leave of a goal's; ``goal`` itself if they change nothing."""
        weights, pulls = self.constants, self._pulls
        position_m = self.motion.x_m + self.error_m[0], self.motion.y_m + self.error_m[1]
        most_mps = self._speed_factor * self._greatest_speed_mps
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
        """The velocity (m/s) by which the vehicle gives way to who is ahead; the preferred one if it does not."""
        motion, weights = self.motion, self.constants
        nearest = ahead(goal, motion.position_m, neighbours, LANES * weights.separation_m)
        if nearest is None:
            return preferred
        at_m = motion.x_m + nearest.dx_m, motion.y_m + nearest.dy_m
        off_m = self.error_m
        other = vehicle_at((at_m[0] + off_m[0], at_m[1] + off_m[1]), positions_m)
        if other is None:
            return preferred
        is_against = self._courses.is_against(other, goal)
        strength = yields(self._pulls, self.data.name, other, is_against, other == self._yielded)
        is_in_way = is_against or other in self._pulls.passed  # who goes back is in the way until it is out of it
        self.queues = strength == 0.0 and not is_in_way
        if is_in_way:
            self.hindered_s = HINDERED_S
        if strength == 0.0:
            return preferred
        self.withdraws, self.yields_to, self._yielded = True, strength, other
        return repelled(motion.position_m, at_m, min(1.0, weights.repulsion) * self.most_mps)

    def walls(self, position_m: Point) -> Sequence[HalfPlane]:
        """The velocities (m/s) that keep a vehicle at a place within its bounds."""
        walls: list[HalfPlane] = walls_of(self.bounds_m, *position_m)
        return walls if self.passage is None else [*walls, *self.passage.walls(position_m)]

    def _clear(
        self, preferred: Velocity, neighbours: Sequence[Neighbour], walls: Sequence[HalfPlane]
    ) -> Velocity | None:
        """The velocity that keeps clear of neighbours (m/s); None if nobody is in the way."""
        return clear_velocity(
            preferred,
            self.motion.velocity_mps,
            neighbours,
            self.constants.separation_m * (PRESSED if self._pulls.is_among_equals else 1.0),
            self.data.turn_rate_radps,
            self._speed_factor * self._greatest_speed_mps,
            walls,
        )


def _velocity(motion: Motion, target_m: Point, speed_mps: float, dt_s: float) -> Velocity:
    """Velocity (m/s) towards a target, not beyond it within ``dt_s``."""
    dx_m, dy_m = target_m[0] - motion.x_m, target_m[1] - motion.y_m
    range_m = length(dx_m, dy_m)
    share = min(speed_mps, range_m / dt_s) / range_m if range_m > 0.0 else 0.0
    return share * dx_m, share * dy_m


NO_WAY_S = 300.0
"""A vehicle that came no nearer for so long makes no headway."""
NEARER_M, AT_M = 1.0, 5.0
"""It has come nearer by this, or is at its target within that."""


class Headway:
    """How one vehicle gets on.

    Attributes:
        is_lost: it makes none, since what guided it some time ago.
    """

    def __init__(self) -> None:
        self.is_lost = False
        self._target_m: Point | None = None
        self._nearest_m, self._since_s = math.inf, 0.0

    def is_missing(self, reference: Reference | None, motion: Motion, now_s: float) -> bool:
        """True if the vehicle makes no headway to where it was guided last.

        Args:
            reference: by which it was guided; None while another one is near, or nothing guides it.
            motion: where it takes itself to be; now_s: the time.
        """
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
