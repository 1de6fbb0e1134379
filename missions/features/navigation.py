"""Navigation error, ``[navigation]`` and ``[[beacon]]``: drift, and fixes that reduce it (``docs/model/sea.md``).

The duration of a fix is optimal by the marginal value theorem (Charnov, Theoretical Population Biology 9, 1976,
129-136): no other one leaves a greater share of the time for work. With s = (time there and back) / fix_s this holds at
x = (t - time there) / fix_s, exp(x) = 1 + s + x. From 20 m at 0.5 m/s with a ``fix_s`` of 10 s, s = 8, so x = 2.43.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from pydantic import Field

from exchange.arithmetic import TAU, distance, exp, length, log, sincos
from exchange.channel import loss
from missions.errors import ConfigurationFault, one_of
from missions.feature import Feature, Joining
from missions.metric import NOT_APPLICABLE, Absent, Better, MeasuredRun, Metric
from missions.spans import spans_by
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.behaviours import CAPTURE_M, DUE, IDLE, Behaviour, Perception, Reference, distance_m
from remoras.events import Host, Observer
from remoras.motion.separation import SAME_DEPTH_M, Separation
from remoras.table import Name, PointM, Positive, Sparse
from remoras.work import Point

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.database import VehicleData
    from remoras.fleet.vehicle import Vehicle
    from remoras.functional.layer import FunctionalLayer
    from remoras.mission import Mission
    from remoras.motion import Motion
    from remoras.motion.avoidance import Neighbour
    from remoras.picture import Picture
    from remoras.sensor import Pose

KEY, BEACON = "navigation", "beacon"
FIXING = ActivitySet(None, ActivityKind.VITAL, (Activity("FixingPosition", ActivityType.GUIDANCE),), 1.0)


# Error and fixes --------------------------------------------------------------------------------


STEPS = 50
HALF_ROOT = math.sqrt(0.5)
SURFACE_M = 1.0  # depth down to which a vehicle has a fix


@dataclass(frozen=True, slots=True)
class Beacon:
    """Known position that gives fixes within ``range_m``; with a ``carrier`` its position, None while silent."""

    position_m: Point | Callable[[], Point | None]
    range_m: float
    carrier: str = ""

    def reaches(self, position_m: Point) -> bool:
        """True if the beacon is in range of a position."""
        at_m = self.position_m() if callable(self.position_m) else self.position_m
        return at_m is not None and distance(position_m, at_m) <= self.range_m


def takes_s(table: NavigationTable, depth_m: float) -> float:
    """Return the duration (s) of a fix at the surface, ascent and descent included; its dwell is x times ``fix_s``.

    Fixed-point iteration x <- log(1 + s + x) contracts by 1 / (1 + s + x).
    """
    way_s = 2.0 * depth_m / table.vertical_speed_mps
    share = x = way_s / table.fix_s
    for _ in range(STEPS):
        x = log(1.0 + share + x)
    return way_s + x * table.fix_s


class Navigation:
    """Navigation error of one vehicle; ``direction_rad`` samples the drift direction of interval n between fixes.

    The vehicle knows ``uncertainty_m``, the bound of the error, but not ``error_m``, the believed minus the true
    position.

    >>> adrift = Navigation(NavigationTable(drift=0.01), (Beacon((0.0, 0.0), 50.0),), 20.0, lambda n: 0.0)
    >>> adrift.go((500.0, 0.0), 500.0, 1.0)
    >>> adrift.error_m, adrift.uncertainty_m
    ((5.0, 0.0), 5.0)
    >>> adrift.go((0.0, 0.0), 500.0, 100.0)
    >>> adrift.error_m[0] < 0.001
    True
    """

    def __init__(
        self,
        table: NavigationTable,
        beacons: Sequence[Beacon],
        depth_m: float,
        direction_rad: Callable[[int], float],
    ) -> None:
        self.error_m: Point = (0.0, 0.0)
        self.uncertainty_m = 0.0
        self.depth_m = depth_m
        self.has_fix = False
        self.table, self.beacons = table, beacons
        self._direction_rad = direction_rad
        self._n_ways = 0
        self._course: Point | None = None

    def go(self, position_m: Point, way_m: float, dt_s: float) -> None:
        """Update for a tick of ``dt_s`` that ended at the true ``position_m`` after ``way_m``."""
        x_m, y_m = self.error_m
        self.has_fix = self.depth_m <= SURFACE_M or any(beacon.reaches(position_m) for beacon in self.beacons)
        if self.has_fix:
            left = exp(-dt_s / self.table.fix_s)
            self.error_m = left * x_m, left * y_m
            self.uncertainty_m *= left
            # The next interval under water has a new direction, keyed by its number.
            self._course = None
            return
        if self._course is None:
            north, east = sincos(self._direction_rad(self._n_ways))
            self._course = east, north
            self._n_ways += 1
        grown_m = self.table.drift * way_m
        self.error_m = x_m + grown_m * self._course[0], y_m + grown_m * self._course[1]
        self.uncertainty_m += grown_m

    @property
    def sigma_m(self) -> float:
        """Standard deviation (m) of the error per axis, as known to the vehicle."""
        # Directions are uniform, so the variance per axis is half the mean square of the error, at most b^2 / 2.
        return self.uncertainty_m * HALF_ROOT

    def go_to_depth(self, depth_m: float, dt_s: float) -> None:
        """Approach a depth for ``dt_s``."""
        most_m = self.table.vertical_speed_mps * dt_s
        self.depth_m += min(max(depth_m - self.depth_m, -most_m), most_m)


# Scenario settings ------------------------------------------------------------------------------


class NavigationTable(Sparse):
    """The table ``[navigation]``."""

    UNSAID = frozenset({"vertical_speed_mps"})

    drift: float = Field(
        0.0,
        ge=0.0,
        le=0.2,
        description="position error as a share of the distance under water",
    )
    fix_s: Positive = Field(10.0, description="time for the error to fall to 1/e, at the surface and near a beacon")
    vertical_speed_mps: Positive = Field(0.5, description="vertical speed of vehicles that surface for a position fix")


class BeaconTable(Sparse):
    """One ``[[beacon]]``, at a fixed position or carried by a vehicle."""

    UNSAID = frozenset({"position_m", "vehicle", "sensor"})

    name: Name = Field(description="name of the beacon")
    position_m: PointM | None = Field(None, description="position, x east, y north; or name a vehicle")
    vehicle: str | None = Field(None, description="vehicle that carries it, instead of position_m")
    sensor: str | None = Field(
        None, description="sensor of that vehicle that is the beacon: no fixes while it has failed"
    )
    range_m: Positive = Field(description="distance within which vehicles get a fix")


def beacon_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: beacons with both or neither of position and carrier, or an unknown one."""
    beacons: tuple[BeaconTable, ...] = scenario.of_feature(BEACON)
    yield from scenario.world.outside(
        (f"{BEACON}.{b.name}.position_m", b.position_m) for b in beacons if b.position_m is not None
    )
    sensors = {vehicle.name: vehicle.sensor_names("") for vehicle in scenario.vehicle}
    for beacon in beacons:
        key = f"{BEACON}.{beacon.name}"
        if (beacon.position_m is None) == (beacon.vehicle is None):
            keys = "neither position_m nor" if beacon.vehicle is None else "both position_m and"
            yield ConfigurationFault(key, "", f"has {keys} vehicle; allowed: one of them")
        yield from one_of(f"{key}.vehicle", beacon.vehicle, list(sensors))
        if beacon.vehicle in sensors:
            yield from one_of(f"{key}.sensor", beacon.sensor, sensors[beacon.vehicle])


def errs(scenario: Scenario) -> bool:
    """True if vehicles have a navigation error."""
    return bool(scenario.of_feature(KEY).drift > 0.0)


def place_error_m(scenario: Scenario, vehicles: Sequence[VehicleData]) -> float | None:
    """Greatest error (m) that a vehicle accumulates in the time of a fix; None without error."""
    if not errs(scenario):
        return None
    table = scenario.of_feature(KEY)
    ways_m = [vehicle.survey_speed_mps * takes_s(table, vehicle.depth_m) for vehicle in vehicles]
    return float(table.drift * max(ways_m, default=0.0))


def locating(scenario: Scenario) -> tuple[str, ...]:
    """Return the vehicles that carry a beacon."""
    beacons: tuple[BeaconTable, ...] = scenario.of_feature(BEACON)
    return tuple(beacon.vehicle for beacon in beacons if beacon.vehicle)


# Vehicle behaviour ------------------------------------------------------------------------------


class FixingPosition(Behaviour):
    """Behaviour that obtains a position fix; the functional layer sets ``needed_m``, the accuracy required now."""

    def __init__(self, navigation: Navigation, data: VehicleData) -> None:
        self.needed_m = math.inf
        self.depth_m = data.depth_m
        self.n_fixes = 0
        self.navigation = navigation
        self._data = data
        self._begun: tuple[float, float] | None = None  # time and uncertainty
        self._from_m: Point = data.start_m
        self._silent: set[int] = set()  # numbers of beacons not received at their known position
        self._beacon: int | None = None
        self._is_fixed = False

    # When ----------------------------------------------------------------------------------------

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        """Pending from an uncertainty above ``needed_m`` until the vehicle is back at its depth."""
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
        navigation, (since_s, before_m) = self.navigation, self._begun or (0.0, 0.0)
        if navigation.has_fix:
            back_s = self._back_s(motion)
            spent_s, left_m = picture.body.now_s - since_s + back_s, navigation.uncertainty_m
            # Optimal end of a fix: the error falls more slowly now than on average, b / fix_s <= (b_0 - b) / (t + r).
            self._is_fixed = left_m * spent_s <= (before_m - left_m) * navigation.table.fix_s
            if self._is_fixed:
                self.depth_m = self._data.depth_m
        elif navigation.depth_m == self._data.depth_m:
            self._beacon = self._nearest(motion, picture)
            self.depth_m = 0.0 if self._beacon is None else self._data.depth_m

    def _back_s(self, motion: Motion) -> float:
        rise_s = (self._data.depth_m - self.navigation.depth_m) / self.navigation.table.vertical_speed_mps
        return rise_s + distance_m(motion, self._from_m) / self._data.transit_speed_mps

    # Where ---------------------------------------------------------------------------------------

    def _nearest(self, motion: Motion, picture: Picture) -> int | None:
        navigation = self.navigation
        soonest, least_s = None, self._data.depth_m / navigation.table.vertical_speed_mps
        for number, beacon in enumerate(navigation.beacons):
            at_m = self._known_m(number, picture)
            if at_m is None or number in self._silent:
                continue
            to_go_m = distance(motion.position_m, at_m)
            # Without a fix at its known position the beacon is silent or elsewhere.
            if to_go_m <= CAPTURE_M:
                self._silent.add(number)
                continue
            way_s = max(0.0, to_go_m - beacon.range_m) / self._data.transit_speed_mps
            if way_s < least_s:
                soonest, least_s = number, way_s
        return soonest

    def _known_m(self, number: int, picture: Picture) -> Point | None:
        beacon = self.navigation.beacons[number]
        if beacon.carrier:
            return picture.peers.positions_m.get(beacon.carrier)
        return None if callable(beacon.position_m) else beacon.position_m

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        goal_m = None if self._beacon is None or self._is_fixed else self._known_m(self._beacon, picture)
        if goal_m is None or self.navigation.has_fix:
            return Reference(motion.position_m, 0.0)
        return Reference(goal_m, self._data.transit_speed_mps)


class Adrift:
    """Navigation state of a vehicle: its error, kept over restarts (``before``), and the behaviour that bounds it."""

    need = FIXING

    def __init__(self, layer: FunctionalLayer, navigation: Navigation, before: Adrift | None = None) -> None:
        self.navigation = navigation
        self.behaviour = FixingPosition(navigation, layer.data)
        self._layer = layer
        self._before = before
        layer.believed = copy(layer.motion)
        layer.positioning = self

    def restart(self) -> None:
        """Restore the error and depth from before a restart."""
        if self._before is not None:
            self.navigation = self.behaviour.navigation = self._before.navigation
            self._before = None
            self._reckon()

    def before_decision(self, guiding: Behaviour | None) -> None:
        """Set the required accuracy from the guiding behaviour; during a fix the last value holds."""
        motion, picture = self._layer.believed, self._layer.picture
        picture.body.n_fixes = self.behaviour.n_fixes
        if guiding is not self.behaviour:
            asked = getattr(guiding, "accuracy_m", None)  # behaviours of plug-ins may lack it
            self.behaviour.needed_m = math.inf if asked is None else asked(motion, picture)

    def after_motion(self, neighbours: Sequence[Neighbour], dt_s: float) -> None:
        """Update depth and navigation after a motion tick."""
        motion, separation_m = self._layer.motion, self._layer.guidance.constants.separation_m
        # A vehicle changes its depth only with the separation to all others, as their layers may cross.
        if all(length(neighbour.dx_m, neighbour.dy_m) >= separation_m for neighbour in neighbours):
            self.navigation.go_to_depth(self.behaviour.depth_m, dt_s)
        self.navigation.go(motion.position_m, motion.speed_mps * dt_s, dt_s)
        self._reckon()

    def _reckon(self) -> None:
        layer, navigation = self._layer, self.navigation
        layer.depth_m = navigation.depth_m
        layer.guidance.error_m = navigation.error_m
        layer.believed.take(layer.motion)
        layer.believed.x_m += navigation.error_m[0]
        layer.believed.y_m += navigation.error_m[1]
        layer.picture.body.uncertainty_m = navigation.uncertainty_m

    def pose(self, pose: Pose) -> Pose:
        """Add error, bound and standard deviation to a pose."""
        known = self.navigation
        return pose._replace(error_m=known.error_m, uncertainty_m=known.uncertainty_m, sigma_m=known.sigma_m)

    @property
    def column_m(self) -> tuple[float, float]:
        """Claimed depth interval (m) from the top: up to the surface during a fix there."""
        depth_m = self._layer.data.depth_m
        is_away = self.behaviour.depth_m != depth_m or self.navigation.depth_m != depth_m
        return (0.0, depth_m) if is_away else (depth_m, depth_m)


class SeparationAcrossLayers(Separation):
    """Separation monitor that replaces ``within`` for vehicles that leave their depths."""

    def __init__(self, within: Separation, column_m: Callable[[int], tuple[float, float]]) -> None:
        super().__init__(within.vehicles, within.separation_m)
        self.layers = [list(range(len(within.vehicles)))]
        self._column_m = column_m

    def may_meet(self, first: int, second: int) -> bool:
        """True if the claimed depth intervals of both vehicles come near each other."""
        (top_m, bottom_m), (other_top_m, other_bottom_m) = self._column_m(first), self._column_m(second)
        return max(top_m, other_top_m) - min(bottom_m, other_bottom_m) <= SAME_DEPTH_M

    def are_too_near(self, first: int, second: int) -> bool:
        """True if both are at the same depth now, and too near."""
        apart_m = abs(self.vehicles[first].functional.depth_m - self.vehicles[second].functional.depth_m)
        return apart_m <= SAME_DEPTH_M and super().are_too_near(first, second)


# Run hooks --------------------------------------------------------------------------------------


class Drift(Observer):
    """Run hooks that give all vehicles a navigation error; draws are keyed by seed and node."""

    def __init__(self, joining: Joining) -> None:
        self._table: NavigationTable = joining.scenario.of_feature(KEY)
        self._beacons: tuple[BeaconTable, ...] = joining.scenario.of_feature(BEACON)
        self._seed = joining.seed
        self._adrift: dict[int, Adrift] = {}
        self._host: Host | None = None

    def on_start(self, host: Host) -> None:
        self._host = host

    def on_vehicle(self, vehicle: Vehicle) -> None:
        """Add navigation to a vehicle; a restarted one keeps its error."""
        layer = vehicle.functional
        node = layer.data.node

        def direction_rad(n_way: int) -> float:
            return TAU * loss.uniform(self._seed, loss.DRIFTS, n_way, node, 0)

        navigation = Navigation(self._table, self._heard_by(vehicle.name), layer.data.depth_m, direction_rad)
        self._adrift[node] = Adrift(layer, navigation, self._adrift.get(node))

    def separation(self, separation: Separation) -> Separation:
        return SeparationAcrossLayers(separation, lambda node: self._adrift[node].column_m)

    def _heard_by(self, vehicle: str) -> tuple[Beacon, ...]:
        return tuple(
            Beacon(
                beacon.position_m or partial(self.carrier_m, beacon.vehicle or "", beacon.sensor),
                beacon.range_m,
                beacon.vehicle or "",
            )
            for beacon in self._beacons
            if beacon.vehicle != vehicle
        )

    def carrier_m(self, vehicle: str, sensor: str | None) -> Point | None:
        """True position of a vehicle; None while it or its beacon sensor does not transmit."""
        # A single-vehicle process does not know the true positions of others: their beacons give it no fix.
        if self._host is None or vehicle not in self._host.names:
            return None
        carrier = self._host.named(vehicle)
        condition = carrier.condition
        is_silent = not carrier.is_alive or condition.is_mute or sensor in condition.dead_sensors
        return None if is_silent else carrier.functional.motion.position_m


def observer_of(joining: Joining) -> Drift | None:
    """Return the run hooks; None without navigation error."""
    return Drift(joining) if errs(joining.scenario) else None


# Metrics ----------------------------------------------------------------------------------------


KNOWN = "Only runs with navigation errors count."


def n_fixes(run: MeasuredRun) -> int | Absent:
    """Number of interruptions for a fix."""
    return len(_spells_s(run)) if errs(run.scenario) else NOT_APPLICABLE


def fixing_s(run: MeasuredRun) -> float | Absent:
    """Total time (s) of these interruptions over all vehicles."""
    return round(math.fsum(_spells_s(run)), 4) if errs(run.scenario) else NOT_APPLICABLE


def _spells_s(run: MeasuredRun) -> list[float]:
    decided: dict[tuple[float, str], set[str]] = {}
    for time_s, vehicle, _, name, *_ in run.recorder.rows("activities"):
        decided.setdefault((time_s, vehicle), set()).add(name)
    fixes = ((vehicle, time_s, FIXING.name in names) for (time_s, vehicle), names in decided.items())
    return [end - begin for own in spans_by(fixes, run.ended_s).values() for begin, end in own]


FEATURE = Feature(
    {"": {KEY: (NavigationTable, NavigationTable.usual()), BEACON: (tuple[BeaconTable, ...], ())}},
    observer_of,
    beacon_faults,
    last_metrics=(
        Metric("n_fixes", "", Better.LOWER, "position fixes", n_fixes, note=KNOWN),
        Metric("fixing_s", "s", Better.LOWER, "time for position fixes", fixing_s, note="Sum over all vehicles."),
    ),
    place_error_m=place_error_m,
    locating=locating,
)
