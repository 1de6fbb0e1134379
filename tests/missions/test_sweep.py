"""Sweeps: every run once, whatever its worker does."""

import errno
import json
import os
import shlex
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from sweeping import HERE, ROOT, Serial, environment, outcome, started, study_text, written
from typer.testing import CliRunner

from missions.errors import ClusterError, OutputError
from missions.sweeps.driver import PartlyDoneError, estimate, sweep
from missions.sweeps.folder import RUNS, SweepFolder, SweepResults
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan
from missions.sweeps.pool import SupervisedPool, WorkerDied
from missions.sweeps.study import Study, load_study
from missions.sweeps.worker import Needed, run_chunk
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


def test_a_finished_sweep_is_left_as_it_is(tmp_path: Path) -> None:
    study = study_of(tmp_path, repeats=1)
    sweep(study, tmp_path / "out", executor=Serial())
    before = (tmp_path / "out" / RUNS).read_bytes()
    assert sweep(study, tmp_path / "out", executor=None).done == 4
    assert (tmp_path / "out" / RUNS).read_bytes() == before


def test_a_run_that_raises_is_one_failed_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    status = sweep(faulty(tmp_path, "RAISING", monkeypatch), tmp_path / "out", executor=Serial())
    assert (status.planned, status.done, status.failed, status.remaining) == (16, 8, 8, 0)
    runs = SweepResults.read(tmp_path / "out").runs()
    failed = runs[runs.status == "failed"]
    assert all("ValueError: no fleet today" in error for error in failed.error)
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


def test_another_version_of_a_worker_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ClusterError, match="install the same"):
        run_chunk(Needed("0.0.1", ""), [])


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


def test_a_full_disk_leaves_a_sweep_that_can_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, append = study_of(tmp_path), SweepFolder.append

    def full_after_five(log: SweepFolder, finished: Any) -> None:
        if len(log.lines) >= 5:
            raise OutputError("ledger.jsonl: cannot be written: No space left on device")
        append(log, finished)

    monkeypatch.setattr(SweepFolder, "append", full_after_five)
    with pytest.raises(PartlyDoneError, match="No space left"):
        sweep(study, tmp_path / "out", executor=Serial())
    monkeypatch.undo()
    assert SweepResults.read(tmp_path / "out").status().done >= 5
    assert sweep(study, tmp_path / "out", executor=Serial()).remaining == 0


def test_a_disk_that_is_still_full_is_told_as_such(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, text: str) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("missions.sweeps.folder.write_synced", full)
    with pytest.raises(PartlyDoneError, match="No space left"):
        sweep(study_of(tmp_path), tmp_path / "out", executor=Serial())


def ends(process_group: int, within_s: float) -> bool:
    """Whether no process of the group is left within a time."""
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        try:
            os.killpg(process_group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


@pytest.mark.slow
def test_a_script_without_a_main_guard_is_told_so_and_makes_no_failed_runs(tmp_path: Path) -> None:
    study = written(tmp_path, study_text(repeats=1))
    script = tmp_path / "unguarded.py"
    script.write_text(
        "from pathlib import Path\nfrom missions.sweeps.study import load_study\n"
        "from missions.sweeps.driver import sweep\n"
        f"sweep(load_study({str(study)!r}), Path({str(tmp_path / 'out')!r}), jobs=2)\n"
    )
    command = [sys.executable, str(script)]
    done = subprocess.Popen(
        command, env=environment(), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, start_new_session=True
    )
    _, said = done.communicate(timeout=60)
    assert done.returncode != 0
    assert "no worker can start" in said
    assert "__name__ == '__main__'" in said
    assert SweepResults.read(tmp_path / "out").status().failed == 0
    assert ends(done.pid, within_s=10.0)


@pytest.mark.parametrize("address", ["nonsense", "", "tcp://", "http://host:1", "tcp://host", "tcp://host:x"])
def test_an_address_that_is_none_is_refused_at_once(tmp_path: Path, address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(ClusterError, match="allowed: tcp://HOST:PORT"):
        sweep(study_of(tmp_path, repeats=1), tmp_path / "out", cluster=address)


def test_a_comparison_says_what_is_missing_and_where_runs_are_too_few(tmp_path: Path) -> None:
    study, out = written(tmp_path, study_text(repeats=3)), tmp_path / "out"
    sweep(load_study(str(study)), out, executor=Serial())
    ledger = out / LEDGER
    ledger.write_text("".join(ledger.read_text().splitlines(keepends=True)[:-1]))
    compared = CliRunner().invoke(app, ["compare", str(out), "--metric", "n_bytes", "--metric", "n_bytes"])
    assert compared.exit_code == 0
    assert "0 runs failed and count as not completed, 1 have not been made" in compared.stderr
    assert "no p (Holm) of 2 comparisons of 3 pairs can be below 0.5: repeat more" in compared.stdout
    assert compared.stdout.count("n_bytes") == 1


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
def test_the_commands_work_together(tmp_path: Path) -> None:
    study, out = written(tmp_path, study_text(repeats=3)), tmp_path / "out"
    runner = CliRunner()
    dry = runner.invoke(app, ["sweep", str(study), "--out", str(out), "--dry-run", "--json"])
    assert set(json.loads(dry.stdout)) == {"planned", "estimate_s", "timed", "deterministic"}
    made = runner.invoke(app, ["sweep", str(study), "--out", str(out), "--jobs", "2", "--json"])
    assert made.exit_code == 0, made.output
    shown = runner.invoke(app, ["sweep", "--status", "--out", str(out), "--json"])
    assert json.loads(shown.stdout) == json.loads(made.stdout)
    assert json.loads(shown.stdout) == {"planned": 12, "done": 12, "failed": 0, "censored": 12, "remaining": 0}
    compared = runner.invoke(app, ["compare", str(out), "--json", "--out", str(tmp_path / "rows.csv")])
    assert len(json.loads(compared.stdout)) == 8
    assert len((tmp_path / "rows.csv").read_text().splitlines()) == 9
    assert "difference to ack" in runner.invoke(app, ["compare", str(out)]).stdout
    changed = runner.invoke(app, ["sweep", str(written(tmp_path, study_text(repeats=2))), "--out", str(out)])
    assert changed.exit_code == 2
    assert "was 3, now 2" in changed.output


def test_failed_runs_exit_with_1_and_say_how_to_replay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    faulty(tmp_path, "RAISING", monkeypatch)
    made = CliRunner().invoke(app, ["sweep", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")])
    assert made.exit_code == 1
    shown = CliRunner().invoke(app, ["sweep", "--status", "--out", str(tmp_path / "out")]).stdout
    assert "8 failed" in shown
    assert "replay: remoras run mapping-rendezvous" in shown


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
@pytest.mark.parametrize("wait_s", [0.0, 0.4, 0.8])
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
    monkeypatch.setattr("missions.sweeps.cluster.REACH_S", 0.5)
    with pytest.raises(ClusterError, match=r"tcp://127.0.0.1:9: cannot be reached"):
        sweep(study_of(tmp_path, repeats=1), tmp_path / "out", cluster="tcp://127.0.0.1:9")


def test_plan_is_not_needed_to_read_a_sweep(tmp_path: Path) -> None:
    """Somebody who gets the folder has neither the study file nor its scenarios."""
    study = study_of(tmp_path, repeats=1)
    sweep(study, tmp_path / "out", executor=Serial())
    assert SweepResults.read(tmp_path / "out").schedule == SweepPlan(study).schedule


def test_no_process_is_left_behind(tmp_path: Path) -> None:
    sweep(study_of(tmp_path, repeats=1), tmp_path / "out", jobs=2)
    time.sleep(0.3)
    children = subprocess.run(
        ["ps", "-o", "args=", "--ppid", str(os.getpid())], capture_output=True, text=True, check=False
    )
    assert "_serve" not in children.stdout
