"""Sweeps: every run exactly once, whatever its worker does."""

import os
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from sweeping import Serial, outcome, started, study_text, written

from missions.errors import ClusterError
from missions.sweeps.driver import PartlyDoneError, estimate, sweep
from missions.sweeps.folder import RUNS, SweepResults
from missions.sweeps.pool import SupervisedPool, WorkerDied
from missions.sweeps.study import Study, load_study


def study_of(tmp_path: Path, **options: Any) -> Study:
    return load_study(str(written(tmp_path, study_text(**options))))


@pytest.mark.slow
def test_any_executor_gives_the_same_bytes(tmp_path: Path) -> None:
    study = study_of(tmp_path, repeats=1)
    sweep(study, tmp_path / "serial", executor=Serial())
    sweep(study, tmp_path / "pool", jobs=2)
    with ProcessPoolExecutor(1) as executor:
        sweep(study, tmp_path / "standard", executor=executor)
    assert outcome(tmp_path / "serial") == outcome(tmp_path / "pool") == outcome(tmp_path / "standard")


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


def test_broken_executor_leaves_a_sweep_that_can_be_resumed(tmp_path: Path) -> None:
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
def test_invalid_cluster_address_is_refused_immediately(tmp_path: Path, address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(ClusterError, match="allowed: tcp://HOST:PORT"):
        sweep(study_of(tmp_path, repeats=1), tmp_path / "out", cluster=address)


def test_a_dry_run_counts_and_writes_nothing(tmp_path: Path) -> None:
    found = estimate(study_of(tmp_path), 2, tmp_path / "out")
    assert found.planned == 16
    assert 0.0 < found.estimate_s < 60.0
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_pool_survives_the_death_of_its_processes() -> None:
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
@pytest.mark.parametrize(("wait_s", "send"), [(0.0, os.killpg), (0.6, os.kill)])
def test_interrupt_keeps_finished_runs_and_exits_with_130(
    tmp_path: Path, wait_s: float, send: Callable[[int, int], None]
) -> None:
    """Ctrl-C reaches every process of the terminal's group: the workers that load their libraries too."""
    study, out = written(tmp_path, study_text(repeats=60)), tmp_path / "out"
    process = started("sweep", study, "--out", out, "--jobs", "2", start_new_session=True)
    ledger = out / "ledger.jsonl"
    while not (ledger.is_file() and (send is os.killpg or ledger.stat().st_size)) and process.poll() is None:
        time.sleep(0.02)
    time.sleep(wait_s)
    send(process.pid, 2)
    _, said = process.communicate(timeout=60)
    assert (process.returncode, said.splitlines()) == (130, ["remoras: interrupted"])
    status = SweepResults.read(out).status()
    assert (send is os.kill) <= status.done < status.planned
    assert (out / RUNS).is_file() or not status.done


def test_an_unreachable_cluster_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("missions.sweeps.pool.REACH_S", 0.5)
    with pytest.raises(ClusterError, match=r"tcp://127.0.0.1:9: cannot be reached"):
        sweep(study_of(tmp_path, repeats=1), tmp_path / "out", cluster="tcp://127.0.0.1:9")
