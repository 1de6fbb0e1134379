"""Worker of a sweep: execution and verification of runs. It reads the wall clock for the ledger, not for the model."""

from __future__ import annotations

import io
import os
import platform
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from missions.errors import ClusterError, OutputError
from missions.runs.results import MemoryResults, identity
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.sweeps.code import fingerprint, references, short
from missions.sweeps.folder import SweepResults, run_folder, tables_digest
from missions.sweeps.ledger import DONE, FAILED, FinishedRun
from missions.sweeps.plan import RunTask, SweepPlan
from remoras.process import rare_collections
from remoras.version import __version__

if TYPE_CHECKING:
    from missions.sweeps.study import Study


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
        "code": short(fingerprint(references([task.scenario.model_dump(mode="json")]))),
        "machine": {
            "wall_s": wall_s,
            "cpu_s": cpu_s,
            "host": platform.node(),
            "worker": os.getpid(),
            "finished_at": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
        },
    }
    return FinishedRun(line, files)


def verify(study: Study, folder: Path, count: int) -> Iterator[tuple[str, list[str]]]:
    """Repeat ``count`` finished runs; yield each key with fields and tables that differ. OutputError without runs."""
    results = SweepResults.read(folder)
    tasks = {task.key: task for task in SweepPlan(study).missing({})}
    keys = [key for key, line in results.lines.items() if line["status"] != FAILED and key in tasks]
    if not keys:
        raise OutputError(f"{folder}: no finished run of this study; nothing to verify")
    count = min(count, len(keys))
    for key in [keys[number * len(keys) // count] for number in range(count)]:
        again, line = run_task(tasks[key]), results.lines[key]
        was, now = line["summary"], again.line["summary"]
        other = [name for name in {**was, **now} if was.get(name) != now.get(name)]
        if line["tables"]:
            kept = run_folder(folder, key)
            other += [Path(name).stem for name, file in again.files.items() if not _is_alike(kept / name, file)]
        yield key, other


def _is_alike(kept: Path, again: bytes) -> bool:
    """True if a kept file has the table of a repeated run; not by bytes, which depend on the version of pyarrow."""
    if kept.suffix != ".parquet":
        return True  # summaries are compared by the ledger, manifests name the machine
    try:
        table: pa.Table = pq.read_table(io.BytesIO(kept.read_bytes()))
    except (pa.ArrowException, OSError):
        return False
    return bool(table.equals(pq.read_table(io.BytesIO(again))))
