"""The shipped sensor and one of another kind conform, and the check finds a sensor that breaks a rule."""

import nonconforming_sensors as broken
import pytest
from sample_vehicles import AUV

from missions.mapping.mission import MappingMission
from missions.mapping.sensors import Seabed, SwathSettings
from remoras.sensor import SensorSettings
from remoras.testing import sensors as conformance

CORNERS_M = ((50.0, 50.0), (150.0, 50.0), (150.0, 150.0), (50.0, 150.0))


def test_the_mapping_sensor_conforms() -> None:
    """It is led over the middle of every cell, so that it has all of them to find."""
    seabed = Seabed.of_areas(25.0, {"bank": CORNERS_M})
    middles = [((column + 0.5) * 25.0, (row + 0.5) * 25.0) for column, row in seabed.cells]
    settings = SwathSettings(swath_m=25.0, speed_limit_mps=5.0)
    n_found = conformance.check(settings, AUV, seabed, [("Area", "bank")], MappingMission.vocabulary, places_m=middles)
    assert n_found == len(seabed.cells) == 16


def test_a_sensor_that_keeps_to_the_rules_conforms() -> None:
    assert conformance.check(broken.Sounding(), AUV, {}) == len(conformance.way(AUV))


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        (broken.Blind, "which has no sense"),
        (broken.Bare, "expected a list of Observation"),
        (broken.Timeless, "first columns must be TIME and VEHICLE"),
        (broken.Impostor, "the name of a table of every run"),
        (broken.Wide, "does not fit the columns"),
        (broken.Spelled, "does not fit the columns"),
        (broken.Homeless, "but its table is None"),
        (broken.Inventive, "cannot be recorded: .*salinity"),
        (broken.Dreaming, "cannot be recorded: .*Mermaid"),
        (broken.Streaming, "two sensors made alike"),
        (broken.Collecting, "changed the world"),
    ],
    ids=lambda value: value.__name__ if isinstance(value, type) else "",
)
def test_a_sensor_that_breaks_a_rule_is_found_out(kind: type[SensorSettings], says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        conformance.check(kind(), AUV, {})
