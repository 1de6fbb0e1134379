"""Strategies of a user's files: added to a study by option, or listed in it as ``file.py:OBJECT``."""

import itertools
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from sweeping import study_text, written

import remoras
from missions.errors import StudyChangedError
from missions.sweeps import load_study, sweep
from remoras.errors import PluginError

OWN = """
from dataclasses import dataclass
from typing import ClassVar

from remoras.strategies.central import STRATEGY as CENTRAL
from remoras.strategy import Declaration


@dataclass(frozen=True)
class Mine:
    turns: int = 2
    name: ClassVar[str] = "mine"
    declaration: ClassVar[Declaration] = CENTRAL.declaration
    form = staticmethod(CENTRAL.form)
    adapt = staticmethod(CENTRAL.adapt)
    negotiator = staticmethod(CENTRAL.negotiator)


class Needy(Mine):
    def __init__(self, word):
        pass


class Half:
    name = "half"


INSTANCE = Mine(3)
"""
NUMBER = itertools.count()


def own_file(folder: Path) -> Path:
    """A file of a name that no other test has: a module is imported once."""
    path = folder / "elsewhere" / f"strategy_of_mine_{next(NUMBER)}.py"
    path.parent.mkdir(exist_ok=True)
    path.write_text(OWN, encoding="utf-8")
    return path


SMALL = study_text(repeats=2, per="[0.1]").replace('["ack", "mps-ack"]', '["ack"]')


def test_python_interface_adds_strategies_to_a_sweep_folder(tmp_path: Path) -> None:
    study, out = written(tmp_path, SMALL), tmp_path / "out"
    sweep(load_study(str(study)), out)
    grown = remoras.sweep(study, out, strategies=[f"{own_file(tmp_path)}:INSTANCE"])
    assert grown.status["done"] == 4
    with pytest.raises(StudyChangedError, match="strategies: was"):  # it would lose them again
        sweep(load_study(str(study)), out)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("FOLDER/none.py:Mine", "no such file: "),
        ("FILE:Half", "a strategy: lacks "),
        ("FILE:Needy", "a class that needs no arguments, or an object; "),
        ("FOLDER/statistics.py:Mine", "statistics.py has the name of "),
    ],
)
def test_invalid_strategy_file_is_refused_by_name(tmp_path: Path, given: str, expected: str) -> None:
    for name in ("statistics.py", "two-words.py"):
        (tmp_path / name).write_text(OWN, encoding="utf-8")
    own = given.replace("FILE", str(own_file(tmp_path))).replace("FOLDER", str(tmp_path))
    with pytest.raises(PluginError) as caught:
        load_study(str(written(tmp_path, SMALL)), [own])
    assert f'--strategy "{own}": ' in str(caught.value)
    assert expected in str(caught.value)


TEMPLATE = Path(remoras.__file__).parent / "cli" / "templates" / "nearest.py"


def test_study_may_list_strategies_of_files_beside_it(tmp_path: Path) -> None:
    shutil.copy(TEMPLATE, tmp_path / "beside_study.py")
    text = SMALL.replace('"remoras"', '"beside_study.py:NEAREST"')
    (configuration,) = load_study(str(written(tmp_path, text))).configurations
    assert configuration.scenario.strategy.name == "beside_study:NEAREST"


@pytest.mark.parametrize("hidden", ["exchange.py", "missions/__init__.py", "worldmodel/notes.txt"])
def test_file_that_hides_a_package_of_the_simulator_is_named(hidden: str, tmp_path: Path) -> None:
    (tmp_path / hidden).parent.mkdir(exist_ok=True)
    (tmp_path / hidden).touch()
    script = tmp_path / "script.py"
    script.write_text("import remoras\n")
    asked = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    package = hidden.partition("/")[0].removesuffix(".py")
    assert f"hides the simulator's package '{package}': give it another name" in asked.stderr
    assert str(tmp_path / package) in asked.stderr
