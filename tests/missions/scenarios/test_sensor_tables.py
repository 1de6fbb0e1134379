"""The tables of a vehicle's sensors: one or several, by name or from outside, each fault with its place."""

from pathlib import Path

import pytest
from faulty_missions import SounderSettings
from small_mission import SMALL, line_of

from missions.errors import ConfigurationError, ConfigurationFault
from missions.mapping.sensors import SwathSettings
from missions.runs.setup import resolved
from missions.scenarios import Scenario, load
from remoras.database import VehicleData

LISTED = SMALL.replace("[vehicle.sensor]", "[[vehicle.sensor]]")
SECOND = '\n  [[vehicle.sensor]]\n  name = "deep"\n  type = "faulty_missions:SounderSettings"\n  interval_s = 5.0\n'


def loaded(folder: Path, text: str) -> Scenario:
    file = folder / "pond.toml"
    file.write_text(text, encoding="utf-8")
    return load(str(file))


def diver(folder: Path, text: str) -> VehicleData:
    return resolved(loaded(folder, text)).database["Diver"]


def fault(folder: Path, text: str) -> ConfigurationFault:
    with pytest.raises(ConfigurationError) as caught:
        loaded(folder, text)
    (found,) = caught.value.faults
    return found


def test_a_single_table_and_a_list_of_one_are_the_same_sensor(tmp_path: Path) -> None:
    one, listed = loaded(tmp_path, SMALL), loaded(tmp_path, LISTED)
    assert one == listed
    (sensor,) = diver(tmp_path, SMALL).sensors
    assert sensor == SwathSettings(name="mapping", swath_m=10.0, speed_limit_mps=2.0)


def test_a_kind_is_named_or_the_first_of_the_mission(tmp_path: Path) -> None:
    typed = LISTED.replace("  swath_m", '  type = "mapping"\n  swath_m')
    assert diver(tmp_path, typed).sensors[0].swath_m == 10.0  # type: ignore[attr-defined]
    assert diver(tmp_path, typed).sensors[0].name == "mapping"


def test_several_sensors_of_one_vehicle_are_had_by_their_names(tmp_path: Path) -> None:
    data = diver(tmp_path, LISTED + SECOND)
    assert [(type(sensor), sensor.name) for sensor in data.sensors] == [
        (SwathSettings, "mapping"),
        (SounderSettings, "deep"),
    ]
    found = data.sensor(SounderSettings)
    assert found is not None
    assert found.interval_s == 5.0


def test_a_kind_from_outside_without_a_name_is_called_by_its_reference(tmp_path: Path) -> None:
    data = diver(tmp_path, LISTED + SECOND.replace('  name = "deep"\n', ""))
    assert data.sensors[1].name == "faulty_missions:SounderSettings"


def test_two_sensors_of_one_kind_need_names(tmp_path: Path) -> None:
    """Without them the second would silently take the place of the first."""
    again = "\n  [[vehicle.sensor]]\n  swath_m = 30.0\n  speed_limit_mps = 2.0\n"
    found = fault(tmp_path, LISTED + again)
    assert (found.key, found.given) == ("vehicle.Diver.sensor", '"mapping"')
    assert "2 sensors of this name" in found.allowed
    assert "give each its own name" in found.allowed
    assert found.line is not None
    named = again.replace("swath_m", 'name = "wide"\n  swath_m')
    assert [sensor.name for sensor in diver(tmp_path, LISTED + named).sensors] == ["mapping", "wide"]


@pytest.mark.parametrize("text", [SMALL, LISTED], ids=["table", "list"])
@pytest.mark.parametrize(
    ("old", "new", "key", "given", "says"),
    [
        ("swath_m = 10.0", "swath_m = 0.0", "swath_m", "0.0", "greater than or equal to 0.1"),
        ("swath_m = 10.0", 'swath_m = "ten"', "swath_m", '"ten"', "valid number"),
        ("swath_m = 10.0", "swath_m = 10.0\n  swathe_m = 1", "swathe_m", "1", "did you mean 'swath_m'"),
        ("  swath_m = 10.0\n", "", "swath_m", "", "missing"),
        ("swath_m = 10.0", 'type = "maping"\n  swath_m = 10.0', "type", '"maping"', "mean 'mapping'"),
        ("swath_m = 10.0", 'type = "os:nothing"\n  swath_m = 10.0', "type", '"os:nothing"', "can be imported"),
        (
            "swath_m = 10.0",
            'type = "os:getcwd"\n  swath_m = 10.0',
            "type",
            '"os:getcwd"',
            "a subclass of remoras.Sensor",
        ),
        ("swath_m = 10.0", 'type = "faulty_missions:Bare"\n  swath_m = 1', "type", '"faulty_missions:Bare"', "make"),
    ],
)
def test_a_fault_in_a_sensors_table_is_told_with_its_line(
    tmp_path: Path, text: str, old: str, new: str, key: str, given: str, says: str
) -> None:
    assert old in text
    wrong = text.replace(old, new, 1)
    found = fault(tmp_path, wrong)
    assert found.key.startswith("vehicle.Diver.sensor")
    assert found.key.endswith(f".{key}")
    assert found.given == given
    assert says in found.allowed
    where = f"{key} =" if given else "[[vehicle.sensor]]" if text is LISTED else "[vehicle.sensor]"
    assert found.line == line_of(wrong, where)


def test_a_fault_in_the_second_table_points_into_it(tmp_path: Path) -> None:
    wrong = LISTED + SECOND.replace("interval_s = 5.0", "interval = 5.0")
    found = fault(tmp_path, wrong)
    assert found.key == "vehicle.Diver.sensor.deep.interval"
    assert "did you mean 'interval_s'" in found.allowed
    assert found.line == line_of(wrong, "interval =")


@pytest.mark.parametrize("wrong", ["5", '"wide"', "[1]"])
def test_what_is_no_table_is_a_fault(tmp_path: Path, wrong: str) -> None:
    text = SMALL[: SMALL.index("  [vehicle.sensor]")] + f"sensor = {wrong}\n"
    with pytest.raises(ConfigurationError, match=r"vehicle\.Diver\.sensor"):
        loaded(tmp_path, text)
