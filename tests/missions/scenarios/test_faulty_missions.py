"""User missions and sensors with one fault: one message in every command, and no partial output."""

import re
from pathlib import Path

import faulty_missions
import pytest
from small_mission import SMALL, line_of
from typer.testing import CliRunner

from remoras.cli import app
from remoras.errors import PluginError
from remoras.recorder import Column, Table

HERE = "faulty_missions"
MAPPING = "missions.mapping:MappingMission"
RUN = ["--set", "scenario.duration_s=120"]


def with_mission(name: str) -> str:
    return SMALL.replace(MAPPING, f"{HERE}:{name}")


def with_sensor(kind: str) -> str:
    """The Diver has another sensor, which every activity switches on."""
    return with_mission("SwitchesAllOn") + f'\n[[vehicle.sensor]]\nname = "other"\ntype = "{HERE}:{kind}"\n'


def in_lists(text: str) -> str:
    return text.replace("[vehicle.sensor]\n  swath_m", "[[vehicle.sensor]]\n  swath_m", 1)


def refused(folder: Path, text: str, *commands: str) -> list[str]:
    """Output of each command: exit 2, no traceback, empty stdout, and only the scenario in the folder."""
    file = folder / "pond.toml"
    file.write_text(in_lists(text), encoding="utf-8")
    said = []
    for command in commands:
        arguments = [*RUN, "--out", str(folder / "out")] if command == "run" else []
        result = CliRunner().invoke(app, [command, str(file), *arguments])
        assert result.exit_code == 2, result.output
        assert isinstance(result.exception, SystemExit)
        assert "Traceback" not in result.stderr
        assert result.stdout == ""
        assert [path.name for path in folder.iterdir()] == ["pond.toml"]
        said.append(result.stderr)
    return said


def test_faultless_mission_and_sensor_are_accepted(tmp_path: Path) -> None:
    """So that the refusals below are for the reason that they state."""
    for number, text in enumerate((with_mission("Sound"), with_sensor("SounderSettings"))):
        folder = tmp_path / str(number)
        folder.mkdir()
        file = folder / "pond.toml"
        file.write_text(in_lists(text), encoding="utf-8")
        assert CliRunner().invoke(app, ["validate", str(file)]).exit_code == 0
        ran = CliRunner().invoke(app, ["run", str(file), *RUN, "--out", str(folder / "out")])
        assert ran.exit_code in (0, 1), ran.output  # 1: 120 s are too short for the mission
        assert (folder / "out" / "summary.json").is_file()
    assert (folder / "out" / "soundings.parquet").is_file()


# Before a run: validate says the same -------------------------------------------------------------

MISSIONS = [
    ("Lacking", r"a mission: lacks activity_sets, behaviour_for, from_scenario, jobs, social_domain, truth of remoras"),
    ("OtherScenario", r"its Scenario must be missions\.scenarios\.Scenario or a subclass of it"),
    ("WrongTruth", r"a mission: truth\(self\).* cannot be called as truth\(recorder, world\)"),
    ("FromScenarioRaises", r"its from_scenario and jobs must .* but raised KeyError: 'buoys'"),
    ("CheckRaises", r"its check must .* but raised KeyError: 'buoys'"),
    ("JobAtNumber", r"its jobs must .* but raised TypeError"),
    ("Doubling", r"but raised PluginError: Doubling\.jobs_of gives several jobs the name 'buoy'; rename one"),
    ("ManyFound", r"instances_found_per_vehicle returned 'many'; expected: 0 or more"),
    ("LessThanNone", r"most_observations returned -1; expected: 0 or more"),
    ("NoPairs", r"instances raised ValueError: too many values to unpack .*; expected: pairs of class and name"),
    ("DomainOfText", r"activity_domain returned 'survey'; expected: a remoras\.htn\.Domain, or None"),
    ("NatureOfNumber", r"nature returned 7; expected: a function, or None"),
    ("Incomplete", r"its completed returned None; expected: a Scenario"),
    ("NoMetric", r"a mission: metrics holds <built-in function len>; expected a tuple of Metric"),
    ("NoVocabulary", r"its vocabulary cannot be read: /nowhere/buoys\.ttl: cannot be read"),
    ("NoSensorSettings", r"a mission: sensors has <class 'dict'> as mapping; expected .*SensorSettings"),
    ("Sounder", r"Scenario|lacks"),
    ("DomainOfNumbers", r"social_domain returned 5; expected: a remoras\.htn\.Domain"),
    ("Dancing", r"social_domain returned .*; expected: .* AllocateRoles, GiveMission, AssignObjective"),
    ("NoTruth", r"truth returned None; expected: an object with milestones, goal_fraction, is_over, observe, close"),
    ("FigureOfNumbers", r"figures returned \(3,\); expected: a tuple of Figure, Layer and Mark"),
    ("CheckOfText", r"its check must give missions\.errors\.ConfigurationFault values, but gave \['no buoys'\]"),
]


CONTRADICTING = [
    ("NoDirection", r"metric wear: better: allowed: Better\.HIGHER, Better\.LOWER, Better\.NEITHER"),
    ("JobOutside", r"pond\.toml: job\.buoy\.place_m = \[9999\.0, 0\.0\]: outside the world, x "),
    ("JobNowhere", r"pond\.toml: job\.buoy\.place_m = \[0\.0, nan\]: outside the world, x "),
    ("EndsBefore", r"pond\.toml: job\.buoy = -\d[\d.]+: the time \(s\) at which a vehicle .* ends it"),
    ("NeverEnds", r"pond\.toml: job\.buoy = nan: the time \(s\) at which a vehicle .* ends it"),
    ("UnknownClass", r"instances: no class is named 'Boy'"),
    ("OtherColumns", r"table 'coverage' is declared twice, once with the columns time_s, vehicle, cell_x, cell_y: ren"),
    ("Unmakable", r"sensor other of Diver: make\(data\) raised RuntimeError: no transducer"),
    ("OffByDefault", r"vehicle\.Diver\.sensor\.other\.interval_s = -1\.0: input should be greater than 0"),
    ("MuteSettings", r"sensor other of Diver: lacks sense of remoras\.sensor\.Sensor"),
    ("NoTableSettings", r"sensor other of Diver: table is str; expected a remoras\.Table"),
]
AT_SEA = [
    ("BrokenSettings", r"other.*sense.*ZeroDivisionError: no echo"), ("NumbersSettings", r"other.*sense.*Observation"),
    ("TablelessSettings", r"other of Diver: its observation has the row .*, but its table is None"),
    ("ShortRowSettings", r"soundings: a row does not fit its columns .*depth_m \(float\)"),
    ("MetricRaises", f"metric wear of {HERE}:MetricRaises: its function raised ZeroDivisionError: no echo"),
    ("TruthRaises", r"the mission's truth: observe raised KeyError: 'buoys', in .*, line \d+; expected: True or False"),
    ("Undivided", "mission Undivided: is_individual returned 'perhaps'; expected: true or false"),
    ("Undecided", "mission Undecided: is_enough returned 'perhaps'; expected: true or false"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "says"), [*MISSIONS, *CONTRADICTING, *AT_SEA])
def test_violation_of_the_plugin_interface_is_one_message(tmp_path: Path, name: str, says: str) -> None:
    """Where the scenario is read it is a fault of the file; before a run and after it nothing is written."""
    text = with_sensor(name) if name in {"Unmakable", "OffByDefault", *faulty_missions.SENSORS} else with_mission(name)
    for said in refused(tmp_path, text, *(["run"] if (name, says) in AT_SEA else ["validate", "run"])):
        assert re.search(says, said.replace("\n", " ")), said
        assert len(said.splitlines()) == 1 or (name, says) in AT_SEA
        if (name, says) in MISSIONS:
            assert f'pond.toml:{line_of(text, "mission =")}: scenario.mission = "{HERE}:{name}": ' in said


def test_mission_of_jobs_must_declare_its_objective() -> None:
    with pytest.raises(PluginError, match="Objectless lacks objective, the name of the objective of roles with a job"):
        faulty_missions.Objectless.from_scenario(None)  # type: ignore[arg-type]


def test_column_of_unknown_kind_is_refused_at_its_declaration() -> None:
    with pytest.raises(PluginError, match="table 'depths', column 'depth_m': kind is 'double'; allowed: float, int"):
        Table("depths", (Column("depth_m", "double", "m"),))


def test_columns_that_are_no_tuple_of_columns_are_refused_at_their_declaration() -> None:
    with pytest.raises(PluginError, match=r"table 'depths': columns is Column\(.*\); expected a tuple of Column"):
        Table("depths", (Column("depth_m", "float", "m")))  # type: ignore[arg-type]
