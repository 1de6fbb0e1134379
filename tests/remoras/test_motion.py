"""Kinematics: within the limits of the vehicle, without overshooting the target."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from samples import AUV, auv

from remoras.motion import Motion, advance, wrapped

coordinates = st.floats(-1000.0, 1000.0)
points = st.tuples(coordinates, coordinates)
headings = st.floats(-math.pi, math.pi, exclude_min=True)
speeds = st.floats(0.0, 3.0)
ticks = st.floats(0.01, 1.0)
motions = st.builds(Motion, coordinates, coordinates, headings, speeds)
ROUNDING = 1e-9


@given(motions, points, speeds, ticks)
@example(Motion(1.0, 2.82e-271, 2.8653956948664026, 0.0), (0.0, 0.0), 1.0, 1.0)  # a sum just beyond pi
def test_a_step_keeps_the_limits(motion: Motion, target: tuple[float, float], speed_mps: float, dt_s: float) -> None:
    before = Motion(motion.x_m, motion.y_m, motion.heading_rad, motion.speed_mps)
    range_m = math.dist(before.position_m, target)
    advance(motion, AUV, target, speed_mps, dt_s)
    # at most 0.5 rad/s of turn and 0.5 m/s^2 of change, and never faster than was asked
    assert abs(wrapped(motion.heading_rad - before.heading_rad)) <= 0.5 * dt_s + ROUNDING
    assert abs(motion.speed_mps - before.speed_mps) <= 0.5 * dt_s + ROUNDING
    assert -ROUNDING <= motion.speed_mps <= max(before.speed_mps, speed_mps) + ROUNDING
    assert -math.pi < motion.heading_rad <= math.pi
    # the way is the way that counts, and it does not lead past the target
    way_m = math.dist(before.position_m, motion.position_m)
    assert way_m == pytest.approx(motion.distance_m, abs=1e-6)
    assert motion.distance_m <= motion.speed_mps * dt_s + ROUNDING
    if speed_mps > 0.0:
        assert motion.distance_m <= range_m + ROUNDING
    assert motion.energy_j >= 40.0 * dt_s - ROUNDING  # the hotel load is always drawn


@given(headings, points.filter(lambda p: math.hypot(*p) > 1.0), st.floats(0.1, 2.0))
def test_a_target_ahead_is_reached_exactly(heading: float, start: tuple[float, float], speed_mps: float) -> None:
    """A vehicle that heads for a target comes ever nearer and stops on it: the last step is cut short."""
    motion = Motion(*start, heading, speed_mps)
    motion.heading_rad = math.atan2(-start[1], -start[0])
    last_m = math.hypot(*start)
    for _ in range(int(last_m / speed_mps) + 2):
        advance(motion, AUV, (0.0, 0.0), speed_mps, 1.0)
        to_go_m = math.hypot(*motion.position_m)
        assert to_go_m <= last_m + ROUNDING
        last_m = to_go_m
    assert last_m == pytest.approx(0.0, abs=1e-6)
    assert motion.distance_m == pytest.approx(math.hypot(*start), abs=1e-6)


@given(
    motions.filter(lambda motion: math.hypot(*motion.position_m) < 200.0) | st.just(Motion(0.0, 5.0, 0.0, 2.0)),
    st.floats(0.03, 1.0),
    st.floats(0.1, 1.0),
    st.floats(0.5, 3.0),
    st.sampled_from([0.1, 0.5, 1.0]),
)
def test_no_target_is_orbited(motion: Motion, turn: float, acceleration: float, speed_mps: float, dt_s: float) -> None:
    """A target inside the turning circle, of radius speed / turn rate, would never be met at full speed. Generously:
    twice the straight way, a full turn, and stopping and starting once and a half."""
    motion = Motion(*motion.position_m, motion.heading_rad, min(motion.speed_mps, speed_mps))
    data = auv(turn_rate_radps=turn, acceleration_mps2=acceleration)
    direct_s = math.hypot(*motion.position_m) / speed_mps
    remaining_s = 2.0 * (direct_s + 2.0 * math.pi / turn + 3.0 * speed_mps / acceleration)
    while math.hypot(*motion.position_m) > 1.0:
        advance(motion, data, (0.0, 0.0), speed_mps, dt_s)
        remaining_s -= dt_s
        assert remaining_s > 0.0


@given(st.lists(st.tuples(points, speeds), min_size=1, max_size=30), st.sampled_from([0.1, 0.5, 1.0]))
def test_energy_is_the_integral_of_power(legs: list[tuple[tuple[float, float], float]], dt_s: float) -> None:
    """P = 40 W + 15 W/(m/s)^3 v^3, summed over the speeds of the steps."""
    motion = Motion(0.0, 0.0)
    expected_j = []
    for target, speed_mps in legs:
        advance(motion, AUV, target, speed_mps, dt_s)
        expected_j.append((40.0 + 15.0 * motion.speed_mps**3) * dt_s)
    assert motion.energy_j == pytest.approx(math.fsum(expected_j), rel=1e-12)
