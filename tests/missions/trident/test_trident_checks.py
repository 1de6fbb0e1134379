"""What is wrong with scenarios of this mission is told with file, line, key, value and what is allowed."""

import copy
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from intervening import Raw, module, named, tables

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios import load, shipped
from missions.trident import TridentMission


def faults(raw: Raw) -> list[ConfigurationFault]:
    return list(TridentMission.check(raw))


def only(raw: Raw) -> tuple[str, str, str]:
    (fault,) = faults(raw)
    return fault.key, fault.given, fault.allowed


def test_the_shipped_scenario_is_in_order() -> None:
    assert faults(tables()) == []


def test_blocks_do_not_overlap() -> None:
    raw = tables()
    named(raw["block"], "east")["x_m"] = [150.0, 300.0]
    assert only(raw) == ("block.east", "", "overlaps block west; allowed: blocks side by side")


def test_blocks_and_the_target_lie_in_the_world() -> None:
    raw = tables()
    named(raw["block"], "east")["x_m"] = [220.0, 500.0]
    raw["recovery"]["target_m"] = [20.0, 900.0]
    outside = "outside the world, x -50.0 to 450.0, y -50.0 to 350.0"
    assert [(one.key, one.given, one.allowed) for one in faults(raw)] == [
        ("block.east.x_m, y_m", "[500.0, 280.0]", outside),
        ("recovery.target_m", "[20.0, 900.0]", outside),
    ]


def test_a_block_has_width_and_not_too_many_tiles() -> None:
    raw = tables()
    named(raw["block"], "east")["x_m"] = [380.0, 220.0]
    assert only(raw) == ("block.east.x_m", "[380.0, 220.0]", "allowed: the smaller border first")
    raw = tables()
    raw["mission"]["tile_m"] = 4.0  # 40 times 40 tiles; the key itself allows no less than 5
    assert {one.allowed for one in faults(raw)} == {"more than 1024 tiles; allowed: a greater mission.tile_m"}


def test_a_block_needs_a_name_of_its_own() -> None:
    raw = tables()
    named(raw["block"], "east")["name"] = "recovery"
    assert only(raw) == ("block.recovery.name", '"recovery"', "used twice; blocks need names of their own")


def test_a_service_that_nobody_offers_is_named() -> None:
    raw = tables()
    vehicle = named(raw["vehicle"], "IAUV00")
    vehicle["sensor"] = [one for one in vehicle["sensor"] if one["name"] not in ("arm", "gripper")]
    key, given, allowed = only(raw)
    assert (key, given) == ("activity.handle.requires", '"Manipulation"')
    assert allowed.startswith("a service that nobody offers; allowed: ")
    assert "SeabedSurvey" in allowed


def test_what_an_activity_requires_may_be_concluded_but_not_from_the_wrong_vehicle() -> None:
    """Imaging at the surface reacquires nothing."""
    raw = tables()
    for name in ("camera", "forward sonar"):
        one = module(raw, f"IAUV00 {name}")
        named(raw["vehicle"], "IAUV00")["sensor"].remove(one)
        named(raw["vehicle"], "ASV00")["sensor"].append(one)
    found = {one.key for one in faults(raw)}
    assert found == {"activity.find.requires"}


def test_a_plan_names_services_that_are_able() -> None:
    raw = tables()
    raw["activity"]["hold"]["service"] = "IAUV00 arm"
    key, given, allowed = only(raw)
    assert (key, given) == ("activity.hold.service", '"IAUV00 arm"')
    assert allowed.startswith("allowed: IAUV00 clamp, IAUV00 hover")
    raw = tables()
    del raw["activity"]["hold"]["service"]
    assert only(raw)[::2] == ("activity.hold.service", "is missing; allowed: IAUV00 clamp, IAUV00 hover")


def test_a_capability_is_a_kind_of_service() -> None:
    raw = tables()
    module(raw, "IAUV00 clamp")["capability"] = "Clmping"
    key, given, allowed = next((one.key, one.given, one.allowed) for one in faults(raw))
    assert (key, given) == ("vehicle.IAUV00.sensor.clamp.capability", '"Clmping"')
    assert "Clamping" in allowed


def test_who_makes_choices_tells_whether_it_works() -> None:
    raw = tables()
    module(raw, "ASV00 console")["self_test"] = False
    assert only(raw)[:2] == ("vehicle.ASV00.sensor.console.self_test", "false")


@pytest.mark.parametrize(
    ("at", "key", "value", "fault"),
    [
        (0, "state", "surveing", ("choreography.message.1.state", '"surveing"')),
        (0, "to", "nowhere", ("choreography.message.1.to", '"nowhere"')),
        (0, "says", "chossen", ("choreography.message.1.says", '"chossen"')),
        (2, "by", "ASV01", ("choreography.message.3.by", '"ASV01"')),
        (3, "value", "wreck", ("choreography.message.4.value", '"wreck"')),
    ],
)
def test_messages_are_of_what_there_is(at: int, key: str, value: str, fault: tuple[str, str]) -> None:
    raw = tables()
    raw["choreography"]["message"][at][key] = value
    assert only(raw)[:2] == fault


def test_a_dead_end_and_a_state_out_of_reach_are_named() -> None:
    raw = tables()
    raw["choreography"]["message"] = [one for one in raw["choreography"]["message"] if one["state"] != "rejected"]
    beyond = "cannot be reached: no message leads to it from surveying, the first state"
    beyond_it = [("choreography.state.surveying again", "", beyond), ("choreography.state.exhausted", "", beyond)]
    assert [(fault.key, fault.given, fault.allowed) for fault in faults(raw)] == [
        (
            "choreography.state.rejected",
            "",
            "is a dead end: no message leads from it to a final state, which are exhausted, recovered",
        ),
        *beyond_it,
    ]
    raw = tables()
    raw["choreography"]["message"] = [one for one in raw["choreography"]["message"] if one["to"] != "rejected"]
    assert [fault.key for fault in faults(raw)] == ["choreography.state.rejected", *(key for key, _, _ in beyond_it)]


def test_a_beacon_stands_or_is_carried(tmp_path: Path) -> None:
    raw = tables()
    raw["beacon"][0]["position_m"] = [0.0, 0.0]
    del raw["beacon"][1]["position_m"]
    raw["beacon"].append({"name": "ghost", "vehicle": "ASV07", "range_m": 10.0})
    raw["beacon"].append({"name": "deaf", "vehicle": "ASV00", "sensor": "usb", "range_m": 10.0})
    file = tmp_path / "own.toml"
    file.write_text(tomli_w.dumps(raw), encoding="utf-8")
    with pytest.raises(ConfigurationError) as raised:
        load(str(file))
    found = {one.key: one.allowed for one in raised.value.faults}
    assert found["beacon.positioning"] == "has both position_m and vehicle; allowed: one of them"
    assert found["beacon.transponder"] == "has neither position_m nor vehicle; allowed: one of them"
    assert found["beacon.ghost.vehicle"].startswith("allowed: ASV00, IAUV00")
    assert found["beacon.deaf.sensor"].startswith("allowed: multibeam, usbl, console")


def test_a_fault_names_file_and_line(tmp_path: Path) -> None:
    text = shipped()["trident-intervention"].read_text(encoding="utf-8")
    file = tmp_path / "own.toml"
    file.write_text(text.replace('requires = "Manipulation"', 'requires = "Manipulaton"'), encoding="utf-8")
    line = next(n for n, one in enumerate(text.splitlines(), 1) if 'requires = "Manipulation"' in one)
    with pytest.raises(ConfigurationError, match=rf'own\.toml:{line}: activity\.handle\.requires = "Manipulaton"'):
        load(str(file))


@pytest.mark.parametrize("key", ["block", "recovery", "activity", "choreography", "transponder", "vehicle", "mission"])
@pytest.mark.parametrize("value", [None, 3, "text", [], {}, [3], [{}], {"state": 3}])
def test_malformed_tables_are_passed_over(key: str, value: Any) -> None:
    raw = copy.deepcopy(tables())
    raw[key] = value
    for fault in faults(raw):
        assert isinstance(fault, ConfigurationFault)
