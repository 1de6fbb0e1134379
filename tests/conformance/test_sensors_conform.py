"""Two kinds of sensors conform, and the check detects a sensor that breaks a rule."""

import itertools
from typing import Any

import pytest
from sample_vehicles import AUV

from missions.mapping.mission import MappingMission
from missions.mapping.sensors import Seabed, SwathSettings
from remoras.recorder import TIME, TRAJECTORIES, VEHICLE, Column, Table
from remoras.sensor import Observation, Pose, Quiet, SensorSettings
from remoras.testing import sensors as conformance

CORNERS_M = ((50.0, 50.0), (150.0, 50.0), (150.0, 150.0), (50.0, 150.0))
DEPTHS = Table("depths", (TIME, VEHICLE, Column("depth_m", "float", "m")))
STREAM = itertools.count()


class Sounding:
    """A sensor that keeps to the rules."""

    table: Any = DEPTHS

    def sense(self, pose: Pose, world: Any, now_s: float) -> Any:
        return [Observation(row=(pose.depth_m,))]


def settings_of(made: type, **parts: Any) -> SensorSettings:
    """Settings of a sensor that differs in these parts."""
    kind = type("Other", (made,), parts)
    of = {"__module__": __name__, "__qualname__": "Settings", "make": lambda self, data: kind()}
    return type("Settings", (SensorSettings,), of)()


def test_the_mapping_sensor_conforms() -> None:
    """It is led over the middle of every cell, so that it has all of them to find."""
    seabed = Seabed.of_areas(25.0, {"bank": CORNERS_M})
    middles = [((column + 0.5) * 25.0, (row + 0.5) * 25.0) for column, row in seabed.cells]
    settings = SwathSettings(swath_m=25.0, speed_limit_mps=5.0)
    n_found = conformance.check(settings, AUV, seabed, [("Area", "bank")], MappingMission.vocabulary, places_m=middles)
    assert n_found == len(seabed.cells) == 16


def test_a_sensor_that_keeps_to_the_rules_conforms() -> None:
    assert conformance.check(settings_of(Sounding), AUV, {}) == len(conformance.way(AUV))


def takes_out(self: Any, pose: Pose, world: Any, now_s: float) -> list[Observation]:
    world["readings"] = world.get("readings", 0) + 1
    return [Observation(row=(pose.depth_m,))]


def looks_away(self: Any, pose: Pose, world: Any, now_s: float) -> Any:
    """It states that it observes nothing for 30 m, but does in every fourth second."""
    return Quiet(until_m=30.0) if now_s % 4.0 else [Observation(row=(pose.depth_m,))]


def saying(**said: Any) -> dict[str, Any]:
    return {"sense": lambda *asked: [Observation(**said)]}


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"sense": lambda *asked: [(1.0,)]}, "expected a list of Observation"),
        ({"table": Table("depths", (Column("depth_m", "float", "m"),))}, "first columns must be TIME and VEHICLE"),
        ({"table": TRAJECTORIES}, "the name of a table of every run"),
        (saying(row=(1.0, 2.0)), "does not fit its columns"),
        (saying(row=("1 m",)), "does not fit its columns"),
        ({"table": None}, "but its table is None"),
        (saying(facts=(("AUV00", "salinity", 35.0),)), "cannot be recorded: .*salinity"),
        (saying(found="Mermaid"), "cannot be recorded: .*Mermaid"),
        ({"sense": lambda *asked: [Observation(row=(float(next(STREAM)),))]}, "two sensors made alike"),
        ({"sense": takes_out}, "changed the world"),
        ({"sense": looks_away}, "but had stated Quiet"),
        ({"sense": lambda *asked: Quiet(until_s=float("nan"))}, "sense raised ValueError: Quiet.* has a NaN"),
    ],
)
def test_a_sensor_that_breaks_a_rule_is_detected(parts: dict[str, Any], says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        conformance.check(settings_of(Sounding, **parts), AUV, {})


def test_an_object_without_sense_method_is_refused() -> None:
    with pytest.raises(AssertionError, match="which has no sense"):
        conformance.check(settings_of(object), AUV, {})
