"""Provenance of the runs of a sweep: code digests, seals of ledger lines, damaged tables."""

import json
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sweeping import HERE, Serial, environment, finished, outcome, study_text, swept, written
from typer.testing import CliRunner

from missions.disk import STUDY
from missions.errors import OutputError, StudyChangedError
from missions.scenarios import load
from missions.sweeps import code
from missions.sweeps.driver import sweep
from missions.sweeps.folder import KEPT, SweepResults
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import Study, load_study
from remoras.cli import app

OWN = """
import another
from my_project import tuning
from remoras.strategies.remoras import Remoras

MINE = Remoras(name="mine")
"""


def tiny(tmp_path: Path, strategy: str = "remoras", repeats: int = 1) -> Study:
    text = study_text(repeats=repeats, per="[0.1]").replace('["remoras"]', f'["remoras", "{strategy}"]')
    return load_study(str(written(tmp_path, text if strategy != "remoras" else study_text(repeats, "[0.1]"))))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    sweep(tiny(folder), folder / "out")
    return folder / "out"


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    """A finished sweep."""
    return Path(shutil.copytree(made, tmp_path / "out"))


# Code ---------------------------------------------------------------------------------------------


def test_sources_that_affect_runs_have_digests() -> None:
    found = code.program()
    assert {
        "remoras/motion/__init__.py",
        "missions/mapping/rendezvous.toml",
        "exchange/manager/manager.py",
        "numpy",
        "mesa",
    } <= set(found)
    assert not any(name.startswith(("remoras/cli", "visualisation", "tests")) for name in found)


def test_digest_of_a_plugin_covers_its_project_imports_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    project = tmp_path / "my_project"
    project.mkdir()
    for name, text in (
        ("__init__", ""), ("tuning", "from . import deeper\nimport json\n"), ("deeper", "RATE = 1\n"), ("notes", ""),
        ("own", OWN),
    ):  # fmt: skip
        (project / f"{name}.py").write_text(text)
    (tmp_path / "another").mkdir()
    (tmp_path / "another-1.0.dist-info").mkdir()  # as beside an installed plug-in, which imports another distribution
    (tmp_path / "another" / "__init__.py").touch()
    base = load("mapping-rendezvous")
    table = base.strategy.model_copy(update={"name": "my_project.own:MINE"})
    scenario = base.model_copy(update={"strategy": table})
    found = code.code_digests(code.references([scenario]))
    assert set(found) == {f"my_project/{name}.py" for name in ("__init__", "own", "tuning", "deeper")}
    (project / "deeper.py").write_text("RATE = 2\n")
    (project / "notes.py").write_text("# changed\n")
    again = code.code_digests(code.references([scenario]))
    assert [name for name in found if found[name] != again[name]] == ["my_project/deeper.py"]


def test_changed_code_is_refused_by_file_name(tmp_path: Path, folder: Path) -> None:
    record = json.loads((folder / STUDY).read_text())
    record["code"]["remoras/motion/__init__.py"] = "0" * 12
    (folder / STUDY).write_text(json.dumps(record))
    with pytest.raises(StudyChangedError, match=r'motion/__init__\.py: was "0{12}", now (.|\n)*--accept-code'):
        sweep(tiny(tmp_path), folder)
    assert sweep(tiny(tmp_path), folder, accept_code=True).remaining == 0


# Lines --------------------------------------------------------------------------------------------


def altered(line: dict[str, Any]) -> str:
    return json.dumps({**line, "repeat": 5})


def resealed(line: dict[str, Any], **change: Any) -> str:
    """A line without its checksum is as older versions wrote it."""
    return json.dumps({key: value for key, value in {**line, **change}.items() if key != "crc"})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("another", "why"),
    [
        (altered, "altered since"),
        (lambda line: resealed(line, key="f" * 16, study="abc"), "of another study, abc"),
        (lambda line: resealed(line, summary={**line["summary"], "n_bytes": 1}), r"contradicts line \d"),
        *((lambda line, text=text: text, "not a line of a run") for text in ("oops", '{"key": "x"}')),
    ],
)
def test_foreign_or_damaged_ledger_line_is_refused_with_its_number(
    tmp_path: Path, folder: Path, another: Any, why: str
) -> None:
    ledger = folder / LEDGER
    lines = ledger.read_text().splitlines()
    ledger.write_text("\n".join([*lines, another(json.loads(lines[0]))]) + "\n")
    for count in (lambda: SweepResults.read(folder).status(), lambda: sweep(tiny(tmp_path), folder)):
        with pytest.raises(OutputError, match=rf"ledger\.jsonl:{len(lines) + 1}: .*{why}.*Take the line out"):
            count()
    ledger.write_text("\n".join(lines) + "\n")
    assert SweepResults.read(folder).status().done == len(lines)


# Runs that go wrong -------------------------------------------------------------------------------


@pytest.fixture
def plugged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])


def test_raising_run_is_one_failed_row(tmp_path: Path, plugged: None) -> None:
    status = sweep(tiny(tmp_path, "faulty_strategies:RAISING"), tmp_path / "out", executor=Serial())
    assert (status.planned, status.done, status.failed, status.remaining) == (4, 2, 2, 0)
    runs = SweepResults.read(tmp_path / "out").runs()
    failed = runs[runs.status == "failed"]
    assert all("ValueError: no fleet today" in error for error in failed.error)
    words = ["sweep", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]
    assert CliRunner().invoke(app, words).exit_code == 1
    assert "2 failed" in (shown := CliRunner().invoke(app, ["sweep", "--status", *words[2:]]).stdout)
    assert f"replay: {failed.replay.iloc[0]}" in shown
    command = shlex.split(failed.replay.iloc[0])
    replayed = CliRunner().invoke(app, command[1:])
    assert replayed.exit_code != 0
    assert "no fleet today" in replayed.output


@pytest.mark.parametrize(
    ("name", "limits", "error"),
    [
        pytest.param("ENDLESS", {"timeout_s": 8.0}, "took longer than timeout_s = 8", marks=pytest.mark.slow),
        pytest.param("KILLING", {}, "process died", marks=pytest.mark.slow),
    ],
)
def test_run_beyond_its_limits_or_killed_fails_alone(
    tmp_path: Path, plugged: None, name: str, limits: dict[str, Any], error: str
) -> None:
    study = tiny(tmp_path, f"faulty_strategies:{name}")
    status = sweep(study, tmp_path / "out", jobs=2, **limits)
    assert (status.done, status.failed, status.remaining) == (2, 2, 0)
    runs = SweepResults.read(tmp_path / "out").runs()
    assert all(error in said for said in runs[runs.status == "failed"].error)


def test_a_time_limit_needs_processes_of_this_machine(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="--timeout-s 5: only processes of this machine"):
        sweep(tiny(tmp_path), tmp_path / "out", cluster="tcp://127.0.0.1:1", timeout_s=5.0)


def test_failed_runs_are_repeated_on_request(tmp_path: Path, plugged: None, monkeypatch: pytest.MonkeyPatch) -> None:
    import faulty_strategies

    study = tiny(tmp_path, "faulty_strategies:RAISING")
    assert sweep(study, tmp_path / "out", executor=Serial()).failed == 2
    monkeypatch.delattr(faulty_strategies.Raising, "form")
    assert sweep(study, tmp_path / "out", executor=Serial()).failed == 2
    assert sweep(study, tmp_path / "out", executor=Serial(), retry_failed=True).failed == 0
    assert SweepResults.read(tmp_path / "out").status().done == 4


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def flip(path: Path) -> None:
    """A byte in the middle of the data: Parquet does not notice each."""
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 1
    path.write_bytes(bytes(content))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damage", "name"),
    [(Path.unlink, "packets"), (flip, "trajectories")],
)
def test_repeated_sweep_restores_a_damaged_table(
    tmp_path: Path, made: Path, folder: Path, damage: Callable[[Path], None], name: str
) -> None:
    path = min((folder / KEPT).iterdir()) / f"{name}.parquet"
    damage(path)
    results = SweepResults.read(folder)
    assert results.damaged == [path.parent]
    with pytest.raises(OutputError, match=f"{path.parent}: lost or changed since it was written; repeat the sweep"):
        results.kept(results.lines[path.parent.name.removeprefix("key=")])
    assert results.status().done == 2
    status = sweep(tiny(tmp_path), folder, executor=Serial())
    assert (status.done, status.remaining) == (2, 0)
    assert outcome(folder) == outcome(made)
    assert not SweepResults.read(folder).damaged


def test_report_has_the_fleet_and_the_files_to_repeat_the_study(tmp_path: Path) -> None:
    """The three vehicles are alike. The copied files repeat the runs, until the scenario changes."""
    runner, scenario = CliRunner(), tmp_path / "mine.toml"
    assert runner.invoke(app, ["new", "scenario", "mine", "--out", str(tmp_path), "--lost", "1"]).exit_code == 0
    (tmp_path / "near.py").write_text("", encoding="utf-8")
    text = study_text(repeats=2, per="[0.1]", duration_s=900).replace("mapping-rendezvous", "mine.toml")
    text += "\n# 'near.py:NEAR' is no strategy yet\n"
    found = swept(tmp_path, text, lambda task: finished(task, completed=True, mission_time_s=9.0 + task.repeat))

    def reported(name: str) -> str:
        result = runner.invoke(app, ["report", str(found.folder), "--out", str(tmp_path / name)])
        assert result.exit_code == 0, result.output
        return result.stderr

    assert reported("report") == ""
    again = SweepPlan(load_study(str(tmp_path / "report" / "study.toml"))).schedule
    assert [label.digest for label in again.labels] == [label.digest for label in found.schedule.labels]
    assert (tmp_path / "report" / "near.py").is_file()
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "Fleet of scenario mine: 3 vehicles, modem nanomodem-v3, range " in page
    assert '<td class="text">AUV00, AUV01, AUV02</td>' in page or "<td>AUV00, AUV01, AUV02</td>" in page
    assert "Faults in each run: any vehicle lost between" in page
    assert "did not complete" not in page
    assert re.search(r"\b1 are\b|\b0 (of|failed)", page) is None
    scenario.write_text(scenario.read_text(encoding="utf-8").replace("swath_m = ", "swath_m = 1"), encoding="utf-8")
    assert reported("changed") == "remoras: To repeat: the scenario has changed since 2 configurations were run\n"
    scenario.unlink()
    assert reported("lost").startswith("remoras: To repeat: study.toml and the files copied beside it are not complete")
