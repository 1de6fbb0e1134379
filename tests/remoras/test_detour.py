"""A vehicle goes round stationary ones; close to its target it waits."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from sample_vehicles import AUV

from exchange.arithmetic import length
from remoras.behaviours import Reference
from remoras.functional.guidance import Guidance
from remoras.motion import Motion
from remoras.motion.attraction import GuidanceTable
from remoras.motion.avoidance import Bounds, Neighbour

Point = tuple[float, float]
SEPARATION_M = 5.0
BOUNDS_M = (-500.0, -500.0, 500.0, 500.0)


def sails(
    to_m: Point, standing_m: tuple[Point, ...], ticks: int = 400, bounds_m: Bounds = BOUNDS_M
) -> tuple[Motion, float]:
    """Let a vehicle head from (0, 0) for a place, past others that stand; and how near it came to any (m)."""
    motion, nearest_m = Motion(0.0, 0.0), math.inf
    guidance = Guidance(motion, AUV, bounds_m, GuidanceTable(separation_m=SEPARATION_M))
    for tick in range(ticks):
        seen = [Neighbour(x_m - motion.x_m, y_m - motion.y_m, 0.0, 0.0) for x_m, y_m in standing_m]
        guidance.move(Reference(to_m, 1.5), seen, {}, float(tick), 1.0)
        assert bounds_m[1] - 1.0 < motion.y_m
        nearest_m = min([nearest_m, *(length(x_m - motion.x_m, y_m - motion.y_m) for x_m, y_m in standing_m)])
    return motion, nearest_m


def off_m(motion: Motion, to_m: Point) -> float:
    return length(motion.x_m - to_m[0], motion.y_m - to_m[1])


@settings(max_examples=100, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(5.51, 7.0), st.floats(0.6, 1.4), st.integers(2, 4), st.floats(-math.pi, math.pi))
def test_no_pocket_of_stationary_vehicles_traps_a_vehicle(middle_rad, away_m, apart_rad, n, course_rad) -> None:
    """They stand in an arc before it, no wider than a half circle, and beyond the margin of 5.5 m that it keeps."""
    spread = min(apart_rad * (n - 1), math.pi)
    angles = [course_rad + middle_rad - spread / 2.0 + spread * one / (n - 1) for one in range(n)]
    standing_m = tuple((away_m * math.cos(angle), away_m * math.sin(angle)) for angle in angles)
    to_m = 80.0 * math.cos(course_rad), 80.0 * math.sin(course_rad)
    motion, nearest_m = sails(to_m, standing_m, 500)
    assert off_m(motion, to_m) < 1.0
    assert nearest_m > 0.9 * SEPARATION_M


GAP = (8.0, 4.8), (8.0, -4.8)


def test_vehicle_without_room_counts_the_time_until_others_leave() -> None:
    """The gap of 9.6 m before it is too narrow, and nearer than 20 m to its target a vehicle makes no detour."""
    guidance = Guidance(Motion(0.0, 0.0), AUV, BOUNDS_M, GuidanceTable(separation_m=SEPARATION_M))

    def stopped_s(from_s: int, until_s: int, *standing_m: Point) -> float:
        for tick in range(from_s, until_s):
            at = guidance.motion
            seen = [Neighbour(x_m - at.x_m, y_m - at.y_m, 0.0, 0.0) for x_m, y_m in standing_m]
            guidance.move(Reference((15.0, 0.0), 1.5), seen, {}, float(tick), 1.0)
        return guidance.stopped_s

    before_s = stopped_s(0, 60, *GAP)
    assert 30.0 < before_s < 60.0
    assert stopped_s(60, 70, *GAP) == before_s + 10.0
    assert stopped_s(70, 71, (100.0, 0.0)) == 0.0
