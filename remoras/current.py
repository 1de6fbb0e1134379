"""Current: how the water moves, the same everywhere at one depth and time.

The current at the surface, less with depth, and to and fro with the tide::

    c(z, t) = c_0 max(0, 1 - z / shear_depth) cos(2 pi (t / period + phase)) + sum of surges

A surge is added evenly over all depths while it lasts.

A vehicle measures the current where it is, as a Doppler log does, and heads into it: to make good a course along the
unit vector d at speed s through the water it goes at velocity g d - c through the water, with the speed over ground::

    g = c . d + sqrt(s^2 - (c x d)^2)

Vehicles in one depth layer drift alike, so they keep clear of each other in the frame of the water.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from exchange.arithmetic import TAU, length, sincos

Velocity = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Surge:
    """A velocity that is added to the current from ``from_s`` to before ``until_s``, at all depths."""

    from_s: float
    until_s: float
    east_mps: float
    north_mps: float


@dataclass(frozen=True, slots=True)
class Current:
    """Velocity of the water.

    Attributes:
        east_mps, north_mps: at the surface, at the height of the tide.
        shear_depth_m: at this depth it has fallen to nothing, evenly; infinite where it does not fall.
        tide_period_s: time in which it turns and returns; infinite where it does not.
        tide_phase: share of the period by which it is ahead at the start of the mission, 0..1.
        surges: what is added for a time.
    """

    east_mps: float
    north_mps: float
    shear_depth_m: float = math.inf
    tide_period_s: float = math.inf
    tide_phase: float = 0.0
    surges: tuple[Surge, ...] = ()

    def at(self, depth_m: float, now_s: float) -> Velocity:
        """Velocity (m/s) at a depth and time.

        >>> Current(0.5, 0.0, shear_depth_m=40.0).at(10.0, 0.0)
        (0.375, 0.0)
        >>> east_mps, _ = Current(0.5, 0.0, tide_period_s=3600.0).at(0.0, 1800.0)
        >>> east_mps
        -0.5
        """
        share = max(0.0, 1.0 - depth_m / self.shear_depth_m)
        share *= sincos(TAU * ((now_s / self.tide_period_s + self.tide_phase) % 1.0))[1]
        east_mps, north_mps = share * self.east_mps, share * self.north_mps
        for surge in self.surges:
            if surge.from_s <= now_s < surge.until_s:
                east_mps, north_mps = east_mps + surge.east_mps, north_mps + surge.north_mps
        return east_mps, north_mps

    def greatest_mps(self, depth_m: float) -> float:
        """The greatest speed (m/s) that it may have at a depth, whatever the tide and wherever its surges point."""
        steady_mps = length(self.east_mps, self.north_mps) * max(0.0, 1.0 - depth_m / self.shear_depth_m)
        added_mps = [
            math.fsum(length(s.east_mps, s.north_mps) for s in self.surges if s.from_s <= begins.from_s < s.until_s)
            for begins in self.surges
        ]
        return steady_mps + max(added_mps, default=0.0)


def through_water(course: Velocity, speed_mps: float, current: Velocity) -> Velocity:
    """Velocity through the water (m/s) that makes good a course over ground.

    Args:
        course: unit vector.
        speed_mps: through the water.
        current: velocity of the water (m/s).

    Returns:
        Into the current as fast as it goes where the course cannot be made good.

    3 m/s across a current, at 5 m/s through the water, leave 4 m/s over ground:

    >>> through_water((1.0, 0.0), 5.0, (0.0, 3.0))
    (4.0, -3.0)
    """
    along = current[0] * course[0] + current[1] * course[1]
    across = current[1] * course[0] - current[0] * course[1]
    left = speed_mps * speed_mps - across * across
    ground_mps = along + math.sqrt(left) if left > 0.0 else 0.0
    if ground_mps <= 0.0:
        strength_mps = length(*current)
        share = min(1.0, speed_mps / strength_mps) if strength_mps > 0.0 else 0.0
        return -share * current[0], -share * current[1]
    return ground_mps * course[0] - current[0], ground_mps * course[1] - current[1]
