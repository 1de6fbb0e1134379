"""Current: what runs where and when, and that vehicles make good their course in it, stay in it and cross in it."""

import math

import pytest
from crossings import KINDS, crossing, travel, traveller
from hypothesis import given
from hypothesis import strategies as st
from sampling import sampled

from missions.features import current as of_scenarios
from remoras.behaviours import Reference
from remoras.current import Current, through_water
from remoras.functional import guidance

ACROSS = Current(0.0, 0.6)
TIDE = Current(0.5, -0.3, tide_period_s=1200.0, tide_phase=0.1)
SHEARED = Current(0.8, 0.8, shear_depth_m=50.0)


@given(st.floats(0.0, 100.0), st.floats(0.0, 1e5))
def test_a_plain_current_is_the_same_everywhere_and_always(depth_m: float, now_s: float) -> None:
    assert Current(0.3, -0.2).at(depth_m, now_s) == pytest.approx((0.3, -0.2))


def test_shear_and_tide() -> None:
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


@pytest.mark.parametrize("current", [ACROSS, TIDE, SHEARED])
def test_the_track_over_ground_is_straight(current: Current) -> None:
    """Once it has speed: it starts at rest, and is carried off by less than a second's worth each second until then."""
    one = traveller(0, (-300.0, 0.0), (300.0, 0.0), current=current)
    strayed_m = []
    for now_s in range(250):
        one.functional.picture.body.now_s = float(now_s)
        one.functional.act(1.0)
        strayed_m.append(abs(one.functional.motion.y_m))
    assert max(strayed_m) < 4.0
    assert max(strayed_m[150:]) < 1.5


def test_without_heading_into_the_current_a_vehicle_is_carried_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """600 m at 2 m/s take 300 s, in which 0.6 m/s carry it 180 m aside; steering at its goal takes off some of it."""

    def unheeding(course: tuple[float, float], speed_mps: float, _: tuple[float, float]) -> tuple[float, float]:
        return speed_mps * course[0], speed_mps * course[1]

    monkeypatch.setattr(of_scenarios, "through_water", unheeding)
    one = traveller(0, (-300.0, 0.0), (300.0, 0.0), current=ACROSS)
    strayed_m = 0.0
    for now_s in range(250):
        one.functional.picture.body.now_s = float(now_s)
        one.functional.act(1.0)
        strayed_m = max(strayed_m, abs(one.functional.motion.y_m))
    assert 40.0 < strayed_m < 180.0


def test_who_is_to_stay_stays() -> None:
    """It heads into the current at its speed, and pays for it: 0.6 m/s cost 15 * 0.6^3 = 3.24 W beside 40 W."""
    one = traveller(0, (0.0, 0.0), (0.0, 0.0), current=ACROSS)
    for now_s in range(600):
        one.functional.picture.body.now_s = float(now_s)
        one.functional.act(1.0)
    motion = one.functional.motion
    assert math.hypot(motion.x_m, motion.y_m) < 2.0
    assert motion.speed_mps == pytest.approx(0.6)
    assert motion.energy_j == pytest.approx(600.0 * 43.24, rel=0.01)


EVERYWHERE = [(0.6, 0.0), (-0.6, 0.0), (0.0, -0.6), (0.35, 0.5), (-0.35, 0.5), (0.4, -0.3)]
"""Velocities towards the east, west, south and between."""


@pytest.mark.parametrize("flow", EVERYWHERE)
def test_what_only_keeps_its_speed_through_the_water_is_set_by_the_current(
    flow: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With no way through the water it drifts 100 c in 100 s, towards where the water goes: east is x, north is y."""
    monkeypatch.setattr(guidance, "advance", lambda *_: None)
    one = traveller(0, (10.0, -20.0), (500.0, 500.0), current=Current(*flow))
    for now_s in range(100):
        one.functional.picture.body.now_s = float(now_s)
        one.functional.act(1.0)
    assert one.functional.motion.x_m == pytest.approx(10.0 + 100.0 * flow[0])
    assert one.functional.motion.y_m == pytest.approx(-20.0 + 100.0 * flow[1])


@pytest.mark.parametrize("flow", EVERYWHERE)
def test_a_vehicle_stays_in_a_current_from_anywhere(flow: tuple[float, float]) -> None:
    one = traveller(0, (0.0, 0.0), (0.0, 0.0), current=Current(*flow))
    for now_s in range(600):
        one.functional.picture.body.now_s = float(now_s)
        one.functional.act(1.0)
    assert math.hypot(*one.functional.motion.position_m) < 2.0
    assert one.functional.motion.speed_mps == pytest.approx(math.hypot(*flow))


@pytest.mark.parametrize("flow", EVERYWHERE)
def test_the_way_takes_the_time_of_the_speed_over_ground(flow: tuple[float, float]) -> None:
    """Eastward at s = 2 m/s through the water, over ground at g = c_x + sqrt(s^2 - c_y^2), over the middle 200 s."""
    one = traveller(0, (-900.0, 0.0), (900.0, 0.0), current=Current(*flow))
    x_m = []
    for now_s in range(250):
        one.functional.picture.body.now_s = float(now_s)
        one.functional.act(1.0)
        x_m.append(one.functional.motion.x_m)
    ground_mps = flow[0] + math.sqrt(2.0**2 - flow[1] ** 2)
    assert (x_m[249] - x_m[49]) / 200.0 == pytest.approx(ground_mps, rel=0.01)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("current", [ACROSS, TIDE, SHEARED], ids=["across", "tide", "sheared"])
def test_crossing_under_current(kind: str, current: Current) -> None:
    found = travel(crossing(kind, 8, 1, current))
    assert (found.n_conflicts, found.n_arrived) == (0, 8)
    assert found.closest_m >= 5.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("current", [ACROSS, TIDE, SHEARED], ids=["across", "tide", "sheared"])
def test_crossing_under_current_without_the_rule(kind: str, current: Current, monkeypatch: pytest.MonkeyPatch) -> None:
    """They come too near, so it is the rule that keeps them apart there too."""
    monkeypatch.setattr(guidance, "clear_velocity", lambda *_: None)
    found = travel(crossing(kind, 16, 1, current))
    assert found.n_conflicts > 0
    assert found.closest_m < 5.0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("current", [ACROSS, TIDE, SHEARED], ids=["across", "tide", "sheared"])
@pytest.mark.parametrize("seeds", sampled([range(3), range(3, 10)], range(3)), ids=str)
def test_crossing_of_16_under_current_in_ten_seeds(kind: str, current: Current, seeds: range) -> None:
    for seed in seeds:
        found = travel(crossing(kind, 16, seed, current))
        assert (found.n_conflicts, found.n_arrived) == (0, 16)


@given(st.floats(0.05, 2.5), st.floats(-7.0, 7.0), st.floats(0.0, 1.2), st.floats(-7.0, 7.0), st.floats(100.0, 500.0))
def test_a_speed_over_ground_is_held_where_the_greatest_speed_allows_it(
    speed_mps: float, course_rad: float, flow_mps: float, flow_rad: float, range_m: float
) -> None:
    """Else the vehicle goes as fast as it can, straight over ground all the same."""
    flow = flow_mps * math.cos(flow_rad), flow_mps * math.sin(flow_rad)
    course = math.cos(course_rad), math.sin(course_rad)
    target_m = range_m * course[0], range_m * course[1]
    moves = traveller(0, (0.0, 0.0), target_m, current=Current(*flow)).functional.guidance
    assert isinstance(moves, of_scenarios.GuidanceInCurrent)
    moves.flow_mps, moves._is_over_ground = flow, True
    (x_m, y_m), water_mps = moves._upstream(target_m, speed_mps, 20.0)  # time to turn
    assert water_mps <= moves.most_mps + 1e-9
    if math.hypot(x_m, y_m) < 1e-6:
        return  # it lets itself be carried
    ahead = x_m / math.hypot(x_m, y_m), y_m / math.hypot(x_m, y_m)
    ground = water_mps * ahead[0] + flow[0], water_mps * ahead[1] + flow[1]
    if water_mps < moves.most_mps - 1e-9:
        assert ground == pytest.approx((speed_mps * course[0], speed_mps * course[1]), abs=1e-6)
    else:
        assert ground[1] * course[0] - ground[0] * course[1] == pytest.approx(0.0, abs=1e-6)


@given(st.floats(0.2, 1.8), st.floats(0.0, 1.2), st.floats(-7.0, 7.0), st.floats(-7.0, 7.0), st.floats(-7.0, 7.0))
def test_nobody_is_faster_over_ground_while_it_turns(
    limit_mps: float, flow_mps: float, flow_rad: float, course_rad: float, ahead_rad: float
) -> None:
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
