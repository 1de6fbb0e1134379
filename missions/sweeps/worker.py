"""Worker of a sweep: execution and verification of runs.

Only this module of the missions reads the wall clock, for the ledger; it does not affect the model.
"""

from __future__ import annotations

import io
import os
import platform
import time
import traceback
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from missions.errors import ClusterError, OutputError
from missions.runs.results import identity, summary
from missions.runs.run import run_of
from missions.runs.setup import resolved
from missions.runs.tables import decoded, encoded
from missions.sweeps.code import code_with, references
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import DONE, FAILED, FinishedRun
from missions.sweeps.plan import RunTask, SweepPlan, version
from remoras.process import rare_collections

if TYPE_CHECKING:
    from missions.sweeps.study import Study


try:
    import resource
except ImportError:  # Windows has no such limits
    resource = None  # type: ignore[assignment]


class Needed(NamedTuple):
    """Requirements on a worker process: version, code digest and memory limit, if any."""

    version: str
    code: str
    memory_mb: int | None = None

    @classmethod
    def like_here(cls, memory_mb: int | None = None) -> Needed:
        """Return requirements equal to this process."""
        return cls(version(), code_with(), memory_mb)


def run_checked(needed: Needed, task: RunTask) -> FinishedRun:
    """Execute one task; a raising run fails, another version or code raises ClusterError."""
    where = f"worker {platform.node()}"
    if version() != needed.version:
        raise ClusterError(f"{where} has version {version()} of remoras, the sweep {needed.version}: install the same")
    if code_with() != needed.code:
        raise ClusterError(f"{where} has other sources, Python, Mesa or NumPy than the sweep: install the same")
    if needed.memory_mb is not None and resource is not None:
        limit = needed.memory_mb * 2**20
        resource.setrlimit(resource.RLIMIT_DATA, (limit, resource.getrlimit(resource.RLIMIT_DATA)[1]))
    return run_task(task)


@rare_collections()
def run_task(task: RunTask) -> FinishedRun:
    """Execute one task."""
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    fields, error, tables = identity(task.scenario, task.seed), "", b""
    try:
        finished = run_of(resolved(task.scenario), task.seed)
        fields = summary(finished)
        if task.keep_tables:
            tables = encoded(finished.recorder, task.key)
    except Exception:
        error = traceback.format_exc()
    machine = {
        "wall_s": round(time.perf_counter() - wall_s, 4),
        "cpu_s": round(time.process_time() - cpu_s, 4),
        "host": platform.node(),
        "worker": os.getpid(),
        "finished_at": _now(),
    }
    return FinishedRun(_line(task, fields, error, machine), tables)


def killed(task: RunTask, error: str) -> FinishedRun:
    """Return a failed run whose process died, with the reason."""
    machine = {"wall_s": None, "cpu_s": None, "host": platform.node(), "worker": os.getpid(), "finished_at": _now()}
    return FinishedRun(_line(task, identity(task.scenario, task.seed), error, machine))


def _line(task: RunTask, fields: Mapping[str, Any], error: str, machine: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "key": task.key,
        "status": FAILED if error else DONE,
        "repeat": task.repeat,
        "settings": dict(task.settings),
        "summary": dict(fields),
        "error": error,
        "replay": task.replay if error else "",
        "tables": task.keep_tables and not error,
        "code": code_with(references([task.scenario.model_dump(mode="json")])),
        "machine": dict(machine),
    }


def _now() -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())


def verify(study: Study, folder: Path, count: int) -> Iterator[tuple[str, list[str]]]:
    """Repeat finished runs; yield each key with the fields and tables that differ.

    count: of runs, evenly spaced over those without error. Raises OutputError if none exists.
    """
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
        if line["tables"] and results.damaged:
            other += results.damaged
        elif line["tables"]:
            again_made = decoded(io.BytesIO(again.tables))
            other += [name for name, now in again_made.items() if not _is_kept(results, name, key, now)]
        yield key, other


def _is_kept(results: SweepResults, name: str, key: str, now: Any) -> bool:
    """True if the kept table has the same rows of a run."""
    if name not in results.kept_tables:
        return not now.num_rows
    kept = results.arrow_table(name, key)
    return bool(kept.equals(now.cast(kept.schema)))
