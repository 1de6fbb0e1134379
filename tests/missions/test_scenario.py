"""Scenario files: all faults are reported at once, with file, line, key and allowed values."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from small_mission import SMALL, faults_of, line_of

from missions.errors import ConfigurationError
from missions.scenarios import Scenario, load, shipped
from remoras.strategies import parameters, strategies


def test_shipped_name_and_its_file_give_the_same_scenario():
    for name, path in shipped().items():
        assert load(name) == load(str(path))


# One fault ----------------------------------------------------------------------------------------

ONE_FAULT = [
    # (replaced, by, key, given, what the message says, where it points)
    ('policy = "mps', 'polcy = 1\npolicy = "mps', "communication.polcy", "1", "unknown key.*did you mean 'policy'",
     "polcy"),
    ("cell_m = 10.0", "cell_m = -1.0", "world.cell_m", "-1.0", "greater than or equal to 0.1", "cell_m"),
    ("cell_m = 10.0", 'cell_m = "10 m"', "world.cell_m", '"10 m"', "valid number, without quotes, unit or %", "cell_m"),
    ("playsRole = 50", "playRole = 50", "communication.needs.playRole", "", "no attribute.*'playsRole'", "playRole"),
    ('name = "bernoulli"', 'name = "bernouli"', "channel.name", '"bernouli"', "allowed: perfect, .*mean 'bernoulli'",
     'name = "bernouli"'),
    (":MappingMission", ":Nothing", "scenario.mission", "", "has no Nothing", "mission"),
    ("[200.0, 200.0]", "[200.0, 260.0]", "rally_point.jetty.position_m", "[200.0, 260.0]", "outside the world",
     "position_m"),
    ("x_m = [-50.0, 250.0]", "x_m = [250.0, -50.0]", "world.x_m", "", "allowed: the lower end first", "x_m"),
    ("slot = 1", "slot = 0", "vehicle.Diver.slot", "0", "owned by Boat and Diver; one owner per slot", "slot:2"),
    ('"Mapper", ', '"Maper", ', "vehicle.Diver.playable_roles", '"Maper"', "did you mean 'Mapper'",
     "playable_roles:2"),
    ('"Hand", "Mapper", "Scout"', '"Hand", "Mapper"', "group.Team.role.Scout", "", "no vehicle is able to play it",
     'name = "Scout"'),
    ("  minimum = 1\n  founding", "  minimum = 2\n  founding", "group.Team.role.Hand.minimum", "2", "only 1 vehicle",
     "minimum = 2"),
    ("head = true", "head = false", "group.Team.role", "0 heads", "one role must be head", "[[group.role]]"),
    ('mission = "AreaMapping"', 'mission = "Mapping"', "group.Team.mission", '"Mapping"', "mean 'AreaMapping'",
     'mission = "Mapping"'),
    ("slot = 1", "slot = 1\nsocial_layer = false", "group.Team.role.Skipper", "",
     "social_layer = true for one of Boat", 'name = "Skipper"'),
    ("depth_m = 5.0", "depth_m = 50.0", "vehicle.Diver.depth_m", "50.0", "0 to depth_limit_m = 30.0", "depth_m"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "key", "given", "says", "where"), ONE_FAULT, ids=[f"{c[2]}={c[3]}" for c in ONE_FAULT]
)
def test_fault_of_a_scenario_is_one_message_with_its_line(
    tmp_path: Path, old: str, new: str, key: str, given: str, says: str, where: str
):
    text = SMALL.replace(old, new, 1)
    assert text != SMALL
    found = [fault for fault in faults_of(tmp_path, text) if fault.key == key]
    assert len(found) == 1
    (fault,) = found
    assert given in fault.given
    assert re.search(says, fault.allowed)
    begins, _, occurrence = where.partition(":")
    assert fault.line == line_of(text, begins, int(occurrence or 1))


# Several faults -----------------------------------------------------------------------------------


def test_malformed_tables_are_reported_before_faults_between_tables(tmp_path: Path):
    between = SMALL
    for old, new in (
        ('modem = "s2c-18-34"', 'modem = "s2c"'), ("[10.0, 0.0]", "[-60.0, 0.0]"),
        ('"Hand", "Mapper", "Scout"', '"Hand", "Mapper", "Scot"'),
    ):  # fmt: skip
        between = between.replace(old, new, 1)
    malformed = between.replace("per = 0.2", "per = 2.0", 1).replace("cell_m = 10.0", "cel_m = 10.0", 1)
    keys = {"communication.modem", "vehicle.Diver.playable_roles", "group.Team.role.Scout"}
    for text, told in ((malformed, {"world.cel_m", "world.cell_m", "channel.per"}), (between, keys)):
        found = faults_of(tmp_path, text)
        assert {fault.key for fault in found} >= told
        lines = [fault.line or 0 for fault in found]
        assert lines == sorted(lines)


@pytest.mark.parametrize("wrong", ["5", "[]", "[1, 2]", "{}"])
@pytest.mark.parametrize("table", list(Scenario.model_fields))
def test_a_value_where_a_table_belongs_is_a_fault_and_no_crash(tmp_path: Path, table: str, wrong: str):
    file = tmp_path / "pond.toml"
    file.write_text(SMALL, encoding="utf-8")
    setting = [("--set", f"{table}={wrong}")]
    lists = {"fault", "ban", "need", "beacon", "role", "group_template"}
    tables = {"decision", "fleet", "uncertainty", "guidance", "current", "navigation", "worldmodel", "modem", "damage"}
    if (wrong == "[]" and table in lists) or (wrong == "{}" and table in {*tables, "watch"}):  # have defaults
        load(str(file), setting)
        return
    with pytest.raises(ConfigurationError, match=table):
        load(str(file), setting)


# --set --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("setting", "read"),
    [
        ("channel.per=0.35", lambda s: s.channel.per == 0.35),
        ("communication.carrier_evidence=false", lambda s: s.communication.carrier_evidence is False),
        ("vehicle.AUV01.sensor.swath_m=30", lambda s: s.vehicle[2].sensor[0]["swath_m"] == 30.0),
        ("group.Operational.role.Performer.minimum=2", lambda s: s.group[1].role[1].minimum == 2),
        ("rally_point.operational rally.position_m=[1, 2]", lambda s: s.rally_point[0].position_m == (1.0, 2.0)),
        ('mission.importance."Performer.RendezVous"=1', lambda s: s.mission.importance["Performer.RendezVous"] == 1.0),
    ],
)
def test_setting_changes_its_key(setting: str, read: Callable[[Scenario], bool]):
    assert not read(load("mapping-rendezvous"))
    assert read(load("mapping-rendezvous", [("--set", setting)]))


@pytest.mark.parametrize("name", strategies())
def test_another_strategy_takes_the_parameters_that_it_has(tmp_path: Path, name: str) -> None:
    """Of the scenario's own parameters; one given with the strategy must be its own."""
    file = tmp_path / "set.toml"
    own = '[strategy]\nname = "central"\nparameters = {queue = 3, join_s = 90.0}\n'
    file.write_text(SMALL.replace('[strategy]\nname = "remoras"\n', own), encoding="utf-8")
    has = {parameter.name for parameter in parameters(strategies()[name])}
    asked = ("--strategy", f"strategy.name={name}")
    left = load(str(file), [asked]).strategy.parameters
    assert left == {key: value for key, value in {"queue": 3, "join_s": 90.0}.items() if key in has}
    for key in {"queue", "join_s"} - has:
        with pytest.raises(ConfigurationError, match=f"strategy.parameters.{key}"):
            load(str(file), [asked, ("--set", f"strategy.parameters.{key}=3")])


@pytest.mark.parametrize("name", sorted(shipped()))
def test_importance_of_an_unknown_role_or_objective_is_refused(name: str) -> None:
    """It would have no effect; importances of objectives that the mission has are taken."""
    for key, given in (("Nobody.RendezVous", "Nobody"), ("Rendezvous", "Rendezvous")):
        with pytest.raises(ConfigurationError) as refused:
            load(name, [("--set", f'mission.importance."{key}"=0.3')])
        assert [fault.given for fault in refused.value.faults] == [f'"{given}"']
    assert load(name, [("--set", "mission.importance.RendezVous=0.25")]).mission.importance["RendezVous"] == 0.25
