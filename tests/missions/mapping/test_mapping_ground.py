"""The way over what is left of an area: it covers it, and never grows when less is left."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.mapping.ground import Ground, Survey, ground_of
from missions.mapping.survey import Point, length_m, rows, to_and_fro, zigzag

SQUARE = ((100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0))
SWATHS_M = st.sampled_from([10.0, 25.0, 30.0, 60.0])


@st.composite
def grounds(draw: st.DrawFn) -> Ground:
    """Corners on an ellipse, in order: always convex."""
    angles = sorted(draw(st.lists(st.integers(0, 359), min_size=3, max_size=7, unique=True)))
    across, along = draw(st.floats(40.0, 120.0)), draw(st.floats(40.0, 120.0))
    corners = tuple((across * math.cos(math.radians(a)), along * math.sin(math.radians(a))) for a in angles)
    return ground_of(corners, draw(st.sampled_from([8.0, 15.0, 25.0])))


def some(ground: Ground, draw: st.DataObject) -> int:
    return draw.draw(st.integers(0, ground.work)) if ground.work else 0


def run_m(survey: Survey, left: int) -> list[tuple[Point, Point]]:
    """Rows that the vehicle runs if it plans anew at the end of each, without news."""
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


def test_of_a_row_of_which_nothing_is_left_there_is_nothing_to_span() -> None:
    survey = ground_of(((0.0, 0.0), (400.0, 0.0), (400.0, 100.0), (0.0, 100.0)), 25.0).survey(25.0)
    row = survey.rows[2]
    assert survey.span_m(2, row.cells) == (12.5, 387.5)
    assert survey.span_m(2, survey.reach & ~row.cells) is None


@given(grounds(), SWATHS_M, st.data())
def test_the_rows_cover_all_that_is_left_and_can_be_reached(
    ground: Ground, swath_m: float, draw: st.DataObject
) -> None:
    survey, left = ground.survey(swath_m), some(ground, draw)
    lines = run_m(survey, left)
    wanted = [index for index in range(len(ground.cells)) if left & survey.reach & 1 << index]
    assert bool(lines) == bool(wanted)
    for index in wanted:
        centre_m = ground.centre_m(index)
        assert min(to_line_m(*line, centre_m) for line in lines) <= swath_m / 2.0 + 1e-5


@given(grounds(), SWATHS_M, st.data())
def test_no_row_is_run_in_vain(ground: Ground, swath_m: float, draw: st.DataObject) -> None:
    """Every row that is run begins and ends beside a cell that is left, unless it is left whole."""
    survey, left = ground.survey(swath_m), some(ground, draw)
    if left & survey.reach == survey.reach:
        return
    for begin, end in run_m(survey, left):
        for point in (begin, end):
            near_m = [math.dist(ground.centre_m(i), point) for i in range(len(ground.cells)) if left >> i & 1]
            whole = any(set(row.ends_m) == {begin, end} for row in survey.rows)
            assert whole or min(near_m) <= swath_m / 2.0 + 1e-5


@pytest.mark.parametrize("at_m", [(0.0, 0.0), (500.0, 0.0), (0.0, 500.0), (500.0, 500.0)])
def test_with_nothing_known_it_is_the_zigzag_of_the_paper(at_m: Point) -> None:
    ground = ground_of(SQUARE, 25.0)
    ways = ground.survey(25.0).ways(ground.work)
    way = min(ways, key=lambda way: math.dist(way.first_m, at_m))
    points = zigzag(SQUARE, 25.0, at_m, 12.5)
    assert (way.first_m, way.last_m, way.length_m) == (points[0], points[-1], length_m(points))
    assert way.ends_m == (points[0], points[1])


@given(grounds(), SWATHS_M)
def test_an_untouched_area_is_run_to_and_fro_from_each_end(ground: Ground, swath_m: float) -> None:
    survey = ground.survey(swath_m)
    lines = [row.ends_m for row in survey.rows]
    if survey.reach and all(row.cells for row in survey.rows):
        for way in survey.ways(ground.work):
            points = to_and_fro(lines, way.first_m)
            assert (way.first_m, way.last_m) == (points[0], points[-1])
            assert way.length_m == pytest.approx(length_m(points))


@given(grounds(), SWATHS_M)
def test_rows_reach_every_cell_and_are_never_shorter_than_those_of_the_paper(ground: Ground, swath_m: float) -> None:
    """Rows are at most a swath apart, so every cell is within half a swath of one, if that is long enough."""
    survey = ground.survey(swath_m)
    assert survey.reach == ground.work
    for row, (first, last) in zip(
        survey.rows, rows(ground.corners_m, swath_m, min(swath_m, ground.cell_m) / 2.0), strict=True
    ):
        assert math.dist(*row.ends_m) >= math.dist(first, last) - 1e-9


@given(grounds(), SWATHS_M, st.data(), st.tuples(st.floats(-300, 300), st.floats(-300, 300)))
def test_where_less_is_left_a_vehicle_is_done_no_later(
    ground: Ground, swath_m: float, draw: st.DataObject, at_m: Point
) -> None:
    """From the same place at the same speed: whoever runs the longer way has passed all that is left of the shorter."""
    survey, more = ground.survey(swath_m), some(ground, draw)
    less = more & draw.draw(st.integers(0, max(1, ground.work)))

    def way_m(left: int) -> float:
        return min((math.dist(way.first_m, at_m) + way.length_m for way in survey.ways(left)), default=0.0)

    assert way_m(less) <= way_m(more) + 1e-6


@pytest.mark.parametrize("wide_and_high_m", [(400.0, 100.0), (100.0, 400.0)])
def test_a_row_lies_at_one_coordinate_across_and_reaches_along_the_longer_side(
    wide_and_high_m: tuple[float, float],
) -> None:
    wide_m, high_m = wide_and_high_m
    survey = ground_of(((0.0, 0.0), (wide_m, 0.0), (wide_m, high_m), (0.0, high_m)), 25.0).survey(25.0)
    assert [[survey.across_m(end_m) for end_m in row.ends_m] for row in survey.rows] == [
        [level_m] * 2 for level_m in (12.5, 37.5, 62.5, 87.5)
    ]
    assert [[survey.along_m(end_m) for end_m in row.ends_m] for row in survey.rows] == [[12.5, 387.5]] * 4


def test_bits_follow_a_set_that_grows() -> None:
    ground = ground_of(SQUARE, 25.0)
    known: set[float] = {0.0, 3.0}
    assert ground.bits(known) == 0b1001
    assert ground.bits(known) == 0b1001
    known.add(1.0)
    assert ground.bits(known) == 0b1011
    assert ground.bits({5.0}) == 0b100000
