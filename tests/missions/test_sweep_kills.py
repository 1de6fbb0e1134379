"""Sweeps that are killed for real, and go on: no run lost, none doubled, the same tables as without."""

import json
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from sampling import sampled
from sweeping import environment, ledger_length, outcome, started, study_text, written

from missions.sweeps.folder import PARTS, TABLES, SweepFolder, SweepResults
from missions.sweeps.ledger import LEDGER
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import Study, load_study
from missions.sweeps.worker import Needed, run_chunk

KILLS = (10, 100)
"""How often the sweep is killed; continuous integration tries the first."""
LATE_SHARE = 5
"""One kill in so many falls after the last line of the ledger, while the tables are made."""
OF_PARENT = (2, 5, 7)
"""Of eight kills before that, those of the parent: half of all then are. A run that dies thrice in one life fails."""
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


def workers_of(process: "subprocess.Popen[str]") -> list[psutil.Process]:
    """Children of its fork server; none once it has ended."""
    with suppress(psutil.NoSuchProcess):
        inner = psutil.Process(process.pid).children(recursive=True)
        return [child for child in inner if child.ppid() != process.pid]
    return []


def kill_early(start: Callable[[], "subprocess.Popen[str]"], out: Path, total: int, n_kills: int) -> Counter[str]:
    """Kill workers and parents while lines are added, at random places of the ledger; returns how often whom."""
    draws, killed, process = random.Random(20), Counter[str](), start()
    for number, place in enumerate(sorted(draws.randrange(total * 2 // 3) for _ in range(n_kills))):
        of_parent = number % 8 in OF_PARENT
        while True:
            if process.poll() is not None:
                process = start()
            wait_for(place, out, process)
            time.sleep(draws.uniform(0.0, 0.5))
            assert process.poll() in (None, -signal.SIGKILL), process.communicate()
            if of_parent:
                process.kill()
                process.wait()
                break
            if workers := workers_of(process):
                draws.choice(workers).kill()
                break
        killed["parent" if of_parent else "worker"] += 1
    process.kill()
    process.wait()
    return killed


def kill_late(start: Callable[[], "subprocess.Popen[str]"], out: Path, total: int, n_kills: int) -> Counter[str]:
    """Kill parents after the last line of the ledger; returns how often at what."""
    draws, killed = random.Random(21), Counter[str]()
    while killed.total() < n_kills:
        at = "tables" if killed["tables"] <= killed["parts"] else "parts"
        began_ns, process = time.time_ns(), start()
        wait_for(total, out, process)
        n_parts, n_written = len(files_in(out / PARTS)), draws.randint(1, 10)
        while process.poll() is None:
            if at == "tables" and sum(ns > began_ns for ns in files_in(out / TABLES)) >= n_written:
                time.sleep(draws.uniform(0.0, 0.05))
                break
            if at == "parts" and len(files_in(out / PARTS)) < n_parts:
                break
            time.sleep(0.001)
        process.kill()
        if process.wait() == -signal.SIGKILL:
            assert ledger_length(out) == total
            killed[at] += 1
        elif not (out / PARTS).exists():
            shutil.rmtree(out / TABLES)  # what is lost is made again
    return killed


def files_in(folder: Path) -> list[int]:
    """When what is in a folder was changed last (ns)."""
    with suppress(FileNotFoundError):
        return [path.stat().st_mtime_ns for path in folder.iterdir()]
    return []


@pytest.mark.slow
@pytest.mark.parametrize("n_kills", sampled(KILLS, KILLS[0]))
def test_a_sweep_that_is_killed_again_and_again_loses_nothing(tmp_path: Path, n_kills: int) -> None:
    """Half of the kills meet a worker, half the parent; the moments are random."""
    text = study_text(repeats=n_kills * 3).replace("\nseed", "\nkeep_tables = 5\nseed")
    study_file, out, total = written(tmp_path, text), tmp_path / "out", n_kills * 12

    def start() -> "subprocess.Popen[str]":
        return started("sweep", study_file, "--out", out, "--jobs", "2")

    n_late = n_kills // LATE_SHARE
    early = kill_early(start, out, total, n_kills - n_late)
    assert ledger_length(out) < total
    late = kill_late(start, out, total, n_late)
    assert early["worker"] == n_kills // 2 == early["parent"] + late.total()
    assert min(late["tables"], late["parts"]) == n_late // 2
    assert start().wait(120) == 0
    assert_nothing_lost_or_doubled(out, uninterrupted(load_study(str(study_file)), tmp_path / "serial"))


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
