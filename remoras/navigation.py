"""Navigation: how far off a vehicle takes itself to be from where it is.

Under water a vehicle adds up its way by log and compass, and its error grows with that way. At the surface, or where it
hears a beacon, it has a fix, and the error shrinks::

    de = drift u_n ds                 under water; u_n is drawn for each way n between two fixes
    e <- e exp(-dt / fix_s)           at the surface, or within range of a beacon

What the vehicle believes of its place is where it is plus e: by that it is guided, and that is what it tells. What it
meets is where it is: others, the channel, the ground below its sensors.

It does not know e. It knows its drift, from the data sheet, and its way, from the log, so it knows a bound::

    db = drift ds,    b <- b exp(-dt / fix_s)    so that |e| <= b always, by the inequality of triangles

All directions are as likely, so the variance of e on each axis is half the mean of |e|^2, and at most b^2 / 2.

A current adds nothing to either: a Doppler log measures it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from exchange.arithmetic import distance, exp, log, sincos
from remoras.work import Point

STEPS = 50
"""Steps by which the length of a stay is found."""
HALF_ROOT = math.sqrt(0.5)
SURFACE_M = 1.0
"""A vehicle that is not deeper than this has a fix."""


@dataclass(frozen=True, slots=True)
class Beacon:
    """Something whose place is known: who is within ``range_m`` of it has a fix.

    Attributes:
        position_m: where it stands, or a function that says where it is now, None while it is silent: so a vehicle
            that knows its place is a beacon to others.
        carrier: name of that vehicle; empty if it stands.
    """

    position_m: Point | Callable[[], Point | None]
    range_m: float
    carrier: str = ""

    def reaches(self, position_m: Point) -> bool:
        """True if it is heard at a place."""
        at_m = self.position_m() if callable(self.position_m) else self.position_m
        return at_m is not None and distance(position_m, at_m) <= self.range_m


@dataclass(frozen=True, slots=True)
class NavigationConstants:
    """The constants of the equations above; ``drift`` is a share of the way.

    ``vertical_speed_mps`` is the speed at which vehicles change their depth to have a fix.
    """

    drift: float
    fix_s: float = 10.0
    beacons: tuple[Beacon, ...] = ()
    vertical_speed_mps: float = 0.5


def takes_s(constants: NavigationConstants, depth_m: float) -> float:
    """Time of a fix at the surface, from the decision to go up until the vehicle is down again.

    The stay is that of ``missions.features.navigation``: x times ``fix_s``, where exp(x) = 1 + s + x and s is the way
    there and back in ``fix_s``. Found by x <- log(1 + s + x), which comes nearer by 1 / (1 + s + x) each time.

    >>> round(takes_s(NavigationConstants(0.01), 20.0), 1)
    104.4
    """
    way_s = 2.0 * depth_m / constants.vertical_speed_mps
    share = x = way_s / constants.fix_s
    for _ in range(STEPS):
        x = log(1.0 + share + x)
    return way_s + x * constants.fix_s


class Navigation:
    """The error of one vehicle.

    Args:
        constants: of all vehicles.
        depth_m: of this one.
        direction_rad: draws the direction in which it drifts on its n-th way between two fixes, from 0.

    Attributes:
        error_m: where it takes itself to be, from where it is; the vehicle does not know it.
        uncertainty_m: the greatest error that it may have, as it knows.
        depth_m: at which it is now.
        has_fix: True if it had one in the last tick.
        constants: of all vehicles.

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
        """Account for a tick.

        Args:
            position_m: where the vehicle really is now.
            way_m: that it has gone in the tick; dt_s: its length.
        """
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
        """Standard deviation of its error on each axis, as it knows.

        >>> adrift = Navigation(NavigationConstants(0.01), 20.0, lambda n: 0.0)
        >>> adrift.go((500.0, 0.0), 500.0, 1.0)
        >>> round(adrift.sigma_m, 4)
        3.5355
        """
        return self.uncertainty_m * HALF_ROOT

    def go_to_depth(self, depth_m: float, dt_s: float) -> None:
        """Come nearer to a depth, for ``dt_s``."""
        most_m = self.constants.vertical_speed_mps * dt_s
        self.depth_m += min(max(depth_m - self.depth_m, -most_m), most_m)
