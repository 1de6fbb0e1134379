"""Water current: its field over depth and time, and vehicles that keep course and position in it."""

import math

import pytest
from crossings import KINDS, crossing, travel, traveller
from hypothesis import given
from hypothesis import strategies as st

from missions.features.current import Current, through_water
from remoras.behaviours import Reference

ACROSS = Current(0.0, 0.6)
TIDE = Current(0.5, -0.3, tide_period_s=1200.0, tide_phase=0.1)
SHEARED = Current(0.8, 0.8, shear_depth_m=50.0)


def test_current_varies_with_depth_and_tide() -> None:
    """At 20 of 50 m three fifths are left; a quarter of a period is slack water, half of it turns the current."""
    assert SHEARED.at(20.0, 0.0) == pytest.approx((0.48, 0.48))
    assert SHEARED.at(60.0, 0.0) == (0.0, 0.0)
    tide = Current(1.0, 0.0, tide_period_s=400.0)
    assert [tide.at(0.0, now_s)[0] for now_s in (0.0, 100.0, 200.0, 300.0, 400.0)] == pytest.approx([1, 0, -1, 0, 1])
    assert Current(1.0, 0.0, tide_period_s=400.0, tide_phase=0.5).at(0.0, 0.0)[0] == pytest.approx(-1.0)


courses, speeds = st.floats(-math.pi, math.pi), st.floats(0.0, 1.4)


@given(courses, courses, speeds)
def test_the_course_is_made_good_at_full_speed(course: float, towards: float, flow_mps: float) -> None:
    """Any current slower than the vehicle: what is left over ground goes along the course."""
    unit, flow = (math.cos(course), math.sin(course)), (flow_mps * math.cos(towards), flow_mps * math.sin(towards))
    water = through_water(unit, 1.5, flow)
    ground = water[0] + flow[0], water[1] + flow[1]
    assert math.hypot(*water) == pytest.approx(1.5)
    assert ground[0] * unit[1] - ground[1] * unit[0] == pytest.approx(0.0, abs=1e-9)
    assert ground[0] * unit[0] + ground[1] * unit[1] > 0.0


def test_a_dwelling_vehicle_holds_its_position_in_current() -> None:
    """It heads into the current at its speed, and pays for it: 0.6 m/s cost 15 * 0.6^3 = 3.24 W beside 40 W."""
    one = traveller(0, (0.0, 0.0), (0.0, 0.0), current=ACROSS)
    for now_s in range(600):
        one.functional.picture.body.now_s = float(now_s)
        one.functional.act(1.0)
    motion = one.functional.motion
    assert math.hypot(motion.x_m, motion.y_m) < 2.0
    assert motion.speed_mps == pytest.approx(0.6)
    assert motion.energy_j == pytest.approx(600.0 * 43.24, rel=0.01)


@pytest.mark.parametrize(("kind", "current"), zip(KINDS, (ACROSS, TIDE, SHEARED), strict=True), ids=str)
def test_crossing_under_current(kind: str, current: Current) -> None:
    found = travel(crossing(kind, 8, 1, current))
    assert (found.n_conflicts, found.n_arrived) == (0, 8)
    assert found.closest_m >= 5.0


@given(st.floats(0.2, 1.8), st.floats(0.0, 1.2), st.floats(-7.0, 7.0), st.floats(-7.0, 7.0), st.floats(-7.0, 7.0))
def test_ground_speed_does_not_grow_during_a_turn(limit_mps, flow_mps, flow_rad, course_rad, ahead_rad) -> None:
    """From any heading to any course, where the water alone is not faster, and it brakes as fast as it likes."""
    flow_mps = min(flow_mps, limit_mps)
    flow = flow_mps * math.cos(flow_rad), flow_mps * math.sin(flow_rad)
    target_m = 400.0 * math.cos(course_rad), 400.0 * math.sin(course_rad)
    layer = traveller(0, (0.0, 0.0), target_m, current=Current(*flow), acceleration_mps2=100.0).functional
    moves = layer.guidance
    layer.motion.heading_rad = ahead_rad
    for tick in range(12):
        moves.move(Reference(target_m, limit_mps, is_over_ground=True), (), {}, float(tick), 0.5)
        assert moves.ground_mps <= limit_mps + 1e-9
