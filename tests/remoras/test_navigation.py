"""Navigation: growth and decay of position error; vehicles steer by estimates and collide by true positions."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import activity_set, auv

from missions.features.navigation import Adrift, Beacon, Navigation, NavigationTable
from remoras.activities import Activity, ActivityType
from remoras.behaviours import Behaviour, Homing
from remoras.database import VehicleData
from remoras.functional.layer import FunctionalLayer
from remoras.functional.vital import VITAL_SETS
from remoras.picture import Picture

NORTH = math.pi / 2.0
BOUNDS_M = (-1000.0, -1000.0, 1000.0, 1000.0)


def adrift(drift: float = 0.02, *beacons: Beacon, depth_m: float = 20.0) -> Navigation:
    """It drifts to the north on its first way, to the east on the next."""
    return Navigation(NavigationTable(drift=drift), beacons, depth_m, lambda n: NORTH if n == 0 else 0.0)


@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=50))
def test_position_error_grows_with_distance_whatever_the_time_step(ways_m: list[float]) -> None:
    navigation = adrift()
    for way_m in ways_m:
        navigation.go((0.0, 0.0), way_m, 1.0)
    assert navigation.error_m == pytest.approx((0.0, 0.02 * sum(ways_m)), abs=1e-9)


def test_position_error_near_a_beacon_decays_with_time_constant_fix_s() -> None:
    navigation = adrift(0.02, Beacon((100.0, 0.0), 30.0))
    navigation.go((0.0, 0.0), 500.0, 1.0)
    for _ in range(10):
        navigation.go((70.0, 0.0), 1.0, 1.0)
    assert navigation.error_m == pytest.approx((0.0, 10.0 / math.e))
    navigation.go((69.0, 0.0), 100.0, 1.0)
    assert navigation.error_m == pytest.approx((2.0, 10.0 / math.e))


class Shore:
    """A mission that goes to one place."""

    def behaviour_for(self, activity: Activity, data: VehicleData) -> Behaviour:
        return Homing((300.0, 0.0), 2.0, "Operational", data)


def test_a_vehicle_steers_by_its_estimated_position() -> None:
    """After 300 m it is off by 6 m to the north: so it stops 6 m to the south, taking it for the goal."""
    functional = FunctionalLayer(auv(), Shore(), None, {}, BOUNDS_M, Picture())
    Adrift(functional, adrift())
    functional.prepare([activity_set(("Homing", ActivityType.GUIDANCE))])
    functional.perform([len(VITAL_SETS)])
    for now_s in range(250):
        functional.act(1.0)
        functional.sense(float(now_s), ())
    motion, believed = functional.motion, functional.believed
    assert math.dist(believed.position_m, (300.0, 0.0)) <= 2.0
    assert believed.y_m - motion.y_m == pytest.approx(0.02 * motion.distance_m, rel=0.01)
    assert motion.distance_m == pytest.approx(300.0, abs=15.0)
    assert motion.y_m == pytest.approx(-6.0, abs=2.0)
    assert (believed.heading_rad, believed.speed_mps) == (motion.heading_rad, motion.speed_mps)
