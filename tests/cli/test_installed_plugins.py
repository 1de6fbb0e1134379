"""Plug-ins of installed distributions: listed, used by name in every place, refused one by one."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from invoked import COMMAND, refused, remoras

from missions.scenarios import load
from missions.sweeps import code
from missions.sweeps.study import load_study
from remoras.cli.new import PLUGINS
from remoras.plugins import GROUP, NO_PLUGINS, installed_plugins

ROOT = Path(__file__).parents[2]
SHORT = ("--set", "scenario.duration_s=10")
WARM = 'vehicle.AUV01.sensor=[{swath_m=25.0, speed_limit_mps=2.0}, {type="warmth", every_s=5.0}]'
Install = Callable[..., Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Lays a distribution with entry points into a folder on Python's path, as pip does."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(site)
    monkeypatch.chdir(tmp_path)

    def made(distribution: str, **points: str) -> Path:
        info = site / f"{distribution.replace('-', '_')}-0.1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 0.1.0\n")
        lines = (f"{name.replace('__', '.')} = {reference}\n" for name, reference in points.items())
        (info / "entry_points.txt").write_text(f"[{GROUP}]\n{''.join(lines)}")
        return site

    return made


NAMES = dict(zip(PLUGINS, ("by_night", "floats", "warmth", "apart"), strict=True))


@pytest.fixture
def packages(install: Install) -> Iterator[None]:
    """A package of each template, written by the command and installed."""
    for kind, name in NAMES.items():
        assert remoras("new", kind, name, "--package").exit_code == 0
        folder = Path(f"remoras-{name.replace('_', '-')}")
        project = tomllib.loads((folder / "pyproject.toml").read_text())
        points = project["project"]["entry-points"][GROUP]
        site = install(folder.name, **{key.replace(".", "__"): value for key, value in points.items()})
        for package in project["tool"]["setuptools"]["packages"]:
            shutil.copytree(folder / package, site / package)
    yield
    for name in NAMES.values():
        sys.modules.pop(name, None)


def test_each_is_listed_with_its_distribution_unless_plug_ins_are_off(packages: None) -> None:
    entries = json.loads(remoras("list", "plugins", "--json").stdout)
    assert [(entry["name"], entry["description"]) for entry in entries] == [
        ("metric.apart", "apart:APART of remoras-apart 0.1.0"),
        ("mission.floats", "floats:BuoyMission of remoras-floats 0.1.0"),
        ("sensor.warmth", "warmth:WarmthSettings of remoras-warmth 0.1.0"),
        ("strategy.by_night", "by_night:BY_NIGHT of remoras-by-night 0.1.0"),
    ]
    assert json.loads(remoras("list", "plugins", "--json", "--no-plugins").stdout) == []
    assert "by_nigt" in refused("run", "mapping-rendezvous", "--strategy", "by_nigt")
    assert "did you mean 'by_night'?" in refused("run", "mapping-rendezvous", "--strategy", "by_nigt")
    without = refused("run", "mapping-rendezvous", "--strategy", "by_night", "--no-plugins")
    assert "by_night, " not in without.partition("allowed: ")[2]


def test_scenarios_store_the_object_so_that_digests_and_results_have_it(packages: None) -> None:
    options = ("strategy.name=by_night", 'scenario.metrics=["apart"]', WARM)
    scenario = load("mapping-rendezvous", [("--set", text) for text in options])
    assert code.references([scenario]) == {"by_night:BY_NIGHT", "apart:APART", "warmth:WarmthSettings"}
    assert set(code.code_digests(code.references([scenario]))) == {
        f"{name}/__init__.py" for name in ("by_night", "apart", "warmth")
    }
    floats = Path("remoras-floats", "floats", "floats.toml")
    floats.write_text(floats.read_text(encoding="utf-8").replace('"floats:BuoyMission"', '"floats"'), encoding="utf-8")
    assert load(str(floats)).scenario.mission == "floats:BuoyMission"


def test_studies_and_options_take_the_names(packages: None) -> None:
    study = Path("study.toml")
    study.write_text(
        '[study]\nname = "s"\nscenario = "mapping-rendezvous"\nstrategies = ["central", "by_night"]\nrepeats = 1\n'
        'metrics = ["apart", "mission_time_s"]\n',
        encoding="utf-8",
    )
    loaded = load_study(str(study))
    assert loaded.file.study.strategies == ("central", "by_night:BY_NIGHT")
    assert loaded.file.study.metrics == ("apart_m", "mission_time_s")
    remoras("run", "mapping-rendezvous", "--strategy", "by_night", *SHORT, "--out", "out")
    assert remoras("compare", "out", "--metric", "apart").stdout.startswith("apart ")


def test_a_shipped_name_stays_shipped(install: Install) -> None:
    install("theirs", strategy__central="nowhere:MINE", metric__mission_time_s="nowhere:M", robot__x="nowhere:X")
    assert load("mapping-rendezvous", [("--strategy", "strategy.name=central")]).strategy.name == "central"
    listed = remoras("list", "plugins").stdout
    assert "nowhere:MINE of theirs 0.1.0; not used: a shipped strategy has this name" in listed
    assert "nowhere:X of theirs 0.1.0; not used: allowed kinds are strategy, " in listed


def test_two_of_one_name_and_one_that_fails_are_refused_alone(install: Install) -> None:
    site = install("one", strategy__twin="one:MINE", strategy__broken="broken:MINE")
    install("two", strategy__twin="two:MINE")
    (site / "broken.py").write_text("raise RuntimeError('no licence')\n", encoding="utf-8")
    message = refused("run", "mapping-rendezvous", "--strategy", "twin")
    assert message == (
        "remoras: strategy twin is one:MINE of one 0.1.0 and two:MINE of two 0.1.0; name one of the objects, "
        "or remove one\n"
    )
    message = refused("run", "mapping-rendezvous", "--strategy", "broken")
    assert message.count("\n") == 1
    assert "RuntimeError: no licence" in message
    assert remoras("validate", "mapping-rendezvous").exit_code == 0
    assert "twin  " in remoras("list", "plugins").stdout


def test_without_distributions_of_the_group_no_metadata_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reading it takes 12 ms with 160 distributions."""

    def read(**_: object) -> None:
        raise AssertionError("metadata is read")

    monkeypatch.setattr("importlib.metadata.entry_points", read)
    monkeypatch.delenv(NO_PLUGINS, raising=False)
    assert installed_plugins() == ()


@pytest.mark.slow
def test_an_installed_feature_works_and_faulty_ones_are_left_out(install: Install) -> None:
    """The keys of features belong to the tables, so each run is a process."""
    site = install(
        "counts", feature__headcount="headcount:FEATURE", feature__torn="torn:FEATURE", feature__ban="torn:FEATURE"
    )
    shutil.copy(ROOT / "docs" / "examples" / "headcount.py", site)
    (site / "torn.py").write_text("raise RuntimeError('torn')\n", encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), str(ROOT)])}

    def run(*options: str) -> subprocess.CompletedProcess[str]:
        command = [*COMMAND, "run", "mapping-rendezvous", *SHORT, *options]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)

    counted = run("--set", "headcount=[{at_s=5.0}]", "--out", "counted")
    said = [line for line in counted.stderr.splitlines() if "left out" in line]
    assert said == [
        "remoras: feature ban is left out, torn:FEATURE of counts 0.1.0: its name: ban has it, too",
        "remoras: feature torn is left out, torn:FEATURE of counts 0.1.0: package.module:object that can be "
        "imported (RuntimeError: torn, in torn.py, line 1)",
    ]
    assert Path("counted", "headcount.parquet").is_file()
    assert run("--out", "plain").returncode == 1  # not complete after 10 s
    assert not Path("plain", "headcount.parquet").exists()
    assert "unknown key" in run("--set", "headcount=[{at_s=5.0}]", "--no-plugins").stderr
