"""Reciprocal avoidance: velocity constraints, the linear program, and right of way."""

import math
import random

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from remoras.motion.avoidance import (
    GIVE_WAY,
    RIGHT_RAD,
    HalfPlane,
    Neighbour,
    _least_excess,
    _nearest,
    allowed_by,
    clear_velocity,
    time_to_pass_s,
)

# When somebody passes -----------------------------------------------------------------------------


def time_of(neighbour: Neighbour, own: tuple[float, float] = (0.0, 0.0)) -> float | None:
    return time_to_pass_s(neighbour, own, within_m=5.0, horizon_s=30.0)


offsets = st.floats(-60.0, 60.0)
velocities = st.floats(-3.0, 3.0)
courses, times = st.floats(-math.pi, math.pi), st.floats(0.1, 29.9)


@given(velocities, velocities, st.floats(0.1, 3.0), courses, times, st.floats(-7.0, 7.0))
def test_conflict_time_is_that_of_the_closest_approach(vx, vy, closing_mps, course, time_s, miss_m) -> None:
    """Set up backwards: at ``time_s`` the neighbour passes at ``miss_m``, square to the course it is seen on."""
    along, across = (math.cos(course), math.sin(course)), (-math.sin(course), math.cos(course))
    neighbour = Neighbour(
        miss_m * across[0] - closing_mps * along[0] * time_s,
        miss_m * across[1] - closing_mps * along[1] * time_s,
        vx + closing_mps * along[0],
        vy + closing_mps * along[1],
    )
    assume(abs(abs(miss_m) - 5.0) > 1e-6)
    found = time_of(neighbour, (vx, vy))
    assert found == (pytest.approx(time_s) if abs(miss_m) < 5.0 else None)


# What a neighbour allows --------------------------------------------------------------------------


def nearest_in_time_m(neighbour: Neighbour, velocity: tuple[float, float], until_s: float) -> float:
    """Least distance of two that keep their velocities."""
    vx, vy = neighbour.vx_mps - velocity[0], neighbour.vy_mps - velocity[1]
    squared = vx * vx + vy * vy
    at_s = 0.0 if squared == 0.0 else -(neighbour.dx_m * vx + neighbour.dy_m * vy) / squared
    at_s = min(until_s, max(0.0, at_s))
    return math.hypot(neighbour.dx_m + vx * at_s, neighbour.dy_m + vy * at_s)


@given(st.builds(Neighbour, offsets, offsets, velocities, velocities), velocities, velocities, st.data())
def test_vehicles_within_mutual_velocity_constraints_stay_apart(neighbour, vx, vy, data) -> None:
    """The theorem of the paper, for any two velocities on or within the half-planes of each other."""
    assume(math.hypot(neighbour.dx_m, neighbour.dy_m) > 5.01)
    plane = allowed_by(neighbour, (vx, vy), 5.0, 10.0)
    theirs = (neighbour.vx_mps, neighbour.vy_mps)
    other = allowed_by(Neighbour(-neighbour.dx_m, -neighbour.dy_m, vx, vy), theirs, 5.0, 10.0)
    chosen = []
    for one in (plane, other):
        along, inwards = data.draw(st.floats(-3.0, 3.0)), data.draw(st.floats(0.0, 3.0))
        chosen.append((one.x + along * one.dx - inwards * one.dy, one.y + along * one.dy + inwards * one.dx))
    moving = Neighbour(neighbour.dx_m, neighbour.dy_m, *chosen[1])
    assert nearest_in_time_m(moving, chosen[0], 10.0) >= 5.0 - 1e-6


# The linear program -------------------------------------------------------------------------------


def some_planes(draw: random.Random, n_planes: int) -> list[HalfPlane]:
    found = []
    for _ in range(n_planes):
        angle = draw.uniform(-math.pi, math.pi)
        found.append(HalfPlane(draw.uniform(-2, 2), draw.uniform(-2, 2), math.cos(angle), math.sin(angle)))
    return found


GRID = [(0.05 * column, 0.05 * row) for column in range(-40, 41) for row in range(-40, 41)]
"""Velocities up to 2 m/s, 0.05 m/s apart: no point of the disc is farther than 0.036 m/s from one in it, or its rim."""


@pytest.mark.parametrize("seed", range(8))
def test_the_linear_program_finds_the_nearest_or_least_bad_velocity(seed: int) -> None:
    """Against a fine grid of all velocities."""
    draw = random.Random(seed)
    planes = some_planes(draw, draw.randint(1, 7))
    wanted = draw.uniform(-2, 2), draw.uniform(-2, 2)
    velocities = [one for one in GRID if math.hypot(*one) <= 2.0]
    best, n_met = _nearest(planes, 2.0, wanted)
    if n_met == len(planes):
        assert max(plane.excess_mps(best) for plane in planes) <= 1e-9
        assert math.hypot(*best) <= 2.0 + 1e-9
        allowed = [one for one in velocities if all(plane.excess_mps(one) <= 0.0 for plane in planes)]
        assert all(math.dist(best, wanted) <= math.dist(one, wanted) + 1e-9 for one in allowed)
    else:
        assert not any(all(plane.excess_mps(one) < -0.05 for plane in planes) for one in velocities)
        best = _least_excess(planes, n_met, 2.0, best)
        least = min(max(plane.excess_mps(one) for plane in planes) for one in velocities)
        assert max(plane.excess_mps(best) for plane in planes) <= least + 1e-9
        assert math.hypot(*best) <= 2.0 + 1e-9


# Who does what ------------------------------------------------------------------------------------


def cleared(*neighbours: Neighbour, preferred: tuple[float, float] = (2.0, 0.0)) -> tuple[float, float] | None:
    return clear_velocity(preferred, preferred, neighbours, 5.0, 0.5, 2.0)


def test_guidance_is_unchanged_without_neighbours() -> None:
    assert cleared(Neighbour(50.0, 0.0, 2.0, 0.0)) is None  # goes the same way
    assert cleared(Neighbour(0.0, 30.0, 2.0, 0.0)) is None  # side by side
    assert cleared(Neighbour(-30.0, 0.0, 1.0, 0.0)) is None  # is left behind


def test_a_pass_within_four_separations_is_widened_to_the_right() -> None:
    """Head on but 15 m to the left: nothing has to be done, and yet the course turns to the right by 0.3 rad."""
    passed = cleared(Neighbour(55.0, 15.0, -2.0, 0.0))
    assert passed == pytest.approx((2.0 * math.cos(RIGHT_RAD), -2.0 * math.sin(RIGHT_RAD)))
    assert cleared(Neighbour(50.0, 25.0, -2.0, 0.0)) is None


def test_the_vehicle_with_the_other_on_its_right_yields() -> None:
    """They would meet in 5 s: the one slows down, the other one, which has it on its left, does not."""
    slow = cleared(Neighbour(10.0, -10.0, 0.0, 2.0))
    fast = cleared(Neighbour(10.0, 10.0, 0.0, -2.0))
    assert math.hypot(*slow) <= 2.0 * GIVE_WAY + 1e-9 < math.hypot(*fast)
