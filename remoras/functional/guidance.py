"""Guidance: how a vehicle moves in a tick, by what guides it and by who is near.

What the decision guides the vehicle to gives a velocity. Keeping clear of neighbours has the last word on it, see
``remoras.avoidance``; where nobody is in the way, it is carried out as it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from remoras.avoidance import Neighbour, Velocity, clear_velocity
from remoras.behaviours import Reference
from remoras.database import VehicleData
from remoras.motion import Motion, advance, follow
from remoras.work import Point


class Guidance:
    """Moves one vehicle.

    Args:
        motion: of the vehicle; is changed in every tick.
        data: its limits.
        separation_m: distance that it keeps from others in its depth layer.
    """

    def __init__(self, motion: Motion, data: VehicleData, separation_m: float) -> None:
        self._motion = motion
        self._data = data
        self._separation_m = separation_m
        self._greatest_speed_mps = max(data.transit_speed_mps, data.survey_speed_mps)
        self._speed_factor = 1.0

    def slow_down(self, factor: float) -> None:
        """Let the vehicle go at this share of every speed from now on."""
        self._speed_factor = factor

    def move(self, reference: Reference | None, neighbours: Sequence[Neighbour], dt_s: float) -> None:
        """Move for ``dt_s`` as far as neighbours allow; without a reference, slow down to a stop.

        Args:
            reference: of the activity that guides.
            neighbours: what the obstacle sonar sees.
            dt_s: for how long.
        """
        motion = self._motion
        if reference is None:
            target_m, speed_mps = motion.position_m, 0.0
        else:
            target_m = reference[0]
            speed_mps = self._speed_factor * min(reference[1], self._greatest_speed_mps)
        if neighbours:
            clear = clear_velocity(
                _velocity(motion, target_m, speed_mps, dt_s),
                motion.velocity_mps,
                neighbours,
                self._separation_m,
                self._data.turn_rate_radps,
                self._speed_factor * self._greatest_speed_mps,
            )
            if clear is not None:
                follow(motion, self._data, clear, dt_s)
                return
        advance(motion, self._data, target_m, speed_mps, dt_s)


def _velocity(motion: Motion, target_m: Point, speed_mps: float, dt_s: float) -> Velocity:
    """Velocity (m/s) towards a target, not beyond it within ``dt_s``."""
    dx_m, dy_m = target_m[0] - motion.x_m, target_m[1] - motion.y_m
    range_m = math.hypot(dx_m, dy_m)
    share = min(speed_mps, range_m / dt_s) / range_m if range_m > 0.0 else 0.0
    return share * dx_m, share * dy_m
