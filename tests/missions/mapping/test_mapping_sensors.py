"""Seabed in cells, the mapping sensor, and classified objects."""

import math
from collections import Counter

import pytest
from sample_vehicles import AUV, WITHOUT_SENSOR

from missions.mapping.sensors import (
    CLASSES,
    Classifier,
    ClassifierSettings,
    ObjectTable,
    Seabed,
    SwathSensor,
    mapping_speed_mps,
    swath_m,
)
from remoras.sensor import Observation, Pose

SQUARE = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
FIELD = Seabed.of_areas(25.0, {"field": SQUARE})


def test_areas_of_the_paper_have_100_cells_each() -> None:
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


def test_cells_under_the_vehicle_are_those_within_half_a_swath() -> None:
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


def test_sensor_reports_a_cell_once() -> None:
    one, other = (SwathSensor(25.0, 1.3, "AUV00") for _ in range(2))
    assert cells(one, 12.5, 12.5, 1.3) == [(0, 0)]
    assert cells(one, 12.5, 14.0, 1.3) == []
    assert cells(other, 12.5, 12.5, 1.31) == []  # too fast
    assert cells(other, 12.5, 12.5, 1.3) == [(0, 0)]
    found = one.sense(Pose(62.5, 37.5, 20.0, 0.0, 1.0), FIELD, 0.0)
    assert found == [Observation((("field", "mappedCell", 6),))]  # cell (2, 1) is in the second row of four: 1 * 4 + 2


def test_mapping_speed_scales_with_the_true_speed() -> None:
    """Ten per cent faster than 1.25 m/s is 1.375 m/s; without a sensor it surveys at its own 1.5 m/s."""
    assert mapping_speed_mps(AUV) == 1.25
    assert mapping_speed_mps(AUV.faster(1.1)) == pytest.approx(1.375)
    assert (swath_m(AUV), swath_m(WITHOUT_SENSOR)) == (25.0, 0.0)
    assert mapping_speed_mps(WITHOUT_SENSOR) == 1.5
    assert cells(AUV.faster(1.1).sensors[0].make(AUV.faster(1.1)), 12.5, 12.5, 1.37) == [(0, 0)]


# The sensor ------------------------------------------------------------------------------------------


def looks(settings: ClassifierSettings, seed: int, n: int, node: int = 1) -> list[Observation]:
    sensor = Classifier(settings, node)
    world = Seabed(
        25.0, {}, objects=(ObjectTable(name="it", position_m=(10.0, 0.0), classification="wreck"),), seed=seed
    )
    pose = Pose(0.0, 0.0, 20.0, 0.0, 1.0)
    return [one for k in range(n) for one in sensor.sense(pose, world, settings.every_s * k)]


def test_looks_are_right_at_their_stated_rate() -> None:
    """Of 200 looks 140 are right, within four times sqrt(200 * 0.7 * 0.3) = 6.5; wrong ones are even."""
    found = Counter(one.row[1] for one in looks(ClassifierSettings(p_right=0.7), 5, 200))
    assert abs(found["wreck"] - 140) < 26
    assert set(found) == set(CLASSES)
    others = [found[name] for name in CLASSES if name != "wreck"]
    assert max(others) - min(others) < 4 * math.sqrt(2 * 30)  # 30 of each on average


def test_looks_depend_on_seed_and_node_and_not_on_the_interval() -> None:
    settings = ClassifierSettings()
    assert looks(settings, 5, 9) == looks(settings, 5, 9)
    assert looks(settings, 5, 9) != looks(settings, 6, 9)
    assert looks(settings, 5, 9) != looks(settings, 5, 9, node=2)
    fine = looks(ClassifierSettings(every_s=1.0), 5, 9)
    assert [one.row for one in fine] == [one.row for one in looks(settings, 5, 9)]
