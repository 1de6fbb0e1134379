"""Results of a version that judged success over survivors keep their figures, and whoever reads them is told."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import remoras
from missions.errors import StudyChangedError
from missions.runs.results import write_results
from missions.runs.run import run
from missions.scenarios import load
from missions.sweeps import load_study, sweep
from missions.verdict import KEY
from remoras.cli import app

NOTE = "an older version judged success over survivors there"
STUDY = """
[study]
name = "verdicts"
scenario = "mapping-rendezvous"
strategies = ["remoras", "cbba"]
repeats = 1
[[channel]]
name = "perfect"
[set]
scenario.duration_s = 30
"""


def without_verdict(path: Path) -> None:
    found = json.loads(path.read_text())
    del found[KEY]
    path.write_text(json.dumps(found))


@pytest.fixture
def older_run(tmp_path: Path) -> Path:
    write_results(run(load("mapping-rendezvous", [("--set", "scenario.duration_s=30")])), tmp_path / "run")
    return tmp_path / "run"


@pytest.fixture
def older_sweep(tmp_path: Path) -> Path:
    (tmp_path / "study.toml").write_text(STUDY)
    sweep(load_study(str(tmp_path / "study.toml")), tmp_path / "sweep")
    return tmp_path / "sweep"


def test_a_run_is_opened_and_drawn_with_a_line_and_its_figures_stay(older_run: Path) -> None:
    summary = remoras.open(older_run).summary  # type: ignore[union-attr]
    shown = CliRunner().invoke(app, ["plot", str(older_run), "trajectories"])
    assert NOTE not in shown.stderr
    without_verdict(older_run / "manifest.json")
    with pytest.warns(UserWarning, match=NOTE):
        assert remoras.open(older_run).summary == summary  # type: ignore[union-attr]
    for command in (["plot", str(older_run), "trajectories"], ["replay", str(older_run)]):
        shown = CliRunner().invoke(app, command)
        assert shown.exit_code == 0
        assert [line for line in shown.stderr.splitlines() if NOTE in line] == [
            f"remoras: {older_run}: {NOTE}; completed, goal_fraction and times of runs with losses are not those of "
            "this version"
        ]


def test_a_sweep_is_compared_with_a_line_and_does_not_go_on(older_sweep: Path) -> None:
    shown = CliRunner().invoke(app, ["compare", str(older_sweep), "--json"])
    assert NOTE not in shown.stderr
    rows = json.loads(shown.stdout)
    without_verdict(older_sweep / "study.json")
    shown = CliRunner().invoke(app, ["compare", str(older_sweep), "--json"])
    assert NOTE in shown.stderr
    assert json.loads(shown.stdout) == rows
    with pytest.warns(UserWarning, match=NOTE):
        remoras.open(older_sweep)
    with pytest.raises(StudyChangedError, match="verdict: was absent"):
        sweep(load_study(str(older_sweep.parent / "study.toml")), older_sweep)
