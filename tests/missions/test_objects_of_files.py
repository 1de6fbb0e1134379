"""An object of a user's file is named alike wherever a scenario or a study names one: ``file.py:OBJECT``."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import remoras
from missions.sweeps import load_study
from remoras import load

TEMPLATE = Path(remoras.__file__).parent / "cli" / "templates" / "nearest.py"
STUDY = """
[study]
name = "own"
scenario = "mapping-rendezvous"
strategies = ["{name}.py:NEAREST"]
repeats = 1
"""


@pytest.mark.parametrize("given", ["{name}.py:NEAREST", "{name}:NEAREST"])
def test_a_strategy_of_a_file_in_the_current_folder(
    given: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = f"own_{len(given)}"
    shutil.copy(TEMPLATE, tmp_path / f"{name}.py")
    monkeypatch.chdir(tmp_path)
    load("mapping-rendezvous", strategy=f"{name}.py:NEAREST")
    assert load("mapping-rendezvous", strategy=given.format(name=name)).strategy.name == f"{name}:NEAREST"


def test_a_study_lists_strategies_of_files_beside_it(tmp_path: Path) -> None:
    shutil.copy(TEMPLATE, tmp_path / "beside_study.py")
    study = tmp_path / "study.toml"
    study.write_text(STUDY.format(name="beside_study"))
    (configuration,) = load_study(str(study)).configurations
    assert configuration.scenario.strategy.name == "beside_study:NEAREST"


@pytest.mark.parametrize("hidden", ["exchange.py", "missions/__init__.py", "worldmodel/notes.txt"])
def test_what_hides_a_package_of_ours_is_named(hidden: str, tmp_path: Path) -> None:
    (tmp_path / hidden).parent.mkdir(exist_ok=True)
    (tmp_path / hidden).touch()
    script = tmp_path / "script.py"
    script.write_text("import remoras\n")
    asked = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    package = hidden.partition("/")[0].removesuffix(".py")
    assert f"hides the simulator's package '{package}': give it another name" in asked.stderr
    assert str(tmp_path / package) in asked.stderr
