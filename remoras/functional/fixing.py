"""Fixing the position: a vehicle that errs learns where it is before its error spoils what it does.

What guides a vehicle may say how exactly it has to know its place (``Behaviour.accuracy_m``). Once its uncertainty is
greater than that, the vehicle goes where it has a fix: straight up to the surface, or to a beacon that it knows of if
it is there and back sooner. It goes on where it stopped once it is at its own depth again.

It stays as long as that is worth it. With b_0 the uncertainty with which it began, t the time since and r that of the
way back, it goes back once the uncertainty falls more slowly than it has on the mean of the whole interruption::

    b / fix_s <= (b_0 - b) / (t + r)

By the marginal value theorem (Charnov, Theoretical Population Biology 9, 1976, 129-136) no other stay leaves a greater
share of the time for work. With s = (way there and back) / fix_s this is at x = (t - way there) / fix_s where
exp(x) = 1 + s + x: from 20 m at 0.5 m/s with a ``fix_s`` of 10 s, s = 8, so x = 2.43 and b = 0.088 b_0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from exchange.arithmetic import distance, length
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.avoidance import Neighbour
from remoras.behaviours import CAPTURE_M, DUE, IDLE, Behaviour, Perception, Reference, distance_m
from remoras.database import VehicleData
from remoras.motion import Motion
from remoras.navigation import Navigation
from remoras.picture import Picture
from remoras.sensor import Pose
from remoras.work import Point

FIXING = ActivitySet(None, ActivityKind.VITAL, (Activity("FixingPosition", ActivityType.GUIDANCE),), 1.0)
"""The vital need; only vehicles that err have it."""


class FixingPosition(Behaviour):
    """Learns where the vehicle is, at the surface or near a beacon.

    Args:
        navigation: of the vehicle.
        data: of the vehicle.

    Attributes:
        navigation: of the vehicle; of its error nothing is read.
        needed_m: how exactly the vehicle has to know its place now; the functional layer sets it.
        depth_m: where it is to be now.
        n_fixes: how often it has learned where it is.
    """

    def __init__(self, navigation: Navigation, data: VehicleData) -> None:
        self.needed_m = math.inf
        self.depth_m = data.depth_m
        self.n_fixes = 0
        self.navigation = navigation
        self._data = data
        self._begun: tuple[float, float] | None = None  # time and uncertainty
        self._from_m: Point = data.start_m
        self._silent: set[int] = set()  # numbers of the beacons that were not heard where they are known to be
        self._beacon: int | None = None
        self._is_fixed = False

    # When ----------------------------------------------------------------------------------------

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Due once the vehicle may be farther off than it may be, until it is back at its depth."""
        navigation, now_s = self.navigation, picture.body.now_s
        if not performed:
            self._begun = None
        if self._begun is None:
            self.depth_m = self._data.depth_m
            is_off_depth = navigation.depth_m != self._data.depth_m
            if not is_off_depth and navigation.uncertainty_m <= self.needed_m:
                return IDLE
            self._begun, self._from_m = (now_s, navigation.uncertainty_m), motion.position_m
            self._is_fixed, self._silent = is_off_depth, set()
        if not self._is_fixed:
            self._seek(motion, picture)
        elif navigation.depth_m == self._data.depth_m:
            self.n_fixes += 1
            self._begun = None
            return IDLE
        return DUE

    def _seek(self, motion: Motion, picture: Picture) -> None:
        """Go where there is a fix, and stay as long as that is worth it."""
        navigation, (since_s, before_m) = self.navigation, self._begun or (0.0, 0.0)
        if navigation.has_fix:
            back_s = self._back_s(motion)
            spent_s, left_m = picture.body.now_s - since_s + back_s, navigation.uncertainty_m
            self._is_fixed = left_m * spent_s <= (before_m - left_m) * navigation.constants.fix_s
            if self._is_fixed:
                self.depth_m = self._data.depth_m
        elif navigation.depth_m == self._data.depth_m:
            self._beacon = self._nearest(motion, picture)
            self.depth_m = 0.0 if self._beacon is None else self._data.depth_m

    def _back_s(self, motion: Motion) -> float:
        """Time that the way back takes."""
        rise_s = (self._data.depth_m - self.navigation.depth_m) / self.navigation.constants.vertical_speed_mps
        return rise_s + distance_m(motion, self._from_m) / self._data.transit_speed_mps

    # Where ---------------------------------------------------------------------------------------

    def _nearest(self, motion: Motion, picture: Picture) -> int | None:
        """Number of the beacon that the vehicle is at and back from soonest; None if it goes up sooner."""
        constants = self.navigation.constants
        soonest, least_s = None, self._data.depth_m / constants.vertical_speed_mps
        for number, beacon in enumerate(constants.beacons):
            at_m = self._known_m(number, picture)
            if at_m is None or number in self._silent:
                continue
            to_go_m = distance(motion.position_m, at_m)
            if to_go_m <= CAPTURE_M:
                self._silent.add(number)
                continue
            way_s = max(0.0, to_go_m - beacon.range_m) / self._data.transit_speed_mps
            if way_s < least_s:
                soonest, least_s = number, way_s
        return soonest

    def _known_m(self, number: int, picture: Picture) -> Point | None:
        """Where a beacon is as far as the vehicle knows: of one that is carried, where its carrier was heard last."""
        beacon = self.navigation.constants.beacons[number]
        if beacon.carrier:
            return picture.peers.positions_m.get(beacon.carrier)
        return None if callable(beacon.position_m) else beacon.position_m

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        """To the beacon in transit; else stay, on the way up and down and where there is a fix."""
        goal_m = None if self._beacon is None or self._is_fixed else self._known_m(self._beacon, picture)
        if goal_m is None or self.navigation.has_fix:
            return Reference(motion.position_m, 0.0)
        return Reference(goal_m, self._data.transit_speed_mps)


class Adrift:
    """How one vehicle keeps the error of its place within what it needs.

    Args:
        navigation: of the vehicle.
        data: of the vehicle.
        separation_m: distance to others with which it may change its depth.

    Attributes:
        navigation: of the vehicle.
        fixing: carries out the vital need.
    """

    def __init__(self, navigation: Navigation, data: VehicleData, separation_m: float) -> None:
        self.navigation = navigation
        self.fixing = FixingPosition(navigation, data)
        self._data = data
        self._separation_m = separation_m

    def take_over(self, before: Adrift) -> None:
        """Go on with the error and the depth that the vehicle had before it began anew."""
        self.navigation = self.fixing.navigation = before.navigation

    def ask(self, guides: Behaviour | None, motion: Motion, picture: Picture) -> None:
        """Ask what guides how exactly the vehicle has to know its place; while it learns that, what was asked holds."""
        picture.body.n_fixes = self.fixing.n_fixes
        if guides is not self.fixing:
            asked = getattr(guides, "accuracy_m", None)  # a behaviour of others' making may lack it
            self.fixing.needed_m = math.inf if asked is None else asked(motion, picture)

    def went(self, motion: Motion, neighbours: Sequence[Neighbour], dt_s: float) -> None:
        """Account for a tick; the depth changes only while nobody is too near, of those above and below either."""
        if all(length(one.dx_m, one.dy_m) >= self._separation_m for one in neighbours):
            self.navigation.go_to_depth(self.fixing.depth_m, dt_s)
        self.navigation.go(motion.position_m, motion.speed_mps * dt_s, dt_s)

    def posed(self, pose: Pose) -> Pose:
        """A pose with the error, and the greatest that it may be as the vehicle knows."""
        return pose._replace(error_m=self.navigation.error_m, uncertainty_m=self.navigation.uncertainty_m)

    @property
    def column_m(self) -> tuple[float, float]:
        """Depths, from above, that the vehicle claims: all up to the surface while it goes there or comes from it."""
        depth_m = self._data.depth_m
        is_away = self.fixing.depth_m != depth_m or self.navigation.depth_m != depth_m
        return (0.0, depth_m) if is_away else (depth_m, depth_m)
