"""Comparison: every configuration against the baseline, run by run; censored runs stay in."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from sweeping import study_text, written

from missions.compare import Comparison, compare
from missions.errors import OutputError
from missions.execution import Finished
from missions.plan import Plan, Task
from missions.results import identity
from missions.runlog import RunLog, SweepResults
from missions.study import load_study

COLUMNS = (
    "n, n_completed, mean, ci95_low, ci95_high, median, diff_to_baseline, diff_ci95_low, diff_ci95_high, p_holm, "
    "effect_size, pairing_gain"
)


def made_up(task: Task, completed: bool = True) -> Finished:
    """A run whose time is 100 s, 10 s more per repeat and 5 s (6 s in every other) less with mps-ack."""
    gain_s = (5.0 + task.repeat % 2) * (task.scenario.communication.policy == "mps-ack")
    summary: dict[str, Any] = {
        **identity(task.scenario, task.seed),
        "completed": completed,
        "mission_time_s": 100.0 + 10.0 * task.repeat - gain_s if completed else 500.0,
        "n_bytes": 7,
        "mean_latency_s": None,
    }
    machine = dict.fromkeys(("wall_s", "cpu_s", "host", "worker", "finished_at"))
    line = {
        "key": task.key, "status": "done", "repeat": task.repeat, "settings": dict(task.settings), "summary": summary,
        "error": "", "replay": "", "tables": False, "machine": machine,
    }  # fmt: skip
    return Finished(line, {})


def results(tmp_path: Path, n_censored: int = 0, repeats: int = 8) -> SweepResults:
    plan = Plan(load_study(str(written(tmp_path, study_text(repeats=repeats, per="[0.1]")))))
    log = RunLog(tmp_path / "out", plan)
    log.append([made_up(task, task.repeat >= n_censored) for task in plan.missing({})])
    log.close()
    return SweepResults.read(tmp_path / "out")


def row_of(rows: list[Comparison], policy: str, metric: str = "mission_time_s") -> Comparison:
    return next(row for row in rows if row.policy == policy and row.metric == metric)


def test_a_row_has_all_columns_of_the_contract_and_is_json(tmp_path: Path) -> None:
    rows = [asdict(row) for row in compare(results(tmp_path))]
    assert {"strategy", "policy", "per", "metric", *COLUMNS.split(", ")} <= set(rows[0])
    json.dumps(rows, allow_nan=False)
    assert len(rows) == 4


def test_pairs_are_compared_run_by_run(tmp_path: Path) -> None:
    """Differences are -5 and -6 in turn: mean -5.5, variance 2/7; each policy alone has variance 600 or so."""
    rows = compare(results(tmp_path))
    other = row_of(rows, "mps-ack")
    assert other.baseline == "ack"
    assert other.diff_to_baseline == pytest.approx(-5.5)
    assert other.diff_ci95_low is not None
    assert other.diff_ci95_high is not None
    assert -6.2 < other.diff_ci95_low < -5.5 < other.diff_ci95_high < -4.8
    assert other.p_holm == pytest.approx(2 / 2**8)
    assert other.pairing_gain is not None
    assert other.pairing_gain > 1000
    assert other.effect_size == pytest.approx(-5.5 / 24.5, rel=0.02)
    own = row_of(rows, "ack")
    assert (own.diff_to_baseline, own.p_holm, own.mean, own.median) == (None, None, 135.0, 135.0)


def test_the_baseline_can_be_named(tmp_path: Path) -> None:
    rows = compare(results(tmp_path), ["mission_time_s"], "mps-ack")
    assert row_of(rows, "ack").diff_to_baseline == pytest.approx(5.5)


def test_censored_runs_stay_in(tmp_path: Path) -> None:
    """Two of eight were watched for 500 s: (2 * 500 + 120 + ... + 170) / 8 = 233.75 s."""
    found = results(tmp_path, n_censored=2)
    row = row_of(compare(found, ["mission_time_s", "completed"]), "ack")
    assert (row.n, row.n_completed, row.success_rate) == (8, 6, 0.75)
    assert row.mean == row.restricted_mean_time_s == pytest.approx(233.75)
    success = row_of(compare(found, ["completed"]), "ack", "completed")
    assert (success.mean, success.ci95_low, success.ci95_high) == (0.75, row.success_ci95_low, row.success_ci95_high)
    assert found.status().censored == 4


def test_a_metric_without_values_has_no_row(tmp_path: Path) -> None:
    assert compare(results(tmp_path), ["mean_latency_s"]) == []


@pytest.mark.parametrize(("metrics", "baseline"), [(["mission_time"], None), ([], "remora")])
def test_unknown_names_are_refused_with_the_nearest(tmp_path: Path, metrics: list[str], baseline: str | None) -> None:
    with pytest.raises(OutputError, match="did you mean"):
        compare(results(tmp_path), metrics, baseline)


def test_nothing_finished_is_said(tmp_path: Path) -> None:
    RunLog(tmp_path / "out", Plan(load_study(str(written(tmp_path, study_text()))))).close()
    with pytest.raises(OutputError, match="no run has finished"):
        compare(SweepResults.read(tmp_path / "out"))
    with pytest.raises(OutputError, match="no results of a sweep"):
        SweepResults.read(tmp_path)
