"""Sweeps: every run once, whatever its worker does."""

import os
import shlex
import time
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from sweeping import HERE, ROOT, Serial, outcome, started, study_text, written
from typer.testing import CliRunner

from missions.errors import ClusterError
from missions.sweeps.driver import PartlyDoneError, estimate, sweep
from missions.sweeps.folder import RUNS, SweepResults
from missions.sweeps.pool import SupervisedPool, WorkerDied
from missions.sweeps.study import Study, load_study
from remoras.cli import app


def study_of(tmp_path: Path, **options: Any) -> Study:
    return load_study(str(written(tmp_path, study_text(**options))))


def faulty(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> Study:
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(HERE)]))
    text = study_text(repeats=2).replace('["remoras"]', f'["remoras", "faulty_strategies:{name}"]')
    return load_study(str(written(tmp_path, text)))


@pytest.mark.slow
def test_any_executor_gives_the_same_bytes(tmp_path: Path) -> None:
    study = study_of(tmp_path)
    sweep(study, tmp_path / "serial", executor=Serial())
    sweep(study, tmp_path / "pool", jobs=2)
    with ProcessPoolExecutor(1) as executor:
        sweep(study, tmp_path / "standard", executor=executor)
    assert outcome(tmp_path / "serial") == outcome(tmp_path / "pool") == outcome(tmp_path / "standard")


def test_a_run_that_raises_is_one_failed_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    status = sweep(faulty(tmp_path, "RAISING", monkeypatch), tmp_path / "out", executor=Serial())
    assert (status.planned, status.done, status.failed, status.remaining) == (16, 8, 8, 0)
    runs = SweepResults.read(tmp_path / "out").runs()
    failed = runs[runs.status == "failed"]
    assert all("ValueError: no fleet today" in error for error in failed.error)
    words = ["sweep", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]
    assert CliRunner().invoke(app, words).exit_code == 1
    assert "8 failed" in (shown := CliRunner().invoke(app, ["sweep", "--status", *words[2:]]).stdout)
    assert f"replay: {failed.replay.iloc[0]}" in shown
    command = shlex.split(failed.replay.iloc[0])
    replayed = CliRunner().invoke(app, command[1:])
    assert replayed.exit_code != 0
    assert "no fleet today" in replayed.output


@pytest.mark.slow
def test_a_run_that_kills_its_process_is_one_failed_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    status = sweep(faulty(tmp_path, "KILLING", monkeypatch), tmp_path / "out", jobs=2)
    assert (status.done, status.failed, status.remaining) == (8, 8, 0)
    runs = SweepResults.read(tmp_path / "out").runs()
    assert set(runs[runs.status == "failed"].strategy) == {"faulty_strategies:KILLING"}
    assert all("process died" in error for error in runs[runs.status == "failed"].error)


@pytest.mark.slow
def test_the_stopping_rule_ends_repeats_and_does_not_depend_on_the_order(tmp_path: Path) -> None:
    extra = '[stopping]\nmetric = "n_bytes"\nhalf_width = 30\nminimum = 3\nmaximum = 12\n'
    study = study_of(tmp_path, extra=extra)
    status = sweep(study, tmp_path / "serial", executor=Serial())
    assert 4 * 3 <= status.done < 4 * 12
    sweep(study, tmp_path / "pool", jobs=2)
    assert outcome(tmp_path / "serial") == outcome(tmp_path / "pool")
    runs = SweepResults.read(tmp_path / "serial").runs()
    assert runs.groupby(["policy", "per"]).size().nunique() > 1


def test_a_broken_engine_leaves_a_sweep_that_can_go_on(tmp_path: Path) -> None:
    class Breaking(Serial):
        n_calls = 0

        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            self.n_calls += 1
            if self.n_calls > 3:
                raise BrokenExecutor
            return super().submit(fn, *args, **kwargs)

    study = study_of(tmp_path)
    with pytest.raises(PartlyDoneError):
        sweep(study, tmp_path / "out", executor=Breaking())
    assert sweep(study, tmp_path / "out", executor=Serial()).remaining == 0


@pytest.mark.parametrize("address", ["nonsense", "", "tcp://", "http://host:1", "tcp://host", "tcp://host:x"])
def test_an_address_that_is_none_is_refused_at_once(tmp_path: Path, address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(ClusterError, match="allowed: tcp://HOST:PORT"):
        sweep(study_of(tmp_path, repeats=1), tmp_path / "out", cluster=address)


def test_a_dry_run_counts_and_writes_nothing(tmp_path: Path) -> None:
    found = estimate(study_of(tmp_path), jobs=2)
    assert found.planned == 16
    assert 0.0 < found.estimate_s < 60.0
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_the_pool_outlives_its_processes() -> None:
    pool = SupervisedPool(2, preload="missions.sweeps.worker")
    dead, alive = pool.submit(os._exit, 3), [pool.submit(pow, 2, n) for n in range(20)]
    with pytest.raises(WorkerDied, match="ended with 3"):
        dead.result(30)
    assert [future.result(30) for future in alive] == [2**n for n in range(20)]
    with pytest.raises(TypeError):
        pool.submit(pow, "a", 2).result(30)
    pool.shutdown()
    with pytest.raises(RuntimeError):
        pool.submit(pow, 2, 2)


@pytest.mark.slow
def test_an_interruption_keeps_what_is_finished_and_exits_with_130(tmp_path: Path) -> None:
    study, out = written(tmp_path, study_text(repeats=60)), tmp_path / "out"
    process = started("sweep", study, "--out", out, "--jobs", "2")
    ledger = out / "ledger.jsonl"
    while not (ledger.is_file() and ledger.stat().st_size) and process.poll() is None:
        time.sleep(0.02)
    process.send_signal(2)
    assert process.wait(30) == 130, process.communicate()
    status = SweepResults.read(out).status()
    assert 0 < status.done < status.planned
    assert (out / RUNS).is_file()


@pytest.mark.slow
@pytest.mark.parametrize("wait_s", [0.0, 0.6])
def test_an_interruption_while_workers_start_prints_no_traces_of_them(tmp_path: Path, wait_s: float) -> None:
    """Ctrl-C reaches every process of the terminal's group: the workers that load their libraries too."""
    study, out = written(tmp_path, study_text(repeats=60)), tmp_path / "out"
    process = started("sweep", study, "--out", out, "--jobs", "2", start_new_session=True)
    while not (out / "ledger.jsonl").is_file() and process.poll() is None:
        time.sleep(0.02)
    time.sleep(wait_s)
    os.killpg(process.pid, 2)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert said.splitlines() == ["remoras: interrupted"]


def test_an_unreachable_cluster_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("missions.sweeps.pool.REACH_S", 0.5)
    with pytest.raises(ClusterError, match=r"tcp://127.0.0.1:9: cannot be reached"):
        sweep(study_of(tmp_path, repeats=1), tmp_path / "out", cluster="tcp://127.0.0.1:9")
