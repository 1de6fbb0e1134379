"""Surveys: paths over an area and over its remaining cells, and their duration as jobs."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from sample_vehicles import AUV, WITHOUT_SENSOR

from missions.mapping.jobs import Ground, Survey, SurveyJob, ground_of
from missions.meeting.survey import Point, contains, length_m, rows, to_and_fro
from remoras.work import Outlook

MIDFIELD = [(100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0)]


def test_waypoints_equal_those_of_table_ii() -> None:
    """Table II: (112.5,112.5) (137.5,112.5) ... (337.5,112.5), the next row at 137.5, up to (337.5,337.5)."""
    waypoints = to_and_fro(rows(MIDFIELD, 25.0, 12.5), (0.0, 0.0))
    levels = [112.5 + 25.0 * number for number in range(10)]
    assert levels[-1] == 337.5
    assert [sorted(row) for row in zip(waypoints[::2], waypoints[1::2], strict=True)] == [
        [(112.5, y), (337.5, y)] for y in levels
    ]
    assert waypoints[0] == (112.5, 112.5)
    assert {math.dist(a, b) for a, b in pairwise(waypoints)} == {225.0, 25.0}


def test_rows_are_evenly_spaced_over_any_width() -> None:
    """60 m in swaths of 25 m: three rows, 20 m apart, the outer ones 10 m from the border."""
    assert [begin[1] for begin, _ in rows([(0, 0), (100, 0), (100, 60), (0, 60)], 25.0, 12.5)] == [10.0, 30.0, 50.0]


@given(st.floats(50.0, 900.0), st.floats(50.0, 900.0), st.floats(20.0, 120.0))
def test_rows_cover_a_rectangle_completely(width_m: float, height_m: float, apart_m: float) -> None:
    corners_m = [(0.0, 0.0), (width_m, 0.0), (width_m, height_m), (0.0, height_m)]
    points_m = to_and_fro(rows(corners_m, apart_m, 0.0), corners_m[0])
    across = sorted({y for _, y in points_m} if width_m >= height_m else {x for x, _ in points_m})
    edges = [0.0, *across, min(width_m, height_m) if width_m != height_m else height_m]
    assert across[0] <= apart_m / 2.0 + 1e-6
    assert edges[-1] - across[-1] <= apart_m / 2.0 + 1e-6
    assert all(after - before <= apart_m + 1e-6 for before, after in pairwise(across))


# Any convex polygon -------------------------------------------------------------------------------


@st.composite
def convex_polygons(draw: st.DrawFn) -> list[Point]:
    """Corners on an ellipse, in order: always convex."""
    angles = sorted(draw(st.lists(st.integers(0, 359), min_size=3, max_size=8, unique=True)))
    across, along = draw(st.floats(20.0, 120.0)), draw(st.floats(20.0, 120.0))
    x, y = draw(st.floats(-500.0, 500.0)), draw(st.floats(-500.0, 500.0))
    return [(x + across * math.cos(math.radians(a)), y + along * math.sin(math.radians(a))) for a in angles]


GROUNDS = st.builds(ground_of, convex_polygons().map(tuple), st.sampled_from([8.0, 15.0, 25.0]))


@given(convex_polygons(), st.floats(5.0, 40.0), st.tuples(st.floats(-600, 600), st.floats(-600, 600)))
def test_a_zigzag_runs_every_row_once_and_stays_inside(corners: list[Point], swath_m: float, start: Point) -> None:
    lines = rows(corners, swath_m, swath_m / 2.0)
    waypoints = to_and_fro(lines, start)
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
def test_point_inside_is_left_of_every_side(corners: list[Point], x: float, y: float) -> None:
    turns = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]
    assume(all(abs(turn) > 1e-6 for turn in turns))  # not on the border itself
    assert contains(corners, (x, y)) == all(turn > 0.0 for turn in turns)


SWATHS_M = st.sampled_from([10.0, 25.0, 30.0, 60.0])


def some(ground: Ground, draw: st.DataObject) -> int:
    return draw.draw(st.integers(0, ground.work)) if ground.work else 0


def run_m(survey: Survey, left: int) -> list[tuple[Point, Point]]:
    """Rows of a vehicle that replans at the end of each, without further information."""
    at_m, found = (0.0, 0.0), []
    while ways := survey.ways(left):
        way = min(ways, key=lambda way: math.dist(way.first_m, at_m) + way.length_m)
        found.append(way.ends_m)
        left &= ~survey.rows[way.row].cells
        at_m = way.ends_m[1]
    return found


def to_line_m(begin: Point, end: Point, point: Point) -> float:
    """Distance of a point from a line that ends."""
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    length2 = dx * dx + dy * dy
    part = ((point[0] - begin[0]) * dx + (point[1] - begin[1]) * dy) / length2 if length2 else 0.0
    part = min(1.0, max(0.0, part))
    return math.dist(point, (begin[0] + part * dx, begin[1] + part * dy))


@given(GROUNDS, SWATHS_M, st.data())
def test_rows_cover_all_remaining_reachable_cells(ground: Ground, swath_m: float, draw: st.DataObject) -> None:
    survey, left = ground.survey(swath_m), some(ground, draw)
    lines = run_m(survey, left)
    wanted = [index for index in range(len(ground.cells)) if left & survey.reach & 1 << index]
    assert bool(lines) == bool(wanted)
    for index in wanted:
        centre_m = ground.centre_m(index)
        assert min(to_line_m(*line, centre_m) for line in lines) <= swath_m / 2.0 + 1e-5


@given(GROUNDS, SWATHS_M)
def test_rows_of_an_untouched_area_alternate_from_each_end(ground: Ground, swath_m: float) -> None:
    survey = ground.survey(swath_m)
    lines = [row.ends_m for row in survey.rows]
    if survey.reach and all(row.cells for row in survey.rows):
        for way in survey.ways(ground.work):
            points = to_and_fro(lines, way.first_m)
            assert (way.first_m, way.last_m) == (points[0], points[-1])
            assert way.length_m == pytest.approx(length_m(points))


@given(GROUNDS, SWATHS_M, st.data(), st.tuples(st.floats(-300, 300), st.floats(-300, 300)))
def test_fewer_remaining_cells_never_take_longer(
    ground: Ground, swath_m: float, draw: st.DataObject, at_m: Point
) -> None:
    """From one place at one speed: the longer path passes all that the shorter one must cover."""
    survey, more = ground.survey(swath_m), some(ground, draw)
    less = more & draw.draw(st.integers(0, max(1, ground.work)))

    def way_m(left: int) -> float:
        return min((math.dist(way.first_m, at_m) + way.length_m for way in survey.ways(left)), default=0.0)

    assert way_m(less) <= way_m(more) + 1e-6


SQUARE = SurveyJob("square", ((100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0)))


def test_vehicle_without_sensor_or_depth_is_unable() -> None:
    """The vehicle stands 100 m."""
    deep, too_deep = replace(SQUARE, depth_m=100.0), replace(SQUARE, depth_m=100.5)
    here = Outlook(0.0, (0.0, 0.0))
    assert deep.after(here, AUV) == SQUARE.after(here, AUV)
    assert [SQUARE.is_able(AUV), deep.is_able(AUV), SQUARE.is_able(WITHOUT_SENSOR), too_deep.is_able(AUV)] == [
        True, True, False, False
    ]  # fmt: skip
    assert SQUARE.after(here, WITHOUT_SENSOR) is too_deep.after(here, AUV) is None


@given(st.tuples(st.floats(-500, 1000), st.floats(-500, 1000)), st.floats(0.0, 1e4))
def test_survey_takes_its_own_time_and_the_way_to_its_nearest_end(place_m: tuple[float, float], s: float) -> None:
    """2475 m at 1.25 m/s, and the way to the nearest of the square's four ends at 2 m/s; ten rows end opposite."""
    then = SQUARE.after(Outlook(s, place_m), AUV)
    assert then is not None
    way_m = min(math.dist(place_m, (x, y)) for x in (112.5, 337.5) for y in (112.5, 337.5))
    assert then.free_s - s == pytest.approx(way_m / 2.0 + 1980.0)
    nearest_y = min((112.5, 337.5), key=lambda y: abs(place_m[1] - y))
    assert then.position_m[1] == pytest.approx(450.0 - nearest_y)


@given(st.floats(0.9, 1.1))
def test_duration_of_a_survey_is_inverse_to_the_speed(factor: float) -> None:
    usual, faster = (SQUARE.after(Outlook(0.0, (0.0, 0.0)), data) for data in (AUV, AUV.faster(factor)))
    assert usual is not None
    assert faster is not None
    assert faster.free_s == pytest.approx(usual.free_s / factor)
