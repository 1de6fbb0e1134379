"""Sweeps that are killed for real, and go on: no run lost, none doubled, the same tables as without."""

import json
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import psutil
import pytest
from sweeping import environment, ledger_length, outcome, started, study_text, written

from missions.sweeps.execution import Needed, run_chunk
from missions.sweeps.folder import SweepFolder, SweepResults
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import Study, load_study

N_KILLS = 10
PORT = 18791


def uninterrupted(study: Study, folder: Path) -> Path:
    """The folder of the runs made one after another in this process."""
    log, plan = SweepFolder(folder, SweepPlan(study)), SweepPlan(study)
    log.append(run_chunk(Needed.like_here(), list(plan.missing({}))))
    log.compact()
    log.close()
    return folder


def assert_nothing_lost_or_doubled(folder: Path, serial: Path) -> None:
    keys = Counter(line["key"] for line in map(json.loads, (folder / LEDGER).read_text().splitlines()))
    assert set(keys.values()) == {1}
    assert set(keys) == set(SweepResults.read(serial).lines)
    assert outcome(folder) == outcome(serial)


def wait_for(length: int, folder: Path, process: "subprocess.Popen[str]") -> None:
    while ledger_length(folder) < length and process.poll() is None:
        time.sleep(0.01)


@pytest.mark.slow
def test_a_sweep_that_is_killed_again_and_again_loses_nothing(tmp_path: Path) -> None:
    """Half of the kills meet a worker, half the parent; the moments are random but the same in every test."""
    study_file = written(tmp_path, study_text(repeats=75))
    study = load_study(str(study_file))
    draws, out = random.Random(20), tmp_path / "out"
    total, n_kills, process = 300, 0, None
    while n_kills < N_KILLS:
        if process is None or process.poll() is not None:
            process = started("sweep", study_file, "--out", out, "--jobs", "2")
        wait_for(ledger_length(out) + draws.randint(1, total // N_KILLS - 10), out, process)
        time.sleep(draws.uniform(0.0, 0.03))
        if process.poll() is not None:
            break
        if n_kills % 2:
            process.kill()
            process.wait()
        else:
            inner = psutil.Process(process.pid).children(recursive=True)
            workers = [child for child in inner if child.ppid() != process.pid]  # children of the fork server
            draws.choice(workers).kill()
        n_kills += 1
    assert n_kills == N_KILLS
    assert started("sweep", study_file, "--out", out, "--jobs", "2").wait(60) == 0
    assert_nothing_lost_or_doubled(out, uninterrupted(study, tmp_path / "serial"))


@pytest.mark.slow
@pytest.mark.thorough
def test_a_cluster_that_loses_two_workers_and_its_scheduler_loses_nothing(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    study_file, out, address = written(tmp_path, study_text(repeats=100)), tmp_path / "out", f"tcp://127.0.0.1:{PORT}"
    members: list[subprocess.Popen[bytes]] = []

    def member(*arguments: str) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", "distributed.cli.dask_" + arguments[0], *arguments[1:]]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        members.append(subprocess.Popen(command, env=environment(), cwd=tmp_path, **quiet))  # type: ignore[call-overload]
        return members[-1]

    def cluster() -> "list[subprocess.Popen[bytes]]":
        """A scheduler and three workers."""
        scheduler = member("scheduler", "--host", "127.0.0.1", "--port", str(PORT), "--no-dashboard")
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
        return [scheduler, *(member("worker", address, *options) for _ in range(3))]

    try:
        scheduler, first, second, _ = cluster()
        process = started("sweep", study_file, "--out", out, "--cluster", address)
        for share, victim in ((0.15, first), (0.45, second), (0.60, scheduler)):
            wait_for(int(share * 400), out, process)
            assert process.poll() is None
            victim.send_signal(signal.SIGKILL)
        assert process.wait(60) == 3
        assert 240 <= ledger_length(out) < 400
        for one in members:
            one.kill()
            one.wait()
        cluster()
        process = started("sweep", study_file, "--out", out, "--cluster", address)
        assert process.wait(60) == 0, process.communicate()
    finally:
        for one in members:
            one.kill()
    assert_nothing_lost_or_doubled(out, uninterrupted(load_study(str(study_file)), tmp_path / "serial"))
