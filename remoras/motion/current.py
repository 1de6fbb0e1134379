"""Current: velocity of the water, uniform at one depth and time, with shear, tide and surges::

    c(z, t) = c_0 max(0, 1 - z / shear_depth) cos(2 pi (t / period + phase)) + sum of surges

A vehicle measures the current, as by a Doppler log, and heads into it. To make good a course along the unit vector d at
speed s through the water, its velocity through the water is g d - c, with the speed over ground::

    g = c . d + sqrt(s^2 - (c x d)^2)

Vehicles in one depth layer drift alike, so avoidance works in the frame of the water.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from exchange.arithmetic import TAU, length, sincos

Velocity = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Surge:
    """Additional velocity from ``from_s`` until before ``until_s``, at all depths."""

    from_s: float
    until_s: float
    east_mps: float
    north_mps: float


@dataclass(frozen=True, slots=True)
class Current:
    """Velocity of the water.

    Attributes:
        east_mps, north_mps: at the surface, at the maximum of the tide.
        shear_depth_m: depth of linear decay to zero; infinite for none.
        tide_period_s: infinite for none.
        tide_phase: share of the period at mission start, 0..1.
    """

    east_mps: float
    north_mps: float
    shear_depth_m: float = math.inf
    tide_period_s: float = math.inf
    tide_phase: float = 0.0
    surges: tuple[Surge, ...] = ()

    def at(self, depth_m: float, now_s: float) -> Velocity:
        """Return the velocity (m/s) at a depth and time.

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
        """Return an upper bound of the speed (m/s) at a depth, over tide and surge directions."""
        steady_mps = length(self.east_mps, self.north_mps) * max(0.0, 1.0 - depth_m / self.shear_depth_m)
        added_mps = [
            math.fsum(length(s.east_mps, s.north_mps) for s in self.surges if s.from_s <= begins.from_s < s.until_s)
            for begins in self.surges
        ]
        return steady_mps + max(added_mps, default=0.0)


def through_water(course: Velocity, speed_mps: float, current: Velocity) -> Velocity:
    """Return the velocity through the water (m/s) for a course (unit vector) over ground.

    If the course cannot be made good, head into the current at up to ``speed_mps``.

    Across a current of 3 m/s, a speed of 5 m/s through the water leaves 4 m/s over ground:

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
