"""Worker of a sweep: execution of runs. It reads the wall clock for the ledger, not for the model."""

from __future__ import annotations

import os
import platform
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from missions.errors import ClusterError
from missions.runs.results import MemoryResults, identity
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.sweeps.code import fingerprint, references, short
from missions.sweeps.folder import tables_digest
from missions.sweeps.ledger import DONE, FAILED, FinishedRun
from missions.sweeps.plan import RunTask
from remoras.process import rare_collections
from remoras.version import __version__


def run_checked(code: str, tasks: Sequence[RunTask]) -> list[FinishedRun]:
    """Execute equal runs; a raising run fails, other code raises ClusterError."""
    if short(fingerprint()) != code:
        raise ClusterError(
            f"worker {platform.node()} has other sources, Python, Mesa or NumPy than the sweep (its remoras is version "
            f"{__version__}): install the same"
        )
    return run_tasks(tasks)


def run_task(task: RunTask) -> FinishedRun:
    """Execute one task."""
    return run_tasks([task])[0]


@rare_collections()
def run_tasks(tasks: Sequence[RunTask]) -> list[FinishedRun]:
    """Execute tasks whose runs are equal (``SweepPlan.alike``): one run, with the scenario of each task."""
    made, finished = None, []
    for task in tasks:
        began_s, began_cpu_s = time.perf_counter(), time.process_time()
        fields, error, files = identity(task.scenario, task.seed), "", dict[str, bytes]()
        try:
            if made is None:
                made = run(task.scenario, task.seed)
            else:
                made = replace(made, setup=resolved(task.scenario.for_seed(task.seed)))
            results = MemoryResults(made)
            fields = results.figures
            if task.keep_tables:
                files = results.files
        except Exception:
            error = traceback.format_exc()
        wall_s, cpu_s = time.perf_counter() - began_s, time.process_time() - began_cpu_s
        finished.append(_finished(task, fields, error, files, round(wall_s, 4), round(cpu_s, 4)))
    return finished


def killed(task: RunTask, error: str) -> FinishedRun:
    """Return a failed run whose process died, with the reason."""
    return _finished(task, identity(task.scenario, task.seed), error)


def _finished(
    task: RunTask,
    fields: Mapping[str, Any],
    error: str,
    files: Mapping[str, bytes] = MappingProxyType({}),
    wall_s: float | None = None,
    cpu_s: float | None = None,
) -> FinishedRun:
    line = {
        "key": task.key,
        "status": FAILED if error else DONE,
        "repeat": task.repeat,
        "settings": dict(task.settings),
        "summary": dict(fields),
        "error": error,
        "replay": task.replay if error else "",
        "tables": tables_digest(files),
        "code": short(fingerprint(references([task.scenario]))),
        "machine": {
            "wall_s": wall_s,
            "cpu_s": cpu_s,
            "host": platform.node(),
            "worker": os.getpid(),
            "finished_at": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        },
    }
    return FinishedRun(line, files)
