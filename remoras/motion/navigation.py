"""Navigation error of a vehicle by dead reckoning with fixes.

Under water the error grows with the distance by log and compass. At the surface or in beacon range a fix reduces it::

    de = drift u_n ds                 under water; direction u_n sampled per interval n between fixes
    e <- e exp(-dt / fix_s)           at the surface, or within range of a beacon

The believed position is the true one plus e; guidance and messages use it. Other vehicles, the channel and sensors
depend on the true position. The vehicle knows only drift and distance, hence a bound::

    db = drift ds,    b <- b exp(-dt / fix_s)    so that |e| <= b always, by the triangle inequality

Directions are uniform, so the variance of e per axis is half its mean square, at most b^2 / 2. A current adds
nothing: a Doppler log measures it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from exchange.arithmetic import distance, exp, log, sincos
from remoras.work import Point

STEPS = 50
"""Iterations for the duration of a fix."""
HALF_ROOT = math.sqrt(0.5)
SURFACE_M = 1.0
"""Depth down to which a vehicle has a fix."""


@dataclass(frozen=True, slots=True)
class Beacon:
    """Known position that gives fixes within ``range_m``.

    Attributes:
        position_m: fixed, or a function of the current position, None while silent: a vehicle may serve as a beacon.
        carrier: name of that vehicle; empty if fixed.
    """

    position_m: Point | Callable[[], Point | None]
    range_m: float
    carrier: str = ""

    def reaches(self, position_m: Point) -> bool:
        """True if the beacon is in range of a position."""
        at_m = self.position_m() if callable(self.position_m) else self.position_m
        return at_m is not None and distance(position_m, at_m) <= self.range_m


@dataclass(frozen=True, slots=True)
class NavigationConstants:
    """Constants of the equations above; ``drift`` is a share of distance.

    ``vertical_speed_mps``: rate of depth change for a fix.
    """

    drift: float
    fix_s: float = 10.0
    beacons: tuple[Beacon, ...] = ()
    vertical_speed_mps: float = 0.5


def takes_s(constants: NavigationConstants, depth_m: float) -> float:
    """Return the duration (s) of a fix at the surface, ascent and descent included.

    The dwell follows ``missions.features.navigation``: x times ``fix_s``, with exp(x) = 1 + s + x, s being the travel
    time in ``fix_s``. Fixed-point iteration x <- log(1 + s + x) contracts by 1 / (1 + s + x).

    >>> round(takes_s(NavigationConstants(0.01), 20.0), 1)
    104.4
    """
    way_s = 2.0 * depth_m / constants.vertical_speed_mps
    share = x = way_s / constants.fix_s
    for _ in range(STEPS):
        x = log(1.0 + share + x)
    return way_s + x * constants.fix_s


class Navigation:
    """Navigation error of one vehicle.

    Args:
        depth_m: initial depth.
        direction_rad: samples the drift direction of interval n between fixes, from 0.

    Attributes:
        error_m: believed minus true position; unknown to the vehicle.
        uncertainty_m: bound of the error; known to the vehicle.
        has_fix: True if the last tick had a fix.

    >>> adrift = Navigation(NavigationConstants(0.01, beacons=(Beacon((0.0, 0.0), 50.0),)), 20.0, lambda n: 0.0)
    >>> adrift.go((500.0, 0.0), 500.0, 1.0)
    >>> adrift.error_m, adrift.uncertainty_m
    ((5.0, 0.0), 5.0)
    >>> adrift.go((0.0, 0.0), 500.0, 100.0)
    >>> adrift.error_m[0] < 0.001
    True
    """

    def __init__(self, constants: NavigationConstants, depth_m: float, direction_rad: Callable[[int], float]) -> None:
        self.error_m: Point = (0.0, 0.0)
        self.uncertainty_m = 0.0
        self.depth_m = depth_m
        self.has_fix = False
        self.constants = constants
        self._direction_rad = direction_rad
        self._n_ways = 0
        self._course: Point | None = None

    def go(self, position_m: Point, way_m: float, dt_s: float) -> None:
        """Update for a tick of ``dt_s`` that ended at the true ``position_m`` after ``way_m``."""
        constants, (x_m, y_m) = self.constants, self.error_m
        self.has_fix = self.depth_m <= SURFACE_M or any(beacon.reaches(position_m) for beacon in constants.beacons)
        if self.has_fix:
            left = exp(-dt_s / constants.fix_s)
            self.error_m = left * x_m, left * y_m
            self.uncertainty_m *= left
            self._course = None
            return
        if self._course is None:
            north, east = sincos(self._direction_rad(self._n_ways))
            self._course = east, north
            self._n_ways += 1
        grown_m = constants.drift * way_m
        self.error_m = x_m + grown_m * self._course[0], y_m + grown_m * self._course[1]
        self.uncertainty_m += grown_m

    @property
    def sigma_m(self) -> float:
        """Standard deviation (m) of the error per axis, as known to the vehicle.

        >>> adrift = Navigation(NavigationConstants(0.01), 20.0, lambda n: 0.0)
        >>> adrift.go((500.0, 0.0), 500.0, 1.0)
        >>> round(adrift.sigma_m, 4)
        3.5355
        """
        return self.uncertainty_m * HALF_ROOT

    def go_to_depth(self, depth_m: float, dt_s: float) -> None:
        """Approach a depth for ``dt_s``."""
        most_m = self.constants.vertical_speed_mps * dt_s
        self.depth_m += min(max(depth_m - self.depth_m, -most_m), most_m)
