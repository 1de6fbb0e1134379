"""What a vehicle perceives: cells of the seabed, and others on collision course."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from remoras.sensors import MappingSensor, Neighbour, Seabed, time_to_collision_s

SQUARE = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
FIELD = Seabed.of_areas(25.0, {"field": SQUARE})


def test_cells_of_the_papers_areas() -> None:
    """Three areas of 250 m by 250 m in cells of 25 m: 100 cells each, numbered row by row from the south-west."""

    def area(x: float, y: float) -> list[tuple[float, float]]:
        return [(x, y), (x, y + 250.0), (x + 250.0, y + 250.0), (x + 250.0, y)]

    seabed = Seabed.of_areas(25.0, {"middle": area(100, 100), "left": area(350, 100), "right": area(100, 350)})
    assert len(seabed.cells) == 300
    assert seabed.cells[4, 4] == ("middle", 0)
    assert seabed.cells[5, 4] == ("middle", 1)
    assert seabed.cells[4, 5] == ("middle", 10)
    assert seabed.cells[14, 4] == ("left", 0)
    for name in ("middle", "left", "right"):
        assert sorted(index for area, index in seabed.cells.values() if area == name) == list(range(100))


def test_areas_that_overlap_share_no_cell() -> None:
    seabed = Seabed.of_areas(25.0, {"one": SQUARE, "two": [(x + 50.0, y) for x, y in SQUARE]})
    names = [area for area, _ in seabed.cells.values()]
    assert (names.count("one"), names.count("two")) == (16, 8)  # 4 by 4, and the 2 columns that are left of the 4


def test_what_lies_under_the_vehicle() -> None:
    # at a common corner of four cells, whose centres are 12.5 sqrt(2) = 17.7 m away
    assert sorted(FIELD.under(50.0, 50.0, 17.6)) == []
    assert sorted(FIELD.under(50.0, 50.0, 17.7)) == [(1, 1), (1, 2), (2, 1), (2, 2)]
    assert FIELD.under(62.5, 37.5, 12.5) == [(2, 1)]
    assert FIELD.under(-12.5, 12.5, 12.5) == []  # the seabed there belongs to no area


def test_a_cell_is_new_to_a_sensor_once() -> None:
    one, other = (MappingSensor(FIELD, 25.0, 1.3) for _ in range(2))
    assert one.sense(12.5, 12.5, 1.3) == [(0, 0)]
    assert one.sense(12.5, 14.0, 1.3) == []
    assert other.sense(12.5, 12.5, 1.3) == [(0, 0)]


def test_too_fast_and_without_a_sensor_nothing_is_mapped() -> None:
    assert MappingSensor(FIELD, 25.0, 1.3).sense(12.5, 12.5, 1.31) == []
    assert MappingSensor(FIELD, 0.0, 1.3).sense(12.5, 12.5, 0.0) == []


def test_a_swath_maps_the_rows_that_it_sweeps() -> None:
    """Along y = 12.5 in steps of 1.3 m: the four cells of the lowest row, and no other."""
    sensor = MappingSensor(FIELD, 25.0, 1.3)
    for number in range(78):
        sensor.sense(1.3 * number, 12.5, 1.3)
    assert sensor.mapped == {(0, 0), (1, 0), (2, 0), (3, 0)}


# Collisions ---------------------------------------------------------------------------------------


def time_of(neighbour: Neighbour, own: tuple[float, float] = (0.0, 0.0)) -> float | None:
    return time_to_collision_s(neighbour, *own, safety_m=5.0, horizon_s=30.0)


def test_head_on() -> None:
    """40 m apart, closing at 1 + 1 m/s: in 20 s."""
    assert time_of(Neighbour(40.0, 0.0, -1.0, 0.0), (1.0, 0.0)) == 20.0


def test_no_concern() -> None:
    assert time_of(Neighbour(40.0, 0.0, 1.0, 0.0), (1.0, 0.0)) is None  # side by side at one speed
    assert time_of(Neighbour(40.0, 0.0, 1.0, 0.0)) is None  # going away
    assert time_of(Neighbour(40.0, 5.0, -2.0, 0.0)) is None  # passes at 5 m
    assert time_of(Neighbour(62.0, 0.0, -2.0, 0.0)) is None  # in 31 s
    assert time_of(Neighbour(60.0, 4.9, -2.0, 0.0)) == 30.0


offsets = st.floats(-60.0, 60.0)
velocities = st.floats(-3.0, 3.0)


courses, times = st.floats(-math.pi, math.pi), st.floats(0.1, 29.9)


@given(velocities, velocities, st.floats(0.1, 3.0), courses, times, st.floats(-7.0, 7.0))
def test_the_time_is_that_of_the_closest_approach(
    vx: float, vy: float, closing_mps: float, course: float, time_s: float, miss_m: float
) -> None:
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


@given(st.builds(Neighbour, offsets, offsets, velocities, velocities), velocities, velocities)
def test_both_see_the_same_collision(neighbour: Neighbour, vx: float, vy: float) -> None:
    mirrored = Neighbour(-neighbour.dx_m, -neighbour.dy_m, vx, vy)
    assert time_of(neighbour, (vx, vy)) == time_of(mirrored, (neighbour.vx_mps, neighbour.vy_mps))


def test_the_borders_of_a_slanted_area() -> None:
    """Of a triangle with legs of 100 m in cells of 25 m, the cells with column + row < 3 have their centre inside
    for certain; those on the long side are shared out one way or the other."""
    triangle = Seabed.of_areas(25.0, {"triangle": [(0.0, 0.0), (100.0, 0.0), (0.0, 100.0)]})
    inside = {(column, row) for column in range(4) for row in range(4) if column + row < 3}
    assert inside <= set(triangle.cells)
    assert all(column + row <= 3 for column, row in triangle.cells)
    assert triangle.cells[0, 0] == ("triangle", 0)


@pytest.mark.parametrize("x_m", [-1000.0, -0.5, 0.0, 99.5, 1000.0])
def test_cells_below_zero_are_counted_downwards(x_m: float) -> None:
    shifted = Seabed.of_areas(25.0, {"field": [(x + 1000.0 * round(x_m / 1000.0), y) for x, y in SQUARE]})
    assert len(shifted.cells) == 16
