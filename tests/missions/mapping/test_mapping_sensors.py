"""The seabed in cells, and the sensor that maps it."""

import pytest
from sample_vehicles import AUV, WITHOUT_SENSOR

from missions.mapping.sensors import Seabed, SwathSensor, mapping_speed_mps, swath_m
from remoras.sensor import Observation, Pose

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
    assert FIELD.under(62.5, 37.5, 12.5) == ((2, 1),)
    assert FIELD.under(-12.5, 12.5, 12.5) == ()  # the seabed there belongs to no area


def cells(sensor: SwathSensor, x_m: float, y_m: float, speed_mps: float) -> list[tuple[int, int]]:
    """Cells that the sensor finds on its way at a place, heading east."""
    of_index = {index: cell for cell, (_, index) in FIELD.cells.items()}
    found = sensor.sense(Pose(x_m, y_m, 20.0, 0.0, speed_mps), FIELD, 0.0)
    return [of_index[int(value)] for one in found for _, _, value in one.facts]


def test_a_cell_is_new_to_a_sensor_once() -> None:
    one, other = (SwathSensor(25.0, 1.3, "AUV00") for _ in range(2))
    assert cells(one, 12.5, 12.5, 1.3) == [(0, 0)]
    assert cells(one, 12.5, 14.0, 1.3) == []
    assert cells(other, 12.5, 12.5, 1.3) == [(0, 0)]


def test_what_is_found_is_a_fact_of_its_area() -> None:
    """Cell (2, 1) is in the second row of four: index 1 * 4 + 2."""
    found = SwathSensor(25.0, 1.3, "AUV00").sense(Pose(62.5, 37.5, 20.0, 0.0, 1.0), FIELD, 0.0)
    assert found == [Observation((("field", "mappedCell", 6),))]


def test_too_fast_nothing_is_mapped() -> None:
    assert cells(SwathSensor(25.0, 1.3, "AUV00"), 12.5, 12.5, 1.31) == []


def test_a_vehicle_that_is_faster_than_its_data_maps_faster() -> None:
    """Ten per cent faster than 1.25 m/s is 1.375 m/s; without a sensor it surveys at its own 1.5 m/s."""
    assert mapping_speed_mps(AUV) == 1.25
    assert mapping_speed_mps(AUV.faster(1.1)) == pytest.approx(1.375)
    assert (swath_m(AUV), swath_m(WITHOUT_SENSOR)) == (25.0, 0.0)
    assert mapping_speed_mps(WITHOUT_SENSOR) == 1.5
    assert cells(AUV.faster(1.1).sensors[0].make(AUV.faster(1.1)), 12.5, 12.5, 1.37) == [(0, 0)]


def test_a_swath_maps_the_rows_that_it_sweeps() -> None:
    """Along y = 12.5 in steps of 1.3 m: the four cells of the lowest row, and no other."""
    sensor = SwathSensor(25.0, 1.3, "AUV00")
    for number in range(78):
        cells(sensor, 1.3 * number, 12.5, 1.3)
    assert sensor.mapped == {(0, 0), (1, 0), (2, 0), (3, 0)}


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
