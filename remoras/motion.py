"""Kinematics and energy of one vehicle: scalars in, scalars out.

Heading is mathematical: 0 along x (east), counter-clockwise, radians in (-pi, pi].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from remoras.database import VehicleData


@dataclass(slots=True)
class Motion:
    """State of motion; ``energy_j`` is what has been consumed, ``distance_m`` what has been travelled."""

    x_m: float
    y_m: float
    heading_rad: float = 0.0
    speed_mps: float = 0.0
    energy_j: float = 0.0
    distance_m: float = 0.0

    @property
    def position_m(self) -> tuple[float, float]:
        """Where the vehicle is: (x east, y north)."""
        return self.x_m, self.y_m

    @property
    def velocity_mps(self) -> tuple[float, float]:
        """How it moves: (x east, y north)."""
        return self.speed_mps * math.cos(self.heading_rad), self.speed_mps * math.sin(self.heading_rad)


def wrapped(angle_rad: float) -> float:
    """The same angle in (-pi, pi].

    >>> wrapped(1.5 * math.pi) == -0.5 * math.pi
    True
    """
    if -math.pi < angle_rad <= math.pi:
        return angle_rad
    inside = math.pi - (math.pi - angle_rad) % math.tau
    return inside if inside > -math.pi else math.pi  # a rounding error beyond pi comes out as -pi


def reaching_speed_mps(range_m: float, error_rad: float, turn_rate_radps: float) -> float:
    """Greatest speed (m/s) at which a vehicle can still turn on to its target.

    The circle through the target that touches the heading has radius range / (2 sin error); a vehicle turns on a
    circle of radius speed / turn rate. A target inside the vehicle's own circle would be orbited for ever.

    Args:
        range_m: distance to the target.
        error_rad: angle between the heading and the bearing of the target.
        turn_rate_radps: limit of the control.

    >>> reaching_speed_mps(10.0, math.pi / 2.0, 0.5)
    2.5
    """
    return turn_rate_radps * range_m / (2.0 * math.sin(min(abs(error_rad), math.pi / 2.0)))


def advance(motion: Motion, data: VehicleData, target_m: tuple[float, float], speed_mps: float, dt_s: float) -> None:
    """Move towards a target, within the limits of a vehicle.

    The heading turns by at most ``turn_rate_radps * dt_s``, the speed changes by at most
    ``acceleration_mps2 * dt_s``, and the vehicle does not run past the target within the step.
    Energy: (hotel_w + drag_w_per_mps3 * speed^3) * dt_s.

    Args:
        motion: is changed.
        data: limits and energy of the vehicle.
        target_m: where to go; speed_mps: how fast, 0 to slow down to a stop.
        dt_s: for how long.
    """
    dx_m = target_m[0] - motion.x_m
    dy_m = target_m[1] - motion.y_m
    range_m = math.sqrt(dx_m * dx_m + dy_m * dy_m)
    if range_m > 0.0 and speed_mps > 0.0:
        error = wrapped(math.atan2(dy_m, dx_m) - motion.heading_rad)
        most = data.turn_rate_radps * dt_s
        if error > most or error < -most:
            speed_mps = min(speed_mps, reaching_speed_mps(range_m, error, data.turn_rate_radps))
            error = math.copysign(most, error)
        motion.heading_rad = wrapped(motion.heading_rad + error)
    _move(motion, data, speed_mps, range_m, dt_s)


def follow(motion: Motion, data: VehicleData, velocity_mps: tuple[float, float], dt_s: float) -> None:
    """Move with a velocity, as far as the limits of a vehicle allow.

    The heading turns towards the velocity as in ``advance``; the speed is the part of the velocity along the heading
    that is reached, 0 if that is none. So a vehicle that is to go back turns on the spot.

    Args:
        motion: is changed.
        data: limits and energy of the vehicle.
        velocity_mps: x east, y north.
        dt_s: for how long.
    """
    speed_mps = math.hypot(*velocity_mps)
    if speed_mps > 0.0:
        error = wrapped(math.atan2(velocity_mps[1], velocity_mps[0]) - motion.heading_rad)
        most = data.turn_rate_radps * dt_s
        turn = max(-most, min(most, error))
        motion.heading_rad = wrapped(motion.heading_rad + turn)
        speed_mps = max(0.0, speed_mps * math.cos(error - turn))
    _move(motion, data, speed_mps, math.inf, dt_s)


def _move(motion: Motion, data: VehicleData, speed_mps: float, most_m: float, dt_s: float) -> None:
    """Take on a speed as far as possible and go along the heading, up to a distance unless the vehicle is to stop."""
    most = data.acceleration_mps2 * dt_s
    change = speed_mps - motion.speed_mps
    motion.speed_mps += most if change > most else -most if change < -most else change
    travelled_m = motion.speed_mps * dt_s
    if speed_mps > 0.0 and travelled_m > most_m:
        travelled_m = most_m
    motion.x_m += travelled_m * math.cos(motion.heading_rad)
    motion.y_m += travelled_m * math.sin(motion.heading_rad)
    motion.distance_m += travelled_m
    motion.energy_j += (data.hotel_w + data.drag_w_per_mps3 * motion.speed_mps**3) * dt_s
