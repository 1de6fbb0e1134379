"""Guidance: how a vehicle moves in a tick, by what guides it and by who is near.

What the decision guides the vehicle to gives a velocity. Signals of those who are near attract and repel, see
``remoras.attraction``: so far it is what the vehicle prefers. Keeping clear of neighbours has the last word, see
``remoras.avoidance``; where that leaves a vehicle standing, it goes round them, see ``remoras.functional.detour``.
Where nobody is near, guidance is carried out as it is. Velocities are through the water.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from exchange.arithmetic import length
from remoras.attraction import NO_PULLS, GuidanceConstants, Pulls, attracted_velocity, repelled, stronger
from remoras.avoidance import Bounds, HalfPlane, Neighbour, Velocity, clear_velocity, walls_of, within_walls
from remoras.behaviours import Reference
from remoras.database import VehicleData
from remoras.functional.detour import Detour
from remoras.motion import Motion, advance, follow
from remoras.work import Point


class Guidance:
    """Moves one vehicle.

    Args:
        motion: of the vehicle; is changed in every tick.
        data: its limits.
        bounds_m: of the area of operations.
        constants: distance that it keeps from others in its depth layer, and weights of signals.

    Attributes:
        motion, data, bounds_m, constants: the same, for what takes its place.
        error_m: where the vehicle takes itself to be, from where it is; guidance goes by the former.
        aimed: each gives where to go and how fast, 0 to slow down to a stop, of that by the others before it and of the
            length of the tick (s); called by ``move``.
        withdraws: True while the vehicle gives way to a call that is stronger than its own.
    """

    def __init__(
        self,
        motion: Motion,
        data: VehicleData,
        bounds_m: Bounds,
        constants: GuidanceConstants,
    ) -> None:
        self.motion = motion
        self.data = data
        self.bounds_m = bounds_m
        self.constants = constants
        self._detour = Detour(constants.separation_m)
        self.error_m: Point = (0.0, 0.0)
        self.aimed: list[Callable[[Point, float, float], tuple[Point, float]]] = []
        self._pulls = NO_PULLS
        self.withdraws = False
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

    def heed(self, pulls: Pulls) -> None:
        """Let signals pull like this until the next decision."""
        self._pulls = pulls

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
        self.withdraws = False
        if reference is None:
            target_m, speed_mps = self.motion.position_m, 0.0
        else:
            (x_m, y_m), speed_mps, *_ = reference
            off_x_m, off_y_m = self.error_m
            target_m, most_mps = (x_m - off_x_m, y_m - off_y_m), self._greatest_speed_mps
            speed_mps = self._speed_factor * (speed_mps if speed_mps <= most_mps else most_mps)
        for change in self.aimed:
            target_m, speed_mps = change(target_m, speed_mps, dt_s)
        motion = self.motion
        if neighbours:
            goal = _velocity(motion, target_m, speed_mps, dt_s)
            velocity = self._clear_of(neighbours, goal, positions_m)
            if not self._pulls.equals:
                to_go_m = length(target_m[0] - motion.x_m, target_m[1] - motion.y_m)
                self._detour.note(goal, velocity, to_go_m, dt_s)
            if velocity is not goal:
                follow(motion, self.data, velocity, dt_s)
                return
        advance(motion, self.data, target_m, speed_mps, dt_s)

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
        if clear is not None and pulls.equals and weights.repulsion > 0.0:
            by = stronger(pulls, self.data.name)
            pushed = repelled(preferred, position_m, by, positions_m, weights.repulsion * most_mps)
            if pushed != preferred:
                self.withdraws = True
                preferred = within_walls(walls, pushed, most_mps)
                clear = self._clear(preferred, neighbours, walls)
        return preferred if clear is None else clear

    def walls(self, position_m: Point) -> Sequence[HalfPlane]:
        """The velocities (m/s) that keep a vehicle at a place within its bounds."""
        return walls_of(self.bounds_m, *position_m)

    def _clear(
        self, preferred: Velocity, neighbours: Sequence[Neighbour], walls: Sequence[HalfPlane]
    ) -> Velocity | None:
        """The velocity that keeps clear of neighbours (m/s); None if nobody is in the way."""
        return clear_velocity(
            preferred,
            self.motion.velocity_mps,
            neighbours,
            self.constants.separation_m,
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
