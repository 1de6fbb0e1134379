"""Small studies for tests of sweeps, and those results that must not depend on execution."""

import io
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from missions.runs.results import identity
from missions.sweeps.folder import KEPT, RUNS, SweepFolder, SweepResults
from missions.sweeps.ledger import MACHINE_COLUMNS, FinishedRun
from missions.sweeps.plan import RunTask, SweepPlan
from missions.sweeps.study import load_study

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


class Serial(Executor):
    """The bare loop, as an executor."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def study_text(repeats: int = 4, per: str = "[0.1, 0.4]", duration_s: float = 20, extra: str = "") -> str:
    return f"""
[study]
name = "tiny"
scenario = "mapping-rendezvous"
strategies = ["remoras"]
policies = ["ack", "mps-ack"]
repeats = {repeats}
seed = 7
metrics = ["mission_time_s", "n_bytes"]

[[channel]]
name = "bernoulli"
per = {per}

[set]
scenario.duration_s = {duration_s}
{extra}
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def finished(task: RunTask, **summary: Any) -> FinishedRun:
    """Synthetic run with this summary."""
    line = {
        "key": task.key, "status": "done", "repeat": task.repeat, "settings": dict(task.settings), "error": "",
        "summary": {**identity(task.scenario, task.seed), **summary}, "replay": "", "tables": "",
        "machine": dict.fromkeys(("wall_s", "cpu_s", "host", "worker", "finished_at")),
    }  # fmt: skip
    return FinishedRun(line)


def swept(folder: Path, text: str, made: Callable[[RunTask], FinishedRun]) -> SweepResults:
    """A sweep of such runs, read back."""
    plan = SweepPlan(load_study(str(written(folder, text))))
    log = SweepFolder(folder / "out", plan)
    log.append([made(task) for task in plan.missing({})])
    log.close()
    return SweepResults.read(folder / "out")


def outcome(folder: Path) -> tuple[bytes, dict[str, bytes]]:
    """(bytes of the runs without what depends on the machine, bytes of every table by run and name)."""
    buffer = io.BytesIO()
    pq.write_table(pq.read_table(folder / RUNS).drop_columns(list(MACHINE_COLUMNS)), buffer)
    tables = sorted((folder / KEPT).glob("*/*.parquet"))
    return buffer.getvalue(), {f"{path.parent.name} {path.name}": path.read_bytes() for path in tables}


def environment() -> dict[str, str]:
    """Environment in which other processes find the sources and the faulty strategies."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(HERE)])}


def started(*arguments: object, start_new_session: bool = False) -> "subprocess.Popen[str]":
    """``remoras`` with these arguments, open to Ctrl-C even where a shell started the tests with it ignored."""
    heeded = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [sys.executable, "-c", f"{heeded}; from remoras.cli import main; main()", *map(str, arguments)]
    return subprocess.Popen(
        command,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=start_new_session,
    )
