"""A vehicle that others leave standing goes round them; one that has all but arrived waits."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_vehicles import AUV

from exchange.arithmetic import length
from remoras.attraction import GuidanceConstants
from remoras.avoidance import Bounds, Neighbour
from remoras.behaviours import Reference
from remoras.functional import guidance
from remoras.functional.guidance import Guidance
from remoras.motion import Motion

Point = tuple[float, float]
SEPARATION_M = 5.0
BOUNDS_M = (-500.0, -500.0, 500.0, 500.0)
POCKET_M = (1.1, 5.5), (5.6, -0.8)
"""Two that stand before one that heads north-east, as vehicles lay that had met."""


def sails(
    to_m: Point, standing_m: tuple[Point, ...], ticks: int = 400, bounds_m: Bounds = BOUNDS_M
) -> tuple[Motion, float]:
    """Let a vehicle head from (0, 0) for a place, past others that stand; and how near it came to any (m)."""
    motion, nearest_m = Motion(0.0, 0.0), math.inf
    guidance = Guidance(motion, AUV, bounds_m, GuidanceConstants(SEPARATION_M))
    for tick in range(ticks):
        seen = [Neighbour(x_m - motion.x_m, y_m - motion.y_m, 0.0, 0.0) for x_m, y_m in standing_m]
        guidance.move(Reference(to_m, 1.5), seen, {}, float(tick), 1.0)
        assert bounds_m[1] - 1.0 < motion.y_m
        nearest_m = min([nearest_m, *(length(x_m - motion.x_m, y_m - motion.y_m) for x_m, y_m in standing_m)])
    return motion, nearest_m


def off_m(motion: Motion, to_m: Point) -> float:
    return length(motion.x_m - to_m[0], motion.y_m - to_m[1])


def test_it_goes_round_those_who_stand_in_its_way() -> None:
    motion, nearest_m = sails((60.0, 60.0), POCKET_M)
    assert off_m(motion, (60.0, 60.0)) < 1.0
    assert nearest_m > 0.9 * SEPARATION_M


def test_without_a_detour_it_stands_there_for_good(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guidance, "STUCK_S", math.inf)
    motion, _ = sails((60.0, 60.0), POCKET_M)
    assert off_m(motion, (60.0, 60.0)) > 75.0


@pytest.mark.parametrize(("to_go_m", "left_mps", "turns"), [(21.0, 0.0, True), (19.0, 0.0, False), (21.0, 0.2, False)])
def test_it_begins_where_nothing_is_left_of_a_long_way(to_go_m: float, left_mps: float, turns: bool) -> None:
    """Who is nearly there waits: somebody stands where it heads for."""
    way, goal = guidance.Detour(SEPARATION_M), (1.0, 0.0)
    for _ in range(20):
        assert way.turned(goal) is goal
        way.note(goal, (left_mps, 0.0), to_go_m, 1.0)
    assert (way.turned(goal) == (0.0, -0.5)) is turns


def test_each_detour_is_another_and_between_them_it_heads_for_its_target() -> None:
    way, found = guidance.Detour(SEPARATION_M), []
    for _ in range(92):
        way.note((1.0, 0.0), (0.0, 0.0), 100.0, 1.0)
        found.append(way.turned((1.0, 0.0)))
    for first, turned in ((19, (0.0, -0.5)), (42, (0.0, 0.5)), (65, (-0.5, 0.0)), (88, (0.0, -0.5))):
        assert found[first - 1 : first + 4] == [(1.0, 0.0), turned, turned, turned, (1.0, 0.0)]


def test_it_stays_within_the_area_of_operations() -> None:
    """It would go round by the right, where the border is; so it goes by the left."""
    standing_m = tuple((x_m, y_m - 0.5) for x_m, y_m in POCKET_M)
    motion, _ = sails((60.0, 60.0), standing_m, bounds_m=(-500.0, -2.0, 500.0, 500.0))
    assert off_m(motion, (60.0, 60.0)) < 1.0


@settings(max_examples=100, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(5.51, 7.0), st.floats(0.6, 1.4), st.integers(2, 4), st.floats(-math.pi, math.pi))
def test_no_pocket_of_standing_vehicles_keeps_it(
    middle_rad: float, away_m: float, apart_rad: float, n: int, course_rad: float
) -> None:
    """They stand in an arc before it, no wider than a half circle, and beyond the margin of 5.5 m that it keeps."""
    spread = min(apart_rad * (n - 1), math.pi)
    angles = [course_rad + middle_rad - spread / 2.0 + spread * one / (n - 1) for one in range(n)]
    standing_m = tuple((away_m * math.cos(angle), away_m * math.sin(angle)) for angle in angles)
    to_m = 80.0 * math.cos(course_rad), 80.0 * math.sin(course_rad)
    motion, nearest_m = sails(to_m, standing_m, 500)
    assert off_m(motion, to_m) < 1.0
    assert nearest_m > 0.9 * SEPARATION_M
