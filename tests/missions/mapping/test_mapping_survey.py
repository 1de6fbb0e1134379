"""Zigzag surveys: the grid of the REMORAS paper, and areas of any convex shape."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from missions.mapping.sensors import Seabed
from missions.mapping.survey import Point, contains, length_m, rows, zigzag

MIDFIELD = [(100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0)]


def test_the_grid_of_table_ii() -> None:
    """Table II: (112.5,112.5) (137.5,112.5) ... (337.5,112.5), the next row at 137.5, up to (337.5,337.5)."""
    waypoints = zigzag(MIDFIELD, 25.0, (0.0, 0.0))
    levels = [112.5 + 25.0 * number for number in range(10)]
    assert levels[-1] == 337.5
    assert [sorted(row) for row in zip(waypoints[::2], waypoints[1::2], strict=True)] == [
        [(112.5, y), (337.5, y)] for y in levels
    ]
    assert waypoints[0] == (112.5, 112.5)
    assert {math.dist(a, b) for a, b in pairwise(waypoints)} == {225.0, 25.0}


def test_the_length_of_the_survey() -> None:
    """Ten rows of 225 m and nine steps of 25 m: 2475 m."""
    assert length_m(zigzag(MIDFIELD, 25.0, (0.0, 0.0))) == 2475.0


@pytest.mark.parametrize(
    ("start", "first"),
    [((0.0, 0.0), (112.5, 112.5)), ((500.0, 0.0), (337.5, 112.5)), ((0.0, 500.0), (112.5, 337.5)),
     ((500.0, 500.0), (337.5, 337.5))],
)  # fmt: skip
def test_it_begins_at_the_corner_nearest_to_the_vehicle(start: Point, first: Point) -> None:
    assert zigzag(MIDFIELD, 25.0, start)[0] == first


def test_rows_run_along_the_longer_side() -> None:
    assert rows([(0, 0), (10, 0), (10, 100), (0, 100)], 10.0) == [((5.0, 5.0), (5.0, 95.0))]
    assert rows([(0, 0), (100, 0), (100, 10), (0, 10)], 10.0) == [((5.0, 5.0), (95.0, 5.0))]


def test_a_width_that_is_no_multiple_of_the_swath_is_shared_out() -> None:
    """60 m in swaths of 25 m: three rows, 20 m apart, the outer ones 10 m from the border."""
    assert [begin[1] for begin, _ in rows([(0, 0), (100, 0), (100, 60), (0, 60)], 25.0)] == [10.0, 30.0, 50.0]


# Any convex polygon -------------------------------------------------------------------------------


@st.composite
def convex_polygons(draw: st.DrawFn) -> list[Point]:
    """Corners on an ellipse, in order: always convex."""
    angles = sorted(draw(st.lists(st.integers(0, 359), min_size=3, max_size=9, unique=True)))
    across, along = draw(st.floats(20.0, 120.0)), draw(st.floats(20.0, 120.0))
    x, y = draw(st.floats(-500.0, 500.0)), draw(st.floats(-500.0, 500.0))
    return [(x + across * math.cos(math.radians(a)), y + along * math.sin(math.radians(a))) for a in angles]


def to_lines_m(a: np.ndarray, b: np.ndarray, points: np.ndarray, ends: bool) -> np.ndarray:
    """Distance of every point from the nearest of the lines a-b: as far as they go, or without ``ends``."""
    way = b - a
    length = np.maximum((way**2).sum(axis=1), 1e-12)
    along = ((points[:, None] - a) * way).sum(axis=2) / length
    along = along if not ends else np.clip(along, 0.0, 1.0)
    return np.linalg.norm(a + along[..., None] * way - points[:, None], axis=2).min(axis=1)


@given(convex_polygons(), st.floats(8.0, 40.0), st.tuples(st.floats(-600, 600), st.floats(-600, 600)))
def test_a_survey_sweeps_every_cell_that_its_inset_allows(corners: list[Point], swath_m: float, start: Point) -> None:
    """Rows are at most a swath s apart, so every cell has one within s/2 beside it. Around a cell s/sqrt(2) from the
    border the row at s/2 goes on inside the area for sqrt(s^2/2 - s^2/4) = s/2 to both sides, which is just the
    inset. So every such cell is passed at s/2 or less."""
    seabed = Seabed.of_areas(swath_m / 2.0, {"area": corners})
    centres = (np.array(list(seabed.cells)).reshape(-1, 2) + 0.5) * seabed.cell_m
    border, way = np.array(corners), np.array(zigzag(corners, swath_m, start))
    deep = centres[to_lines_m(border, np.roll(border, -1, axis=0), centres, False) >= swath_m / math.sqrt(2.0) + 1e-6]
    assert np.all(to_lines_m(way[::2], way[1::2], deep, True) <= swath_m / 2.0 + 1e-6)


@given(convex_polygons(), st.floats(5.0, 40.0), st.tuples(st.floats(-600, 600), st.floats(-600, 600)))
def test_a_zigzag_runs_every_row_once_and_stays_inside(corners: list[Point], swath_m: float, start: Point) -> None:
    lines = rows(corners, swath_m)
    waypoints = zigzag(corners, swath_m, start)
    run = list(zip(waypoints[::2], waypoints[1::2], strict=True))
    assert sorted(tuple(sorted(row)) for row in run) == sorted(tuple(sorted(line)) for line in lines)
    # to and fro; a row that the inset leaves no length has no direction
    axis = 0 if all(begin[1] == end[1] for begin, end in lines) else 1
    forth = [(end[axis] - begin[axis]) * (-1) ** number for number, (begin, end) in enumerate(run)]
    assert all(way > -1e-6 for way in forth) or all(way < 1e-6 for way in forth)
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    for x, y in waypoints:
        assert min(xs) - 1e-6 <= x <= max(xs) + 1e-6
        assert min(ys) - 1e-6 <= y <= max(ys) + 1e-6


@given(convex_polygons(), st.floats(-900.0, 900.0), st.floats(-900.0, 900.0))
def test_inside_is_on_one_side_of_every_side(corners: list[Point], x: float, y: float) -> None:
    turns = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]
    assume(all(abs(turn) > 1e-6 for turn in turns))  # not on the border itself
    assert contains(corners, (x, y)) == all(turn > 0.0 for turn in turns)
