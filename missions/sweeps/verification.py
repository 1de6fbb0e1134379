"""Verification: runs of a sweep are made once more, and have to end as they did."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.errors import OutputError
from missions.sweeps.execution import run_task
from missions.sweeps.folder import TABLES, SweepResults
from missions.sweeps.ledger import FAILED
from missions.sweeps.plan import SweepPlan

if TYPE_CHECKING:
    from missions.sweeps.study import Study


def verify(study: Study, folder: Path, count: int) -> Iterator[tuple[str, list[str]]]:
    """Make finished runs once more: for each its key, and the fields and tables that are other now.

    Args:
        study: that the folder is for.
        folder: of a sweep.
        count: of runs, spread evenly over those that finished without an error.

    Raises:
        OutputError: the folder holds no run of the study that finished without an error.
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
            other += [name for name, content in again.tables.items() if not _is_kept(folder, name, key, content)]
        yield key, other


def _is_kept(folder: Path, name: str, key: str, content: bytes) -> bool:
    """True if the rows of a run in a kept table are those of its table."""
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    now: Any = pq.read_table(io.BytesIO(content))
    path = folder / TABLES / f"{name}.parquet"
    if not path.is_file():
        return not now.num_rows
    kept = pq.read_table(path, filters=pc.field("key") == key)
    return bool(kept.equals(now.cast(kept.schema)))
