"""Kinematics and energy of a vehicle; heading from x (east) counter-clockwise, (-pi, pi]."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

from exchange.arithmetic import PI, TAU, atan2, length, sincos
from remoras.database import VehicleData

__all__: list[str] = []

Vector = tuple[float, float]
NEAREST_M = 1e-100
"""Distance below which there is no bearing, since squares underflow."""
STRAIGHT = 1e-9
"""Sine of a heading error that rounding may cause: below it a vehicle keeps its heading."""


class Motion:
    """Position, heading (as unit vector ``ahead``, x east, y north), speed, energy and distance.

    >>> Motion(3.0, 4.0, heading_rad=0.0, speed_mps=1.5).ahead
    (1.0, 0.0)
    """

    __slots__ = ("_heading_rad", "_told", "ahead", "distance_m", "energy_j", "speed_mps", "x_m", "y_m")
    _heading_rad: float
    _told: Vector
    # A vector, since + - * / and square roots are bit-identical on all platforms, and angles are not.
    ahead: Vector

    def __init__(
        self,
        x_m: float,
        y_m: float,
        heading_rad: float = 0.0,
        speed_mps: float = 0.0,
        energy_j: float = 0.0,
        distance_m: float = 0.0,
    ) -> None:
        self.x_m, self.y_m = x_m, y_m
        self.heading_rad = heading_rad
        self.speed_mps = speed_mps
        self.energy_j, self.distance_m = energy_j, distance_m

    @property
    def heading_rad(self) -> float:
        """Heading, in (-pi, pi]."""
        # Computed on demand and cached by the vector: control needs no angle.
        if self._told is not self.ahead:
            self._told, angle = self.ahead, atan2(self.ahead[1], self.ahead[0])
            self._heading_rad = angle if angle > -PI else PI
        return self._heading_rad

    @heading_rad.setter
    def heading_rad(self, angle_rad: float) -> None:
        sine, cosine = sincos(angle_rad)
        self._told = self.ahead = cosine, sine
        self._heading_rad = wrapped(angle_rad)

    @property
    def position_m(self) -> Vector:
        """Position (x east, y north)."""
        return self.x_m, self.y_m

    def take(self, other: Motion) -> None:
        """Take the state of another motion."""
        for name in Motion.__slots__:
            setattr(self, name, getattr(other, name))

    @property
    def velocity_mps(self) -> Vector:
        """Velocity (x east, y north)."""
        return self.speed_mps * self.ahead[0], self.speed_mps * self.ahead[1]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Motion) and self._values() == other._values()

    __hash__ = None  # type: ignore[assignment]  # it changes

    def __repr__(self) -> str:
        return f"Motion{self._values()}"

    def _values(self) -> tuple[float, ...]:
        return self.x_m, self.y_m, self.heading_rad, self.speed_mps, self.energy_j, self.distance_m


class Leg(NamedTuple):
    """Steady motion: changes of position (m), way (m) and energy (J) in each motion tick."""

    east_m: float
    north_m: float
    way_m: float
    energy_j: float

    def go(self, motion: Motion) -> None:
        """Move for one tick."""
        motion.x_m += self.east_m
        motion.y_m += self.north_m
        motion.distance_m += self.way_m
        motion.energy_j += self.energy_j


def wrapped(angle_rad: float) -> float:
    """Normalise an angle to (-pi, pi].

    >>> wrapped(1.5 * math.pi) == -0.5 * math.pi
    True
    """
    if -PI < angle_rad <= PI:
        return angle_rad
    inside = PI - (PI - angle_rad) % TAU
    return inside if inside > -PI else PI  # -pi results from a rounding error beyond pi


@lru_cache(maxsize=256)  # 0.2 % of a mission
def _turn(most_rad: float) -> Vector:
    """Cosine and sine of the largest turn of a tick; cosine -2 for a full turn."""
    if most_rad >= PI:
        return -2.0, 0.0
    sine, cosine = sincos(most_rad)
    return cosine, sine


def _turned(motion: Motion, wanted: Vector, most_rad: float) -> Vector | None:
    """Turn ``motion``; return None at ``wanted``, else cosine and sine of the error before."""
    (x, y), (to_x, to_y) = motion.ahead, wanted
    along, across = x * to_x + y * to_y, x * to_y - y * to_x
    if along > 0.0 and -STRAIGHT < across < STRAIGHT:
        return None
    if along >= _turn(most_rad)[0]:
        motion.ahead = wanted
        return None
    motion.ahead = turned((x, y), wanted, most_rad)
    return along, across


def turned(ahead: Vector, wanted: Vector, most_rad: float) -> Vector:
    """Return a unit vector turned towards another one by at most an angle.

    >>> turned((1.0, 0.0), (0.0, 1.0), 2.0), [round(part, 6) for part in turned((1.0, 0.0), (0.0, 1.0), PI / 4.0)]
    ((0.0, 1.0), [0.707107, 0.707107])
    """
    (x, y), (to_x, to_y) = ahead, wanted
    cosine, sine = _turn(most_rad)
    if x * to_x + y * to_y >= cosine:
        return wanted
    # Astern either way is as short: to the left, since the sign of a rounding error may not decide.
    if x * to_y - y * to_x < -STRAIGHT:
        sine = -sine
    x, y = x * cosine - y * sine, x * sine + y * cosine
    # Without this, rounding errors of the rotation would accumulate over the ticks.
    norm = math.sqrt(x * x + y * y)
    return x / norm, y / norm


def reaching_speed_mps(range_m: float, along: float, across: float, turn_rate_radps: float) -> float:
    """Return the greatest speed (m/s) at which a vehicle can still turn to its target.

    The circle through the target, tangent to the heading, has radius range / (2 sin error); the turning radius is speed
    / turn rate. A target inside the turning circle would be orbited forever; one astern counts as abeam. ``along`` and
    ``across`` are cosine and sine of the heading error; without error the speed is unlimited.

    >>> reaching_speed_mps(10.0, 0.0, 1.0, 0.5)
    2.5
    """
    side = abs(across) if along > 0.0 else 1.0
    return turn_rate_radps * range_m / (2.0 * side) if side > 0.0 else math.inf


def advance(
    motion: Motion, data: VehicleData, target_m: tuple[float, float], speed_mps: float, dt_s: float
) -> Leg | None:
    """Move towards a target within the limits of the vehicle, without overshoot; 0 m/s stops it.

    Heading and speed change by at most ``turn_rate_radps * dt_s`` and ``acceleration_mps2 * dt_s``. Energy: (hotel_w +
    drag_w_per_mps3 * speed^3) * dt_s. Returns the motion while steady, else None.
    """
    before = motion.ahead
    dx_m = target_m[0] - motion.x_m
    dy_m = target_m[1] - motion.y_m
    range_m = math.sqrt(dx_m * dx_m + dy_m * dy_m)
    if range_m > NEAREST_M and speed_mps > 0.0:
        off = _turned(motion, (dx_m / range_m, dy_m / range_m), data.turn_rate_radps * dt_s)
        if off is not None:
            speed_mps = min(speed_mps, reaching_speed_mps(range_m, *off, data.turn_rate_radps))
    leg = _move(motion, data, speed_mps, range_m, dt_s)
    return leg if motion.ahead is before else None


def follow(motion: Motion, data: VehicleData, velocity_mps: tuple[float, float], dt_s: float) -> None:
    """Move with a velocity (x east, y north) within the limits of the vehicle.

    The speed is the component along the reached heading, at least 0: a vehicle that reverses turns on the spot.
    """
    speed_mps = length(*velocity_mps)
    if speed_mps > NEAREST_M:
        wanted = velocity_mps[0] / speed_mps, velocity_mps[1] / speed_mps
        if _turned(motion, wanted, data.turn_rate_radps * dt_s) is not None:
            speed_mps = max(0.0, speed_mps * (motion.ahead[0] * wanted[0] + motion.ahead[1] * wanted[1]))
    _move(motion, data, speed_mps, math.inf, dt_s)


def _move(motion: Motion, data: VehicleData, speed_mps: float, most_m: float, dt_s: float) -> Leg | None:
    most = data.acceleration_mps2 * dt_s
    before_mps, (east, north) = motion.speed_mps, motion.ahead
    change = speed_mps - before_mps
    motion.speed_mps = now_mps = before_mps + (most if change > most else -most if change < -most else change)
    travelled_m = now_mps * dt_s
    # A vehicle that stops needs its braking distance and may pass the target.
    if speed_mps > 0.0 and travelled_m > most_m:
        travelled_m = most_m
    # Products, not a power: the latter depends on the mathematical library.
    drag_w = data.drag_w_per_mps3 * (now_mps * now_mps * now_mps)
    leg = Leg(travelled_m * east, travelled_m * north, travelled_m, (data.hotel_w + drag_w) * dt_s)
    leg.go(motion)
    is_under_way = travelled_m < most_m or travelled_m == 0.0
    return leg if now_mps == before_mps and is_under_way else None
