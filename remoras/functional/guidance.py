"""Guidance: how a vehicle moves in a tick, by what guides it and by who is near.

What the decision guides the vehicle to gives a velocity. Signals of those who are near attract and repel, see
``remoras.attraction``: so far it is what the vehicle prefers. Keeping clear of neighbours has the last word, see
``remoras.avoidance``; where that leaves a vehicle standing, it goes round them, see ``remoras.functional.detour``.
Where nobody is near, guidance is carried out as it is. Velocities are through the water, which may move itself, see
``remoras.current``: who is to stay heads into the current.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from exchange.arithmetic import length
from remoras.attraction import NO_PULLS, GuidanceConstants, Pulls, attracted_velocity, repelled, stronger
from remoras.avoidance import Bounds, HalfPlane, Neighbour, Velocity, clear_velocity, walls_of, within_walls
from remoras.behaviours import Reference
from remoras.current import Current, through_water
from remoras.database import VehicleData
from remoras.functional.detour import Detour
from remoras.motion import Motion, advance, follow
from remoras.work import Point

STILL = (0.0, 0.0)
"""Velocity of water that stands."""


class Guidance:
    """Moves one vehicle.

    Args:
        motion: of the vehicle; is changed in every tick.
        data: its limits.
        bounds_m: of the area of operations.
        constants: distance that it keeps from others in its depth layer, and weights of signals.
        current: of the water; None where it stands.

    Attributes:
        error_m: where the vehicle takes itself to be, from where it is; guidance goes by the former.
        depth_m: at which it is.
        withdraws: True while the vehicle gives way to a call that is stronger than its own.
    """

    def __init__(
        self,
        motion: Motion,
        data: VehicleData,
        bounds_m: Bounds,
        constants: GuidanceConstants,
        current: Current | None = None,
    ) -> None:
        self._motion = motion
        self._data = data
        self._bounds_m = bounds_m
        self._constants = constants
        self._current = current
        self._detour = Detour(constants.separation_m)
        self._flow_mps = STILL
        self.error_m: Point = (0.0, 0.0)
        self.depth_m = data.depth_m
        self._pulls = NO_PULLS
        self.withdraws = False
        self._greatest_speed_mps = max(data.transit_speed_mps, data.survey_speed_mps)
        self._speed_factor = 1.0

    @property
    def flow_mps(self) -> Velocity:
        """Velocity of the water in the last motion tick: (x east, y north)."""
        return self._flow_mps

    def slow_down(self, factor: float) -> None:
        """Let the vehicle go at this share of every speed from now on."""
        self._speed_factor = factor

    def heed(self, pulls: Pulls) -> None:
        """Let signals pull like this until the next decision."""
        self._pulls = pulls

    def move(
        self,
        reference: Reference | None,
        neighbours: Sequence[Neighbour],
        positions_m: Mapping[str, Point],
        now_s: float,
        dt_s: float,
    ) -> None:
        """Move for ``dt_s`` as far as neighbours allow; without a reference, slow down to a stop.

        Args:
            reference: of the activity that guides.
            neighbours: what the obstacle sonar sees.
            positions_m: where others were heard last, by name.
            now_s: time at which the motion begins; dt_s: for how long.
        """
        motion = self._motion
        self.withdraws = False
        if reference is None:
            target_m, speed_mps = motion.position_m, 0.0
        else:
            target_m = reference[0][0] - self.error_m[0], reference[0][1] - self.error_m[1]
            speed_mps = self._speed_factor * min(reference[1], self._greatest_speed_mps)
        if self._current is not None:
            self._flow_mps = self._current.at(self.depth_m, now_s)
            target_m, speed_mps = self._upstream(target_m, speed_mps, dt_s)
        self._carry_out(target_m, speed_mps, neighbours, positions_m, dt_s)
        if self._current is not None:
            motion.x_m += self._flow_mps[0] * dt_s
            motion.y_m += self._flow_mps[1] * dt_s

    def _upstream(self, target_m: Point, speed_mps: float, dt_s: float) -> tuple[Point, float]:
        """Where to head for in moving water to come straight to a target, and how fast; without a speed, to stay."""
        motion, flow = self._motion, self._flow_mps
        if speed_mps <= 0.0:
            most_mps = self._speed_factor * self._greatest_speed_mps
            return (motion.x_m - flow[0] * dt_s, motion.y_m - flow[1] * dt_s), min(length(*flow), most_mps)
        dx_m, dy_m = target_m[0] - motion.x_m, target_m[1] - motion.y_m
        range_m = length(dx_m, dy_m)
        course = (dx_m / range_m, dy_m / range_m) if range_m > 0.0 else STILL
        water = through_water(course, speed_mps, flow)
        ground_mps = length(water[0] + flow[0], water[1] + flow[1])
        if ground_mps * dt_s >= range_m:  # there within the tick
            return (target_m[0] - flow[0] * dt_s, target_m[1] - flow[1] * dt_s), speed_mps
        time_s = range_m / ground_mps if ground_mps > 0.0 else dt_s
        return (motion.x_m + water[0] * time_s, motion.y_m + water[1] * time_s), speed_mps

    def _carry_out(
        self,
        target_m: Point,
        speed_mps: float,
        neighbours: Sequence[Neighbour],
        positions_m: Mapping[str, Point],
        dt_s: float,
    ) -> None:
        """Move through the water towards a target, clear of neighbours."""
        motion = self._motion
        if neighbours:
            goal = _velocity(motion, target_m, speed_mps, dt_s)
            velocity = self._clear_of(neighbours, goal, positions_m)
            if not self._pulls.equals:
                to_go_m = length(target_m[0] - motion.x_m, target_m[1] - motion.y_m)
                self._detour.note(goal, velocity, to_go_m, dt_s)
            if velocity is not goal:
                follow(motion, self._data, velocity, dt_s)
                return
        advance(motion, self._data, target_m, speed_mps, dt_s)

    def _clear_of(self, neighbours: Sequence[Neighbour], goal: Velocity, positions_m: Mapping[str, Point]) -> Velocity:
        """The velocity (m/s) that signals and neighbours leave of a goal's; ``goal`` itself if they change nothing."""
        weights, pulls = self._constants, self._pulls
        position_m = self._motion.x_m + self.error_m[0], self._motion.y_m + self.error_m[1]
        most_mps = self._speed_factor * self._greatest_speed_mps
        walls = walls_of(self._bounds_m, *position_m)
        if self._current is not None:
            walls = [one._replace(x=one.x - self._flow_mps[0], y=one.y - self._flow_mps[1]) for one in walls]
        preferred = goal
        if self._detour.is_on and not pulls.equals:
            preferred = within_walls(walls, self._detour.turned(goal), most_mps)
        if pulls.answered and weights.attraction > 0.0:
            preferred = within_walls(
                walls, attracted_velocity(goal, position_m, pulls, positions_m, weights.attraction), most_mps
            )
        clear = self._clear(preferred, neighbours, walls)
        if clear is not None and pulls.equals and weights.repulsion > 0.0:
            by = stronger(pulls, self._data.name)
            pushed = repelled(preferred, position_m, by, positions_m, weights.repulsion * most_mps)
            if pushed != preferred:
                self.withdraws = True
                preferred = within_walls(walls, pushed, most_mps)
                clear = self._clear(preferred, neighbours, walls)
        return preferred if clear is None else clear

    def _clear(
        self, preferred: Velocity, neighbours: Sequence[Neighbour], walls: Sequence[HalfPlane]
    ) -> Velocity | None:
        """The velocity that keeps clear of neighbours (m/s); None if nobody is in the way."""
        return clear_velocity(
            preferred,
            self._motion.velocity_mps,
            neighbours,
            self._constants.separation_m,
            self._data.turn_rate_radps,
            self._speed_factor * self._greatest_speed_mps,
            walls,
        )


def _velocity(motion: Motion, target_m: Point, speed_mps: float, dt_s: float) -> Velocity:
    """Velocity (m/s) towards a target, not beyond it within ``dt_s``."""
    dx_m, dy_m = target_m[0] - motion.x_m, target_m[1] - motion.y_m
    range_m = length(dx_m, dy_m)
    share = min(speed_mps, range_m / dt_s) / range_m if range_m > 0.0 else 0.0
    return share * dx_m, share * dy_m
