"""Reef with a passage: paths, walls, and rows of vehicles that yield."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from varied import Varied

from missions.features.passage import MOUTH_M, ReefPassage
from remoras.motion.avoidance import FASTEST_MPS, RECOVERY_S

ferried = Varied("ferry-passage", "reef.toml").flown
PASSAGE = ReefPassage(-42.5, 42.5, 10.0, 0.5)


def is_clear(at_m: tuple[float, float]) -> bool:
    """True for a place that is not in the reef."""
    return not PASSAGE.west_m <= at_m[0] <= PASSAGE.east_m or abs(at_m[1] - PASSAGE.y_m) <= PASSAGE.half_m


coordinates = st.floats(-150.0, 150.0)
places_m = st.tuples(coordinates, coordinates).filter(is_clear)


@given(places_m, places_m)
def test_a_way_never_leads_through_the_reef(from_m: tuple[float, float], to_m: tuple[float, float]) -> None:
    """Every leg is looked at metre by metre; in the passage it is straight, and before it on one side."""
    at_m = from_m
    for place_m in PASSAGE.way_m(from_m, to_m):
        n = max(1, int(math.dist(at_m, place_m)))
        for k in range(n + 1):
            x_m, y_m = (one + k / n * (other - one) for one, other in zip(at_m, place_m, strict=True))
            inside_m = min(x_m - PASSAGE.west_m, PASSAGE.east_m - x_m)
            assert inside_m < 1e-9 or abs(y_m - PASSAGE.y_m) <= PASSAGE.half_m + 1e-9
        at_m = place_m
    assert at_m == to_m
    assert PASSAGE.length_m(from_m, to_m) >= math.dist(from_m, to_m) - 1e-9


@given(places_m, st.floats(0.0, FASTEST_MPS), st.floats(0.0, math.tau))
def test_velocities_that_walls_allow_end_outside_the_reef(
    at_m: tuple[float, float], speed_mps: float, course: float
) -> None:
    """Of all velocities those that end in the reef within the time that walls look ahead are not allowed."""
    velocity = speed_mps * math.cos(course), speed_mps * math.sin(course)
    if all(wall.excess_mps(velocity) <= 0.0 for wall in PASSAGE.walls(at_m)):
        then_m = at_m[0] + velocity[0] * 0.1 * RECOVERY_S, at_m[1] + velocity[1] * 0.1 * RECOVERY_S
        inside_m = min(then_m[0] - PASSAGE.west_m, PASSAGE.east_m - then_m[0])
        assert inside_m <= 1e-6 or abs(then_m[1] - PASSAGE.y_m) <= PASSAGE.half_m + 1e-6


def test_ways_through_have_the_length_of_their_legs() -> None:
    """From 30 m north of the western mouth to the eastern one: 30 m, and 85 + 2 * 6 m."""
    west_m, east_m = PASSAGE.mouth_m(-1), PASSAGE.mouth_m(1)
    assert (west_m, east_m) == ((-42.5 - MOUTH_M, 10.0), (42.5 + MOUTH_M, 10.0))
    assert PASSAGE.length_m((west_m[0], 40.0), east_m) == pytest.approx(30.0 + 85.0 + 2.0 * MOUTH_M)


@pytest.mark.slow
@pytest.mark.parametrize("keys", [(), ("guidance.keeps_calls=true",)])
def test_no_vehicle_enters_the_reef(keys: tuple[str, ...]) -> None:
    """80 m of reef, a passage of 6 m of which half a metre to each side is left to the middle of a vehicle."""
    done = ferried(1, "scenario.duration_s=700.0", *keys)
    through = [row for row in done.recorder.trajectories if -42.0 < row[2] < 42.0]
    assert len({row[1] for row in through}) == 6
    assert max(abs(row[3]) for row in through) <= 0.8


@pytest.mark.slow
def test_opposed_rows_yield_and_keep_their_separation() -> None:
    done = ferried(2, "scenario.duration_s=2000.0")
    assert done.completed
    assert not [row for row in done.recorder.rows("faults") if row[2] == "conflict"]
