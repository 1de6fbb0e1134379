"""Code named by files is imported unless --no-plugins is given, which admits shipped code only."""

import os
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
import tomli_w
from invoked import refused, remoras

from missions.files import shipped, shipped_studies
from remoras import plugins
from remoras.cli import main
from remoras.cli.app import HOMES
from remoras.errors import PluginError
from remoras.plugins import NO_PLUGINS, named_object

OTHER = "canary:Bird"
KEYS = (
    "scenario.mission", "strategy.name", "communication.policy", "communication.value", "channel.name",
)  # fmt: skip


@pytest.fixture
def canary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A module that leaves a file when it is imported; returns that file."""
    sung = tmp_path / "sung"
    (tmp_path / "canary.py").write_text(f"open({str(sung)!r}, 'w').close()\nclass Bird: pass\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "canary", raising=False)
    yield sung
    sys.modules.pop("canary", None)


def scenario(folder: Path, key: str, value: object) -> Path:
    """The shipped scenario as a file with one key changed."""
    raw = tomllib.loads(shipped()["mapping-rendezvous"].read_text(encoding="utf-8"))
    table, name = key.split(".")
    raw[table][name] = value
    path = folder / "mine.toml"
    path.write_text(tomli_w.dumps(raw), encoding="utf-8")
    return path


def assert_refusal(message: str, *parts: str) -> None:
    """One line that names what is wrong and what is allowed."""
    assert message.count("\n") == 1, message
    for part in (*parts, "is not shipped", "--no-plugins", "allowed: shipped code"):
        assert part in message


@pytest.mark.parametrize("key", KEYS)
def test_a_file_naming_other_code_is_refused_before_its_import(tmp_path: Path, canary: Path, key: str) -> None:
    path = scenario(tmp_path, key, OTHER)
    assert_refusal(refused("validate", path, "--no-plugins"), f"{path}:", key, f'"{OTHER}"')
    assert not canary.exists()
    refused("validate", path)  # a bird is no part of a scenario
    assert canary.exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "mapping-rendezvous", "--set", f"strategy.name={OTHER}"),
        ("run", "mapping-rendezvous", "--strategy", OTHER),
        ("live", "mapping-rendezvous", "--strategy", OTHER, "--no-browser"),
        ("sweep", "strategies", "--strategy", "canary.py:Bird", "--out", "out"),
        ("sweep", "strategies", "--strategy", OTHER, "--out", "out"),
    ],
    ids=" ".join,
)
def test_options_that_name_other_code_are_refused(canary: Path, arguments: tuple[str, ...]) -> None:
    if arguments[1] == "strategies":
        arguments = (arguments[0], next(iter(shipped_studies())), *arguments[2:])
    assert_refusal(refused(*arguments, "--no-plugins"))
    assert not canary.exists()


def test_a_sensor_and_a_study_that_name_other_code_are_refused(tmp_path: Path, canary: Path) -> None:
    raw = tomllib.loads(shipped()["mapping-rendezvous"].read_text(encoding="utf-8"))
    for vehicle in raw["vehicle"]:
        vehicle["sensor"] = [{"type": OTHER}]
    path = tmp_path / "mine.toml"
    path.write_text(tomli_w.dumps(raw), encoding="utf-8")
    message = refused("validate", path, "--no-plugins")
    assert "mine.toml:" in message
    assert "vehicle.ASV00.sensor.type" in message
    assert f"{OTHER} is not shipped" in message
    study = tmp_path / "study.toml"
    tables = {"name": "mine", "scenario": "mapping-rendezvous", "repeats": 1, "strategies": ["remoras", OTHER]}
    study.write_text(tomli_w.dumps({"study": tables}), encoding="utf-8")
    assert_refusal(refused("sweep", study, "--out", "out", "--no-plugins"), "study.toml", OTHER)
    assert not canary.exists()


@pytest.mark.parametrize(("options", "is_looked_in"), [([], True), (["--no-plugins"], False)])
def test_plug_ins_are_searched_in_the_current_folder_unless_forbidden(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[str], is_looked_in: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(plugins, "_finder", plugins.PluginFolders())
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    monkeypatch.setattr(sys, "argv", ["remoras", "validate", "mapping-rendezvous", *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    assert (str(tmp_path) in plugins.plugin_folders()) is is_looked_in
    assert str(tmp_path) not in sys.path


def test_every_command_loading_code_has_no_plugins_and_keeps_the_environment() -> None:
    without = {name for name in HOMES if "--no-plugins" not in remoras(name, "--help").stdout}
    assert without == {"doctor", "new", "verify", "reproduce"}
    assert remoras("validate", "mapping-rendezvous", "--no-plugins").exit_code == 0
    assert NO_PLUGINS not in os.environ


def test_the_environment_variable_works_in_python_and_shipped_names_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(NO_PLUGINS, "1")
    assert named_object("missions.mapping:MappingMission").__name__ == "MappingMission"
    for reference in ("math:sqrt", "missions.files:Path", "remoras.plugins:importlib", "remorasx.mine:Mine"):
        with pytest.raises(PluginError, match="is not shipped"):
            named_object(reference)


@pytest.mark.parametrize(
    ("table", "name"),
    [
        *(("scenario", name) for name in ("a/b", "..", ".hidden", "a\0b", "=2+3", "-a")),
        *((table, "a/b") for table in ("group", "vehicle", "role", "study")),
    ],
)
def test_names_contain_no_path_and_no_spreadsheet_formula(tmp_path: Path, table: str, name: str) -> None:
    raw = tomllib.loads(shipped()["mapping-rendezvous"].read_text(encoding="utf-8"))
    changed = {"scenario": raw["scenario"], "vehicle": raw["vehicle"][0], "group": raw["group"][0]}
    if table == "study":
        raw = {"study": {"name": name, "scenario": "mapping-rendezvous", "repeats": 1}}
    elif table == "role":
        raw["group"][0]["role"][0]["name"] = name
    else:
        changed[table]["name"] = name
    path = tmp_path / "mine.toml"
    path.write_text(tomli_w.dumps(raw), encoding="utf-8")
    assert "allowed: 1 to 40 characters, none of them . / " in refused("validate", path)


def test_results_naming_other_code_import_none(tmp_path: Path, canary: Path) -> None:
    not_complete = 1
    done = remoras("run", "mapping-rendezvous", "--set", "scenario.duration_s=30", "--out", "dive")
    assert done.exit_code == not_complete
    manifest = tmp_path / "dive" / "manifest.json"
    text = manifest.read_text(encoding="utf-8")
    assert "missions.mapping:MappingMission" in text
    manifest.write_text(text.replace("missions.mapping:MappingMission", OTHER), encoding="utf-8")
    assert_refusal(refused("plot", "dive", "--no-plugins"), "manifest.json:", "scenario.mission", OTHER)
    assert_refusal(refused("query", "dive", "vehicles", "--no-plugins"), "manifest.json:", OTHER)
    assert_refusal(refused("replay", "dive", "--out", "dive.html", "--no-plugins"), "manifest.json:", OTHER)
    assert remoras("export", "dive", "--format", "csv", "--out", "tables", "--no-plugins").exit_code == 0
    assert not canary.exists()
    refused("plot", "dive")
    assert canary.exists()
