"""Scenario files: all that is wrong with one is said at once, each with file, line, key and what is allowed."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from small_mission import SMALL, line_of

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios import Scenario, load, shipped
from missions.scenarios.explanations import explanations


def faults_of(folder: Path, text: str, *settings: str) -> tuple[ConfigurationFault, ...]:
    file = folder / "pond.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        load(str(file), [("--set", setting) for setting in settings])
    for fault, line in zip(caught.value.faults, str(caught.value).splitlines(), strict=True):
        assert line.startswith(str(file))
        assert fault.key in line
        assert fault.given in line
        assert fault.allowed in line
    return caught.value.faults


def changed(old: str, new: str) -> str:
    assert old in SMALL
    return SMALL.replace(old, new, 1)


def test_the_small_scenario_is_in_order(tmp_path: Path):
    file = tmp_path / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    scenario = load(str(file))
    assert [vehicle.name for vehicle in scenario.vehicle] == ["Boat", "Diver"]
    assert scenario.vehicle[0].sensor == ()
    assert scenario.scenario.tick_s == 1.0  # not given


def test_a_shipped_name_and_its_file_are_the_same_scenario():
    for name, path in shipped().items():
        assert load(name) == load(str(path))


def test_a_scenario_is_frozen():
    with pytest.raises(ValueError, match="frozen"):
        load("mapping-rendezvous").channel.per = 0.5


# One fault ----------------------------------------------------------------------------------------

ONE_FAULT = [
    # (replaced, by, key, given, what the message says, where it points)
    (
        'policy = "mps',
        'polcy = 1\npolicy = "mps',
        "communication.polcy",
        "1",
        "unknown key.*did you mean 'policy'",
        "polcy",
    ),
    ("cell_m = 10.0", "cell_m = -1.0", "world.cell_m", "-1.0", "greater than or equal to 0.1", "cell_m"),
    (
        "cell_m = 10.0",
        "cell_m = 10.0\norigin_deg = [89.5, 0.0]",
        "world.origin_deg",
        "[89.5, 0.0]",
        "allowed: latitude -89 to 89, longitude -180 to 180",
        "origin_deg",
    ),
    (
        "cell_m = 10.0",
        "cell_m = 10.0\norigin_deg = [55, 181]",
        "world.origin_deg",
        "[55.0, 181.0]",
        "longitude -180 to 180",
        "origin_deg",
    ),
    ("cell_m = 10.0", 'cell_m = "10 m"', "world.cell_m", '"10 m"', "valid number", "cell_m"),
    ("per = 0.2", "per = 1.0", "channel.per", "1.0", "less than 1", "per"),
    ("per = 0.2", "per = nan", "channel.per", "nan", "finite", "per"),
    ("duration_s = 1200.0", "duration_s = 1e9", "scenario.duration_s", "1000000000.0", "604800", "duration_s"),
    (
        "playsRole = 50",
        "playsRole = 0",
        "communication.needs.playsRole",
        "0",
        "greater than or equal to 1",
        "playsRole",
    ),
    ("playsRole = 50", "playRole = 50", "communication.needs.playRole", "", "no attribute.*'playsRole'", "playRole"),
    ('modem = "s2c-18-34"', 'modem = "s2c"', "communication.modem", '"s2c"', "allowed: .*s2c-18-34", "modem"),
    (
        '"mps-ack-repeat"',
        '"mps-ack-repat"',
        "communication.policy",
        '"mps-ack-repat"',
        "mean 'mps-ack-repeat'",
        "policy",
    ),
    ('name = "bernoulli"', 'name = "bernouli"', "channel.name", '"bernouli"', "mean 'bernoulli'", 'name = "bernouli"'),
    ('name = "remoras"', 'name = "remora"', "strategy.name", '"remora"', "mean 'remoras'", 'name = "remora"'),
    ('name = "remoras"', 'name = "os:nothing"', "strategy.name", '"os:nothing"', "package.module:object", 'name = "os'),
    (":MappingMission", ":Nothing", "scenario.mission", "", "can be imported", "mission"),
    (
        "[200.0, 200.0]",
        "[200.0, 260.0]",
        "rally_point.jetty.position_m",
        "[200.0, 260.0]",
        "outside the world",
        "position_m",
    ),
    ("[10.0, 0.0]", "[-60.0, 0.0]", "vehicle.Diver.start_m", "[-60.0, 0.0]", "outside the world", "start_m = [-60"),
    ("[150.0, 100.0], ", "[350.0, 100.0], ", "area.north bank.corners_m", "", "outside the world", "corners_m"),
    ("x_m = [-50.0, 250.0]", "x_m = [250.0, -50.0]", "world.x_m", "", "west border must be below east", "x_m"),
    ("cell_m = 10.0", "cell_m = 400.0", "area.north bank.corners_m", "0 cells", "1 to 4096", "corners_m"),
    ("slot = 1", "slot = 0", "vehicle.Diver.slot", "0", "owned by Boat and Diver; one owner per slot", "slot:2"),
    ("slot = 1", "slot = 2", "vehicle.Boat.slot", "2", "0 to 1", "slot"),
    ("slot = 1", "slot = 99", "vehicle.Boat.slot", "99", "63|0 to 1", "slot"),
    (
        'vehicle_type = "ASV"',
        'vehicle_type = "USV"',
        "vehicle.Boat.vehicle_type",
        '"USV"',
        "'AUV' or 'ASV'",
        "vehicle_type",
    ),
    ('"Mapper", ', '"Maper", ', "vehicle.Diver.playable_roles", '"Maper"', "did you mean 'Mapper'", "playable_roles:2"),
    (
        '"Hand", "Mapper", "Scout"',
        '"Hand", "Mapper"',
        "group.Team.role.Scout",
        "",
        "no vehicle is able to play it",
        'name = "Scout"',
    ),
    (
        "  minimum = 1\n  founding",
        "  minimum = 2\n  founding",
        "group.Team.role.Hand.minimum",
        "2",
        "only 1 vehicle",
        "minimum = 2",
    ),
    ("head = true", "head = true\n  social = 1", "group.Team.role.Skipper.social", "1", "unknown key", "social"),
    ("head = true", "head = false", "group.Team.role", "0 heads", "one role must be head", "[[group.role]]"),
    (
        'job = "north bank"',
        'job = "nroth bank"',
        "group.Team.role.Scout.job",
        '"nroth bank"',
        "mean 'north bank'",
        "job =",
    ),
    (
        'rally_point = "jetty"',
        'rally_point = "pier"',
        "group.Team.rally_point",
        '"pier"',
        "allowed: jetty",
        "rally_point",
    ),
    (
        'mission = "AreaMapping"',
        'mission = "Mapping"',
        "group.Team.mission",
        '"Mapping"',
        "mean 'AreaMapping'",
        'mission = "Mapping"',
    ),
    (
        "slot = 1",
        "slot = 1\nsocial_layer = false",
        "group.Team.role.Skipper",
        "",
        "social_layer = true for one of Boat",
        'name = "Skipper"',
    ),
    ("depth_m = 5.0", "depth_m = 50.0", "vehicle.Diver.depth_m", "50.0", "0 to depth_limit_m = 30.0", "depth_m"),
    (
        "survey_speed_mps = 1.5",
        "survey_speed_mps = 3.0",
        "vehicle.Boat.survey_speed_mps",
        "3.0",
        "up to transit_speed_mps = 2.0",
        "survey_speed_mps",
    ),
    (
        "swath_m = 10.0",
        "swath_m = 0.0",
        "vehicle.Diver.sensor.swath_m",
        "0.0",
        "greater than or equal to 0.1",
        "swath_m",
    ),
    ("patience_s = 60.0", "patience = 60.0", "mission.patience", "60.0", "mean 'patience_s'", "patience ="),
    (
        "Exploring = 0.6",
        "Exploring = 1.6",
        "mission.importance.Exploring",
        "1.6",
        "less than or equal to 1",
        "Exploring = 1.6",
    ),
]


@pytest.mark.parametrize(
    ("old", "new", "key", "given", "says", "where"), ONE_FAULT, ids=[f"{c[2]}={c[3]}" for c in ONE_FAULT]
)
def test_one_fault_is_one_clear_message(
    tmp_path: Path, old: str, new: str, key: str, given: str, says: str, where: str
):
    text = changed(old, new)
    found = [fault for fault in faults_of(tmp_path, text) if fault.key == key]
    assert len(found) == 1
    (fault,) = found
    assert given in fault.given
    assert re.search(says, fault.allowed)
    begins, _, occurrence = where.partition(":")
    assert fault.line == line_of(text, begins, int(occurrence or 1))


@pytest.mark.parametrize(("old", "new"), [case[:2] for case in ONE_FAULT if case[2] != "world.x_m"])
def test_a_single_mistake_draws_few_lines(tmp_path: Path, old: str, new: str):
    """A mistake may make other keys wrong as well, but it does not bury itself under them."""
    assert 1 <= len(faults_of(tmp_path, changed(old, new))) <= 3


def test_borders_in_the_wrong_order_are_one_fault_and_not_one_of_every_place(tmp_path: Path):
    assert len(faults_of(tmp_path, changed("x_m = [-50.0, 250.0]", "x_m = [250.0, -50.0]"))) == 1


def test_an_object_that_is_no_mission_is_a_fault(tmp_path: Path):
    assert faults_of(tmp_path, changed(":MappingMission", ":Mapping"))[0].key == "scenario.mission"


def test_an_object_that_is_no_strategy_is_a_fault(tmp_path: Path):
    assert faults_of(tmp_path, changed('name = "remoras"', 'name = "os:getcwd"'))[0].key == "strategy.name"


@pytest.mark.parametrize(
    ("old", "key"),
    [('"remoras"', "strategy.name"), ('"missions.mapping:MappingMission"', "scenario.mission")],
)
def test_a_relative_reference_is_a_fault(tmp_path: Path, old: str, key: str):
    assert faults_of(tmp_path, changed(old, '".module:object"'))[0].key == key


@pytest.mark.parametrize("slot", ["0.0", '"0"'])
def test_two_owners_of_one_slot_are_noticed_however_the_number_is_written(tmp_path: Path, slot: str):
    """0.0 and "0" are taken for 0, or refused; but no two vehicles own one slot."""
    assert faults_of(tmp_path, changed("slot = 1", f"slot = {slot}"))


def test_a_thing_named_like_a_mission_is_a_fault(tmp_path: Path):
    assert faults_of(tmp_path, changed('name = "jetty"', 'name = "Supervision"').replace('"jetty"', '"Supervision"'))


@pytest.mark.parametrize("resolution", ["1e-16", "0.1234567891"])
def test_a_resolution_of_time_that_no_field_can_have_is_a_fault(tmp_path: Path, resolution: str):
    text = changed("range_m = 500.0", f"range_m = 500.0\ntime_resolution_s = {resolution}")
    assert faults_of(tmp_path, text)[0].key == "communication.time_resolution_s"


def test_a_policy_whose_header_fills_the_packets_of_the_modem_is_a_fault(tmp_path: Path):
    """17 vehicles: the matrix has 17 * 16 = 272 bits, and 31 B hold 248."""
    text = changed("s2c-18-34", "seatrac-x150")
    boat = text[text.index("[[vehicle]]") : text.index("[[vehicle]]", text.index("[[vehicle]]") + 1)]
    for slot in range(2, 17):
        diver = boat.replace("Boat", f"Diver{slot}").replace("Skipper", "Hand").replace("slot = 1", f"slot = {slot}")
        text += "\n" + diver
    assert any(fault.key in ("communication.policy", "communication.modem") for fault in faults_of(tmp_path, text))


def test_decisions_more_frequent_than_ticks_are_a_fault(tmp_path: Path):
    assert faults_of(tmp_path, SMALL, "decision.period_s=0.1")


def test_a_head_that_nobody_can_be_because_of_whom_it_must_be_played_by_is_a_fault():
    """The Coordinator must be the Tactician, AUV00, which is not able to play it; AUV01 is."""
    settings = ['vehicle.AUV00.playable_roles=["Tactician", "Cartographer", "LeftWinger", "Midfield", "RightWinger"]']
    settings += ['vehicle.AUV01.playable_roles=["Performer", "Coordinator", "Cartographer"]']
    settings += ['vehicle.AUV02.playable_roles=["Performer", "Cartographer"]']
    with pytest.raises(ConfigurationError, match="Coordinator"):
        load("mapping-rendezvous", [("--set", setting) for setting in settings])


def test_a_succession_names_roles_of_its_group_and_somebody_who_is_able_to_lead():
    with pytest.raises(ConfigurationError, match=r"group.Operational.succession.*Performr.*Performer"):
        load("mapping-rendezvous", [("--set", 'group.Operational.succession=["Performr"]')])
    with pytest.raises(ConfigurationError, match=r"group.Operational.succession.*nobody can fill it.*Coordinator"):
        load(
            "mapping-rendezvous",
            [
                ("--set", 'group.Operational.succession=["Cartographer"]'),
                *(
                    ("--set", f'vehicle.{name}.playable_roles=["Performer", "LeftWinger", "Midfield", "RightWinger"]')
                    for name in ("AUV01", "AUV02")
                ),
                ("--set", 'vehicle.AUV00.playable_roles=["Tactician", "Coordinator", "LeftWinger"]'),
                ("--set", 'vehicle.ASV00.playable_roles=["MissionAdministrator", "Cartographer"]'),
            ],
        )


def test_a_name_too_long_for_a_file_is_no_scenario():
    with pytest.raises(ConfigurationError):
        load("a" * 300)


def test_no_such_scenario_names_the_nearest():
    with pytest.raises(ConfigurationError, match=r"maping-rendezvous.*did you mean 'mapping-rendezvous'"):
        load("maping-rendezvous")


def test_a_folder_is_no_scenario(tmp_path: Path):
    with pytest.raises(
        ConfigurationError, match="a TOML file or one of arrows-archaeology, escort-lines, ferry-passage"
    ):
        load(str(tmp_path))


def test_text_that_is_no_toml_is_told_with_its_place(tmp_path: Path):
    (fault,) = faults_of(tmp_path, SMALL.replace("slot = 1", "slot = = 1"))
    assert f"line {line_of(SMALL, 'slot = 1')}" in fault.allowed


def test_bytes_that_are_no_text_are_told(tmp_path: Path):
    file = tmp_path / "noise.toml"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match=r"noise\.toml.*cannot be read"):
        load(str(file))


# Several faults -----------------------------------------------------------------------------------


def test_all_faults_are_told_at_once_in_the_order_of_the_file(tmp_path: Path):
    text = SMALL
    for old, new in [
        ("per = 0.2", "per = 2.0"),
        ("cell_m = 10.0", "cel_m = 10.0"),
        ('modem = "s2c-18-34"', 'modem = "s2c"'),
        ("[10.0, 0.0]", "[-60.0, 0.0]"),
        ('"Hand", "Mapper", "Scout"', '"Hand", "Mapper", "Scot"'),
    ]:
        text = text.replace(old, new, 1)
    found = faults_of(tmp_path, text)
    keys = {fault.key for fault in found}
    assert keys >= {
        "world.cel_m",
        "world.cell_m",
        "communication.modem",
        "channel.per",
        "vehicle.Diver.start_m",
        "vehicle.Diver.playable_roles",
        "group.Team.role.Scout",
    }
    lines = [fault.line or 0 for fault in found]
    assert lines == sorted(lines)


def test_an_empty_file_is_told_what_is_missing(tmp_path: Path):
    missing = {fault.key for fault in faults_of(tmp_path, "") if fault.allowed == "missing"}
    assert missing >= {"scenario", "world", "communication", "channel", "strategy", "group", "vehicle"}


@pytest.mark.parametrize("wrong", ["5", '"text"', "[]", "[1, 2]", "{}", "true", "1979-05-27"])
@pytest.mark.parametrize("table", list(Scenario.model_fields))
def test_a_value_where_a_table_belongs_is_a_fault_and_no_crash(tmp_path: Path, table: str, wrong: str):
    file = tmp_path / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    setting = [("--set", f"{table}={wrong}")]
    fine = {
        ("fault", "[]"),
        ("ban", "[]"),
        ("need", "[]"),
        ("beacon", "[]"),
        ("role", "[]"),
        ("group_template", "[]"),
        *(
            (one, "{}")
            for one in (
                "decision",
                "fleet",
                "uncertainty",
                "guidance",
                "current",
                "navigation",
                "worldmodel",
                "modem",
                "damage",
                "watch",
            )
        ),
    }  # have defaults
    if (table, wrong) in fine:
        load(str(file), setting)
        return
    with pytest.raises(ConfigurationError, match=table):
        load(str(file), setting)


def test_a_fault_in_one_of_two_vehicles_does_not_make_them_too_few(tmp_path: Path):
    found = faults_of(tmp_path, changed("energy_j = 1.0e6\n", ""))
    assert [fault.key for fault in found] == ["vehicle.Boat.energy_j"]


def test_the_line_of_a_missing_key_is_in_its_own_table(tmp_path: Path):
    text = SMALL.replace("energy_j = 1.0e6\n", "", 1)
    (fault,) = [fault for fault in faults_of(tmp_path, text) if fault.allowed == "missing"]
    assert fault.key == "vehicle.Boat.energy_j"
    assert fault.line is not None
    assert line_of(text, "[[vehicle]]") <= fault.line < line_of(text, "[[vehicle]]", 2)


def test_the_line_is_right_where_a_name_stands_behind_the_key(tmp_path: Path):
    text = SMALL.replace(
        'name = "Diver"\nvehicle_type = "AUV"\nslot = 0', 'vehicle_type = "AUV"\nslot = 5\nname = "Diver"'
    )
    (fault,) = [fault for fault in faults_of(tmp_path, text) if fault.key == "vehicle.Diver.slot"]
    assert fault.line == line_of(text, "slot = 5")


def test_two_things_of_one_name_are_told_with_the_line_of_one_of_them(tmp_path: Path):
    text = SMALL.replace('name = "Diver"', 'name = "Boat"')
    found = [fault for fault in faults_of(tmp_path, text) if fault.given == '"Boat"']
    assert found
    assert found[0].line in (line_of(text, 'name = "Boat"'), line_of(text, 'name = "Boat"', 2))


def importance_of(objective: str, value: float) -> Callable[[Scenario], bool]:
    return lambda scenario: bool(scenario.mission.importance[objective] == value)


# --set --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("setting", "read"),
    [
        ("channel.per=0.35", lambda s: s.channel.per == 0.35),
        ("channel.name=perfect", lambda s: s.channel.name == "perfect"),
        ('channel.name="perfect"', lambda s: s.channel.name == "perfect"),
        ("communication.carrier_evidence=false", lambda s: s.communication.carrier_evidence is False),
        ("decision.weight_external = 0", lambda s: s.decision.weight_external == 0.0),
        ("vehicle.AUV01.survey_speed_mps=1.7", lambda s: s.vehicle[2].survey_speed_mps == 1.7),
        ("vehicle.AUV01.sensor.swath_m=30", lambda s: s.vehicle[2].sensor[0]["swath_m"] == 30.0),
        ("group.Operational.role.Performer.minimum=2", lambda s: s.group[1].role[1].minimum == 2),
        ("rally_point.operational rally.position_m=[1, 2]", lambda s: s.rally_point[0].position_m == (1.0, 2.0)),
        ("world.x_m=[-1000, 1000]", lambda s: s.world.x_m == (-1000.0, 1000.0)),
        ("world.origin_deg=[-33.9, 18]", lambda s: s.world.origin_deg == (-33.9, 18.0)),
        ('mission.importance."Performer.RendezVous"=0.5', importance_of("Performer.RendezVous", 0.5)),
        ("mission.importance.Mapping=0.25", importance_of("Mapping", 0.25)),
    ],
)
def test_a_setting_reaches_its_key(setting: str, read: Callable[[Scenario], bool]):
    assert not read(load("mapping-rendezvous"))
    assert read(load("mapping-rendezvous", [("--set", setting)]))


def test_two_values_for_one_key_are_refused():
    """One of them would silently win."""
    with pytest.raises(ConfigurationError, match=r"--per = .*: contradicts --set, .* too, = 0.1"):
        load("mapping-rendezvous", [("--set", "channel.per=0.1"), ("--per", "channel.per=0.3")])


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("channel.per=2", r"--set \(channel\.per\) = 2: input should be less than 1"),
        ("channel.prr=0.2", r"--set \(channel\.prr\).*did you mean 'per'"),
        ("vehicle.AUV09.slot=1", "'AUV09' is none of ASV00, AUV00, AUV01, AUV02"),
        ("vehicle.AUV01=1", "names a list"),
        ("channel.name.x=1", "channel.name is no table"),
        ("channel.per", "KEY=VALUE"),
        ("=3", "KEY=VALUE"),
        ("communication.policy=ak", "--set.*did you mean 'ack'"),
        ("nowhere=1", r"--set \(nowhere\).*unknown key"),
    ],
)
def test_a_bad_setting_is_told_by_the_name_of_its_option(setting: str, says: str):
    with pytest.raises(ConfigurationError, match=says):
        load("mapping-rendezvous", [("--set", setting)])


# explain ------------------------------------------------------------------------------------------


def test_weights_under_which_nothing_performed_is_ever_left_are_refused():
    """3 is as much as an importance of 1 and the loudest call, 2.0; a little less is allowed."""
    refused = ("--set", "decision.weight_continuing=3")
    with pytest.raises(ConfigurationError, match=r"weight_continuing\) = 3: must be below 3 = 1 \+ weight_external"):
        load("mapping-rendezvous", [refused])
    with pytest.raises(ConfigurationError, match=r"must be below 1 = 1 \+ weight_external"):
        load("mapping-rendezvous", [("--set", "decision.weight_continuing=1"), ("--set", "decision.weight_external=0")])
    load("mapping-rendezvous", [("--set", "decision.weight_continuing=2.99")])
    load("mapping-rendezvous", [("--set", "decision.weight_external=50")])


def test_a_key_that_is_gone_says_what_replaced_it():
    says = r"decision\.hysteresis\) = 0\.1: is no key any more; weight_continuing alone keeps a vehicle at what it"
    with pytest.raises(ConfigurationError, match=says):
        load("mapping-rendezvous", [("--set", "decision.hysteresis=0.1")])


def test_every_key_of_the_shipped_scenario_is_explained():
    known = explanations()
    assert all(meaning for _, meaning in known.values())
    assert {"channel.per", "vehicle.sensor.swath_m", "group.role.played_by", "decision.period_s"} <= set(known)


def test_an_explanation_gives_limits_and_default():
    kind, meaning = explanations()["channel.per"]
    assert "at least 0" in kind
    assert "below 1" in kind
    assert "default 0.0" in kind
    assert "packet error rate" in meaning


@pytest.mark.parametrize("vehicles", ["3", "[]", '"AUV00"'])
def test_no_vehicles_are_one_fault_and_not_one_of_all_that_nobody_is_able_to_do(tmp_path: Path, vehicles: str):
    (fault,) = faults_of(tmp_path, SMALL, f"vehicle={vehicles}")
    assert fault.key == "--set (vehicle)"


@pytest.mark.parametrize("range_m", ["1e300", "100001.0", "0.0", "inf"])
def test_a_range_beyond_any_modem_is_refused(tmp_path: Path, range_m: str):
    """Sound needs 67 s for 100 km, which is the guard of every slot then."""
    (fault,) = faults_of(tmp_path, SMALL, f"communication.range_m={range_m}")
    assert "communication.range_m" in fault.key


@pytest.mark.parametrize(
    "setting", ["mission.x=" + "[" * 5000 + "]" * 5000, "mission." + "a." * 5000 + "b=1", "x=" + "[" * 60 + "]" * 60]
)
def test_a_setting_nested_too_deep_is_one_fault(tmp_path: Path, setting: str):
    file = tmp_path / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    with pytest.raises(ConfigurationError, match="levels deep") as caught:
        load(str(file), [("--set", setting)])
    assert len(str(caught.value)) < 600
