"""Kept tables of a sweep that are lost or changed: made anew by the same sweep, and named by whoever reads them."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from sweeping import Serial, outcome, study_text, written

from missions.errors import OutputError
from missions.sweeps.driver import sweep
from missions.sweeps.folder import PARTS, TABLES, SweepFolder, SweepResults
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import load_study
from missions.sweeps.worker import run_task, verify

TEXT = study_text(repeats=2, per="[0.1]")


def lose(path: Path) -> None:
    path.unlink()


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def flip(path: Path) -> None:
    """A byte in the middle of the data: Parquet does not notice each."""
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 1
    path.write_bytes(bytes(content))


def replace_by_a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a finished sweep."""
    folder = tmp_path_factory.mktemp("sound")
    sweep(load_study(str(written(folder, TEXT))), folder / "out", executor=Serial())
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damage", "name"),
    [(lose, "packets"), (cut, "trajectories"), (flip, "packets"), (replace_by_a_folder, "trajectories")],
)
def test_the_same_sweep_makes_a_damaged_table_anew(
    tmp_path: Path, sound: Path, damage: Callable[[Path], None], name: str
) -> None:
    folder = tmp_path / "out"
    shutil.copytree(sound / "out", folder)
    path = folder / TABLES / f"{name}.parquet"
    damage(path)
    results = SweepResults.read(folder)
    assert results.damaged == [path.name]
    with pytest.raises(OutputError, match=f"{name}.parquet: lost or changed since it was written; run the same sweep"):
        results.table(name)
    assert results.status().done == 4
    study = load_study(str(sound / "study.toml"))
    assert [path.name] in [other for key, other in verify(study, folder, 4)]
    status = sweep(study, folder, executor=Serial())
    assert (status.done, status.remaining) == (4, 0)
    assert outcome(folder) == outcome(sound / "out")
    assert not SweepResults.read(folder).damaged


def test_a_part_that_cannot_be_read_is_made_again(tmp_path: Path, sound: Path) -> None:
    """Between a kill and the end of the sweep tables lie in parts."""
    study, folder = load_study(str(sound / "study.toml")), tmp_path / "out"
    plan = SweepPlan(study)
    opened = SweepFolder(folder, plan)
    finished = [run_task(task) for task in plan.missing({})]
    opened.append(finished)
    opened.close()
    part = next(path for path in sorted((folder / PARTS).iterdir()) if path.is_dir())
    cut(part / "trajectories.parquet")
    sweep(study, folder, executor=Serial())
    assert outcome(folder)[1] == outcome(sound / "out")[1]
