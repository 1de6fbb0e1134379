"""The functional layer: sensing, integrity and moving as decided."""

import math

import pytest
from samples import activity_set, auv

from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.behaviours import ADVANCING, DUE, Behaviour, Homing, ReturningHome, Standing, ZigzagExploring
from remoras.database import VehicleData
from remoras.functional.layer import FunctionalLayer
from remoras.sensors import MappingSensor, Neighbour, Seabed

SEABED = Seabed.of_areas(25.0, {"field": [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]})
BOUNDS_M = (-100.0, -100.0, 800.0, 800.0)
HOMING = activity_set(("Homing", ActivityType.GUIDANCE))
ZIGZAG = activity_set(("ZigzagExploring", ActivityType.GUIDANCE))
MAPPING = activity_set(("Mapping", ActivityType.PRODUCTIVE))


def behaviour_for(activity: Activity, data: VehicleData) -> Behaviour:
    match activity.name:
        case "Homing":
            return Homing((100.0, 0.0), 5.0, "Operational", data)
        case "ZigzagExploring":
            return ZigzagExploring([(10.0, 0.0), (40.0, 0.0)], data)
        case "ReturningHome":
            return ReturningHome(data)
    return Standing()


def layer(*sets: ActivitySet, **changes: object) -> FunctionalLayer:
    data = auv(**changes)
    sensor = MappingSensor(SEABED, data.swath_m, data.sensor_speed_mps)
    functional = FunctionalLayer(data, sensor, BOUNDS_M, behaviour_for)
    functional.prepare(sets)
    return functional


def test_a_vehicle_starts_where_its_data_say() -> None:
    assert layer(start_m=(12.0, 34.0)).motion.position_m == (12.0, 34.0)


def test_without_guidance_it_stays() -> None:
    functional = layer(MAPPING)
    functional.perform((MAPPING,), (0,))
    functional.act(10.0)
    assert functional.motion.position_m == (0.0, 0.0)
    assert functional.motion.energy_j == 400.0  # 40 W of hotel load


def test_guidance_moves_it() -> None:
    """At 0.5 m/s^2 up to 2 m/s, in steps of a second: 0.5 + 1 + 1.5 + 2 + 2 = 7 m in 5 s."""
    functional = layer(HOMING)
    functional.perform((HOMING,), (0,))
    for _ in range(5):
        functional.act(1.0)
    assert functional.motion.position_m == (7.0, 0.0)


def test_what_is_no_longer_decided_is_no_longer_done() -> None:
    functional = layer(HOMING)
    functional.perform((HOMING,), (0,))
    functional.act(1.0)
    functional.perform((HOMING,), ())
    functional.act(1.0)
    assert functional.motion.speed_mps == 0.0


def test_it_maps_only_while_it_is_to_map() -> None:
    functional = layer(ZIGZAG, MAPPING, start_m=(12.5, 12.5))
    functional.perform((ZIGZAG, MAPPING), (0,))
    assert functional.sense(0.0, ()) == []
    functional.perform((ZIGZAG, MAPPING), (0, 1))
    assert functional.sense(1.0, ()) == [(0, 0)]
    assert functional.sense(2.0, ()) == []


def test_what_is_under_way_goes_on_when_activities_are_chosen_anew() -> None:
    """The survey does not begin again because an objective was added to it."""
    functional = layer(ZIGZAG)
    functional.perform((ZIGZAG,), (0,))
    while functional.motion.x_m < 11.0:
        functional.act(1.0)
        functional.perceive((0,))
    functional.prepare((HOMING, ZIGZAG))
    functional.perform((HOMING, ZIGZAG), (1,))
    before_m = functional.motion.x_m
    functional.act(1.0)
    assert functional.motion.x_m > before_m


def test_perceptions_come_in_the_order_of_the_sets() -> None:
    functional = layer(MAPPING, HOMING)
    functional.perform((MAPPING, HOMING), (1,))
    assert functional.perceive((1,)) == [DUE, DUE]  # the first look at the way knows no progress yet
    functional.act(1.0)
    assert functional.perceive((1,)) == [DUE, ADVANCING]


# Integrity ----------------------------------------------------------------------------------------


def test_the_reserve_is_what_the_way_home_takes() -> None:
    """150 m at 1.5 m/s is 100 s at 40 + 15 * 1.5^3 = 90.625 W, so 9062.5 J; with a quarter on top of a megajoule,
    0.011328."""
    functional = layer(start_m=(0.0, 0.0))
    functional.motion.x_m, functional.motion.y_m = 90.0, 120.0
    functional.sense(5.0, ())
    assert functional.picture.now_s == 5.0
    assert functional.picture.reserve == pytest.approx(0.01132813, abs=1e-8)
    assert functional.picture.battery == 1.0


def test_the_battery_is_spent_by_time_and_by_sending() -> None:
    functional = layer(energy_j=1000.0)
    functional.act(10.0)  # 400 J
    functional.transmitted(500)  # at 0.01 J a bit
    functional.sense(10.0, ())
    assert functional.picture.battery == pytest.approx(0.595)
    assert not functional.exhausted
    functional.act(14.875)  # 595 J
    assert functional.exhausted


@pytest.mark.parametrize(
    ("position", "outside_m"),
    [((0.0, 0.0), 0.0), ((-100.0, 800.0), 0.0), ((-130.0, 0.0), 30.0), ((0.0, 810.0), 10.0), ((850.0, -101.0), 50.0)],
)
def test_how_far_outside_the_area_of_operations(position: tuple[float, float], outside_m: float) -> None:
    functional = layer(start_m=position)
    functional.sense(0.0, ())
    assert functional.picture.outside_m == outside_m


def test_the_most_urgent_collision_is_the_one_to_avoid() -> None:
    """Closest in 20 s of a horizon of 30 s: urgency 1 - 20 / 30; in 6 s from the left: 0.8."""
    functional = layer()
    functional.sense(0.0, [Neighbour(40.0, 0.0, -2.0, 0.0)])
    assert functional.picture.collision == pytest.approx((0.0, 1.0 / 3.0))
    both = [Neighbour(40.0, 0.0, -2.0, 0.0), Neighbour(0.0, 12.0, 0.0, -2.0)]
    for neighbours in (both, both[::-1]):
        functional.sense(1.0, neighbours)
        assert functional.picture.collision == pytest.approx((math.pi / 2.0, 0.8))
    functional.sense(2.0, [Neighbour(40.0, 0.0, 2.0, 0.0)])
    assert functional.picture.collision is None


def test_a_low_battery_calls_home() -> None:
    home = activity_set(("ReturningHome", ActivityType.GUIDANCE), role=None, kind=ActivityKind.VITAL)
    functional = layer(home, energy_j=10_000.0)
    functional.motion.x_m = 150.0  # 9062.5 J to go home: with a quarter on top, more than there is
    functional.sense(0.0, ())
    assert functional.perceive(()) == [DUE]
    functional.motion.x_m = 75.0
    functional.sense(1.0, ())
    assert functional.perceive(())[0].stimulus == 0.0
