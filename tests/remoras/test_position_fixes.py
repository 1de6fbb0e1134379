"""Position fixes: error bound, time of surfacing, duration of a fix, separation during ascent."""

import math
import random
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import activity_set, auv

from missions.features.navigation import (
    FIXING,
    Adrift,
    Beacon,
    Navigation,
    NavigationTable,
    SeparationAcrossLayers,
    takes_s,
)
from remoras.activities import Activity, ActivityType
from remoras.behaviours import DUE, Behaviour, Perception, Reference
from remoras.database import VehicleData
from remoras.functional.layer import FunctionalLayer
from remoras.functional.vital import VITAL_SETS
from remoras.motion import Motion
from remoras.motion.avoidance import Neighbour
from remoras.motion.separation import Separation
from remoras.picture import Picture
from remoras.sensor import Pose

BOUNDS_M = (-9000.0, -9000.0, 9000.0, 9000.0)
WORK, FIX = len(VITAL_SETS), len(VITAL_SETS) + 1


class GoingEast(Behaviour):
    """Goes east for ever, and has to know its place to 10 m."""

    def perceive(self, motion: Motion, picture: Picture, performed: bool) -> Perception:
        return DUE

    def reference(self, motion: Motion, picture: Picture) -> Reference | None:
        return Reference((8000.0, 0.0), 1.5)

    def accuracy_m(self, motion: Motion, picture: Picture) -> float:
        return 10.0


class East:
    """A mission that goes there."""

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        return GoingEast()


class Voyage:
    """One vehicle that decides every 2 s, as the executive layer has it: what is vital before what is not."""

    def __init__(self, *beacons: Beacon, drift: float = 0.02) -> None:
        self.navigation = Navigation(NavigationTable(drift=drift), beacons, 20.0, lambda n: 1.0 + n)
        self.layer = FunctionalLayer(auv(), East(), None, {}, BOUNDS_M, Picture())
        self.adrift = Adrift(self.layer, self.navigation)
        sets = self.layer.prepare([activity_set(("Going", ActivityType.GUIDANCE))])
        assert sets[FIX] is FIXING
        self.performed: tuple[int, ...] = ()
        self.now_s = 0.0

    def go_on(self, until: Callable[[], bool], most_s: float = 5000.0) -> float:
        """Time until something holds."""
        began_s = self.now_s
        while not until() and self.now_s < began_s + most_s:
            if self.now_s % 2.0 == 0.0:
                perceptions = self.layer.perceive(self.performed)
                self.performed = (FIX,) if perceptions[FIX].stimulus else (WORK,)
                self.layer.perform(self.performed)
            self.now_s += 1.0
            self.layer.act(1.0)
            self.layer.sense(self.now_s, ())
            assert math.hypot(*self.navigation.error_m) <= self.navigation.uncertainty_m + 1e-9
        return self.now_s - began_s

    @property
    def is_fixing(self) -> bool:
        return self.performed == (FIX,)


@given(st.lists(st.tuples(st.floats(0.0, 400.0), st.floats(0.0, 60.0)), max_size=30), st.floats(0.0, 0.2))
def test_no_error_is_greater_than_its_bound(ways: list[tuple[float, float]], drift: float) -> None:
    """Ways under water in any directions, each ended by a fix of any length; the first is as far off as the bound."""
    navigation = Navigation(NavigationTable(drift=drift), (), 20.0, lambda n: 2.4 * n * n)
    for number, (way_m, stay_s) in enumerate(ways):
        navigation.go((0.0, 0.0), way_m, 1.0)
        error_m = math.hypot(*navigation.error_m)
        assert error_m <= navigation.uncertainty_m * (1.0 + 1e-12) + 1e-12
        assert number or error_m == pytest.approx(navigation.uncertainty_m)
        navigation.depth_m = 0.0
        navigation.go((0.0, 0.0), 0.0, stay_s)
        navigation.depth_m = 20.0


@given(st.lists(st.tuples(st.floats(0.0, 400.0), st.floats(0.0, 60.0)), min_size=1, max_size=6))
def test_position_error_per_axis_stays_within_its_stated_spread(ways: list[tuple[float, float]]) -> None:
    """The mean square over directions drawn evenly, of each way anew: what it says is the most that it can be."""
    draw, squares = random.Random(7), list[float]()
    for _ in range(200):
        course = [math.tau * draw.random() for _ in ways]
        navigation = Navigation(NavigationTable(drift=0.02), (), 20.0, course.__getitem__)
        for way_m, stay_s in ways:
            navigation.depth_m = 0.0
            navigation.go((0.0, 0.0), 0.0, stay_s)
            navigation.depth_m = 20.0
            navigation.go((0.0, 0.0), way_m, 1.0)
        squares.append(navigation.error_m[0] ** 2)
    assert sum(squares) / len(squares) <= 1.4 * navigation.sigma_m**2 + 1e-12  # four times (1 / 2 / 200)^1/2
    if len(ways) == 1:
        assert sum(squares) / len(squares) >= 0.6 * navigation.sigma_m**2


def test_a_vehicle_surfaces_at_its_error_limit_and_resumes_its_work() -> None:
    """2 % of 500 m are 10 m; up and down 40 s each, and a stay of 24 s: ``takes_s`` says 104."""
    voyage = Voyage()
    voyage.go_on(lambda: voyage.is_fixing)
    assert voyage.layer.motion.distance_m == pytest.approx(500.0, abs=5.0)
    x_m = voyage.layer.motion.x_m
    took_s = voyage.go_on(lambda: not voyage.is_fixing)
    assert took_s == pytest.approx(takes_s(voyage.navigation.table, 20.0), abs=6.0)
    assert voyage.layer.depth_m == 20.0
    assert abs(voyage.layer.motion.x_m - x_m) < 3.0  # it had to brake
    assert voyage.navigation.uncertainty_m == pytest.approx(0.088 * 10.0, abs=0.2)
    assert voyage.layer.picture.body.uncertainty_m == voyage.navigation.uncertainty_m
    pose = Pose(0.0, 0.0, 20.0, 0.0, 1.0)
    pose = voyage.adrift.pose(pose)
    assert pose.sigma_m == pytest.approx(pose.uncertainty_m / math.sqrt(2.0)) != 0.0


def test_an_ascending_vehicle_reserves_the_layers_above_and_waits_if_occupied() -> None:
    """Between layers nobody sees anybody, unless one leaves its own."""
    voyage = Voyage()
    adrift = voyage.adrift
    assert adrift.column_m == (20.0, 20.0)
    voyage.go_on(lambda: voyage.is_fixing)
    assert adrift.column_m == (0.0, 20.0)
    depth_m = voyage.layer.depth_m
    for _ in range(30):
        voyage.layer.act(1.0, [Neighbour(3.0, 0.0, 0.0, 0.0)])
    assert voyage.layer.depth_m == depth_m > 19.0
    voyage.go_on(lambda: voyage.layer.depth_m == 0.0, 100.0)
    assert voyage.layer.depth_m == 0.0


class Placed:
    """A vehicle of a layer, for separation."""

    is_alive = True

    def __init__(self, layer: FunctionalLayer, node: int) -> None:
        self.functional = layer
        self.data = auv(name=f"AUV0{node}", node=node, depth_m=layer.data.depth_m)


def test_sonars_cover_the_water_column_of_an_ascending_vehicle() -> None:
    voyage, above = Voyage(), Voyage()
    above.layer.data = auv(depth_m=5.0)
    boat = Placed(above.layer, 1)
    columns_m = (lambda: voyage.adrift.column_m, lambda: (5.0, 5.0))
    separation = SeparationAcrossLayers(
        Separation([Placed(voyage.layer, 0), boat], 5.0), lambda node: columns_m[node]()
    )
    above.layer.motion.x_m = 20.0
    assert separation.look() == {}
    voyage.adrift.behaviour.depth_m = 0.0
    assert set(separation.look()) == {0, 1}
    above.layer.motion.x_m = 3.0
    above.layer.depth_m = 5.0
    separation.look()
    assert separation.conflicts(0.0) == []  # they are 15 m apart in depth
    voyage.layer.depth_m = 6.0
    separation.look()
    assert len(separation.conflicts(1.0)) == 1


def test_a_beacon_replaces_surfacing_where_it_is_faster() -> None:
    """From (500, 0) the rim of one at (560, 0) is 30 m off, 12 s; 40 s up. It is under water all the time."""
    voyage = Voyage(Beacon((560.0, 0.0), 30.0))
    voyage.go_on(lambda: voyage.is_fixing)
    took_s = voyage.go_on(lambda: not voyage.is_fixing)
    assert voyage.layer.depth_m == 20.0
    assert took_s < 60.0
    assert voyage.navigation.uncertainty_m < 3.0
    far = Voyage(Beacon((500.0, 400.0), 30.0))
    far.go_on(lambda: far.is_fixing)
    far.go_on(lambda: far.layer.depth_m < 1.0, 60.0)
    assert far.layer.depth_m < 1.0
