"""The log of a sweep's runs: crash-safe, and what a folder of a sweep holds.

``ledger.jsonl`` has one line per finished run, appended and synced to the disk before the run counts as finished. A
kill at any moment can leave at most a torn last line, which is cut off on the next start: its run is made again. So no
run is lost or doubled. ``study.json`` says what the folder is for; another study is refused. The rest is made
from these: ``runs.parquet`` (one row per run, sorted by key), ``tables/`` (tables of a sample of runs) and, while
the sweep is on, ``parts/``.
"""

from __future__ import annotations

import errno
import hashlib
import importlib
import inspect
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from missions.errors import DiskFullError, OutputError, StudyChangedError
from missions.runs import step_tables
from missions.sweeps.execution import DONE, FAILED, MACHINE_COLUMNS, Finished
from missions.sweeps.plan import Plan, Schedule
from missions.sweeps.study_file import StudyFile, toml_value

if sys.platform != "win32":
    import fcntl

LEDGER, STUDY, RUNS, PARTS, TABLES, LOCK = "ledger.jsonl", "study.json", "runs.parquet", "parts", "tables", "lock"
Line = dict[str, Any]
LINE_KEYS = {"key", "status", "repeat", "settings", "summary", "error", "replay", "tables", "machine"}


@dataclass(frozen=True)
class Status:
    """How far a sweep is; ``done`` counts completed and censored runs."""

    planned: int
    done: int
    failed: int
    censored: int
    remaining: int


@dataclass(frozen=True)
class SweepResults:
    """What a folder of a sweep holds, finished or not."""

    folder: Path

    @classmethod
    def read(cls, folder: Path) -> SweepResults:
        """Raises OutputError if the folder holds no sweep."""
        if not (folder / STUDY).is_file():
            raise OutputError(f"{folder}: no results of a sweep, missing: {STUDY}")
        return cls(folder)

    @cached_property
    def schedule(self) -> Schedule:
        path = self.folder / STUDY
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
            return Schedule(record["version"], StudyFile.model_validate(record["study"]), tuple(record["digests"]))
        except (ValueError, TypeError, KeyError):  # pydantic's and JSON's errors are ValueErrors
            raise OutputError(
                f"{path}: does not describe a study of this version; {LEDGER} beside it still has the runs"
            ) from None

    @cached_property
    def lines(self) -> dict[str, Line]:
        """Lines of the ledger by key, in the order of the keys."""
        path = self.folder / LEDGER
        content = path.read_bytes() if path.is_file() else b""
        return dict(sorted((line["key"], line) for line in parsed(content, path)))

    def runs(self) -> Any:
        """A pandas data frame with one row per finished run."""
        return run_table(self.lines).to_pandas()

    def table(self, name: str) -> Any:
        """A pandas data frame of a table of the runs in the sample; whole numbers in the unit of their name."""
        path = self.folder / TABLES / f"{name}.parquet"
        if not path.is_file():
            raise OutputError(f"{path}: no such table; the study keeps tables of study.keep_tables repeats")
        return pq.read_table(path).to_pandas()

    def status(self) -> Status:
        lines = self.lines.values()
        planned = self.schedule.count({key: line["summary"] for key, line in self.lines.items()})
        failed = sum(line["status"] == FAILED for line in lines)
        censored = sum(line["status"] == DONE and not line["summary"]["completed"] for line in lines)
        return Status(planned, len(self.lines) - failed, failed, censored, planned - len(self.lines))


class RunLog:
    """The log of a sweep that is going on; one process at a time holds it.

    Args:
        folder: made if it is not there.
        force_new: set the runs of another study aside, into a folder ``before-N``, and start anew.

    Raises:
        StudyChangedError: the folder belongs to another study, or to this one before it was changed.
        OutputError: the folder cannot be written, or another sweep is writing it.
    """

    def __init__(self, folder: Path, plan: Plan, force_new: bool = False) -> None:
        self.folder = folder
        record = _record(plan)
        if (folder / "summary.json").exists():
            raise OutputError(f"--out {folder}: holds the results of a single run; name another folder")
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                self._open(plan, record, force_new)
            except BaseException:
                os.close(self._lock)
                raise
        except OSError as error:
            full = error.errno in (errno.ENOSPC, errno.EDQUOT)
            kind = DiskFullError if full else OutputError
            raise kind(f"--out {folder}: cannot be written: {error.strerror}") from None

    def _open(self, plan: Plan, record: Mapping[str, Any], force_new: bool) -> None:
        self._take_lock()
        differences = list(_differences(self.folder, record))
        if differences and not force_new:
            shown = "\n".join(f"  {line}" for line in differences[:20])
            raise StudyChangedError(
                f"{self.folder} holds runs of a study that differs from this one:\n{shown}\n"
                "name another folder for --out, or set its runs aside and start anew with --force-new"
            )
        if differences:
            _set_aside(self.folder)
        _write_synced(self.folder / "study.toml", plan.study.text)
        _write_synced(self.folder / STUDY, json.dumps(record, indent=1))
        self._file = os.open(self.folder / LEDGER, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        try:
            self.lines = self._recovered()
        except BaseException:
            os.close(self._file)
            raise

    def _take_lock(self) -> None:
        if sys.platform == "win32":
            return
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OutputError(f"--out {self.folder}: another sweep is writing this folder") from None

    def _recovered(self) -> dict[str, Line]:
        """Lines of the ledger by key; a torn last line is cut off."""
        path = self.folder / LEDGER
        content = path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.ftruncate(self._file, whole)
            os.fsync(self._file)
        return {line["key"]: line for line in parsed(content[:whole], path)}

    @property
    def summaries(self) -> dict[str, Mapping[str, Any]]:
        """Summary of every finished run by key."""
        return {key: line["summary"] for key, line in self.lines.items()}

    def append(self, finished: Sequence[Finished]) -> None:
        """Log finished runs; when this returns they are on the disk. A run that is logged already is passed over.

        Raises OutputError if the disk does not take them; the log is then as it was before.
        """
        new = {run.key: run for run in finished if run.key not in self.lines}
        size = os.fstat(self._file).st_size
        try:
            for run in new.values():
                if run.tables:
                    step_tables.write_part(self.folder / PARTS, run.key, run.tables)
            content = "".join(json.dumps(dict(run.line), allow_nan=False) + "\n" for run in new.values()).encode()
            while content:
                content = content[os.write(self._file, content) :]
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, size)
            raise OutputError(f"{self.folder / LEDGER}: cannot be written: {error.strerror}") from None
        self.lines.update((run.key, dict(run.line)) for run in new.values())

    def compact(self) -> None:
        """Make ``runs.parquet`` and ``tables/`` of what is finished.

        Raises OutputError if the disk does not take them; the ledger keeps everything.
        """
        try:
            draft = self.folder / f".{RUNS}"
            pq.write_table(run_table(self.lines), draft, compression="zstd")
            draft.replace(self.folder / RUNS)
            kept = [key for key, line in self.lines.items() if line["tables"]]
            step_tables.merge(self.folder / PARTS, self.folder / TABLES, kept)
        except OSError as error:
            raise OutputError(f"--out {self.folder}: cannot be written: {error.strerror}") from None

    def close(self) -> None:
        os.close(self._file)
        os.close(self._lock)


def parsed(content: bytes, path: Path) -> Iterator[Line]:
    """Lines of a ledger that are whole."""
    for number, line in enumerate(content.split(b"\n")[:-1], 1):
        try:
            found = json.loads(line)
        except ValueError:
            found = None
        if not isinstance(found, dict) or not found.keys() >= LINE_KEYS or not isinstance(found["summary"], dict):
            raise OutputError(
                f"{path}:{number}: not a line of a run; the file was changed by something else. Take the line out, "
                "and the same sweep makes its run again"
            )
        yield found


def run_table(lines: Mapping[str, Line]) -> pa.Table:
    """One row per run, sorted by key: key, configuration, summary, what went wrong, machine."""
    rows = [lines[key] for key in sorted(lines)]
    columns: dict[str, list[Any]] = {"key": [row["key"] for row in rows], "repeat": [row["repeat"] for row in rows]}
    for name in sorted({name for row in rows for name in row["settings"]}):
        columns[name] = [row["settings"].get(name) for row in rows]
    fields = max((list(row["summary"]) for row in rows), key=len, default=[])
    for name in fields:
        columns[name] = [row["summary"].get(name) for row in rows]
    for name in ("status", "error", "replay"):
        columns[name] = [row[name] for row in rows]
    for name in MACHINE_COLUMNS:
        columns[name] = [row["machine"][name] for row in rows]
    return pa.table({name: _array(values) for name, values in columns.items()})


def _array(values: list[Any]) -> pa.Array:
    try:
        array = pa.array(values)
    except (pa.ArrowInvalid, pa.ArrowTypeError):
        return pa.array([None if value is None else toml_value(value) for value in values])
    return array.cast(pa.float64()) if pa.types.is_null(array.type) else array


# What a folder is for -----------------------------------------------------------------------------


def _record(plan: Plan) -> dict[str, Any]:
    """What has to be the same when a sweep goes on."""
    scenarios = {c.source: c.scenario.model_dump(mode="json") for c in reversed(plan.study.configurations)}
    record = {
        "version": plan.schedule.version,
        "study": plan.study.file.model_dump(mode="json"),
        "scenario": scenarios,
        "code": _code(plan),
        "digests": plan.schedule.digests,
    }
    loaded: dict[str, Any] = json.loads(json.dumps(record))
    return loaded


def _code(plan: Plan) -> dict[str, str]:
    """Digests of the files of strategies and missions that are not the program's own, by reference."""
    scenarios = [configuration.scenario for configuration in plan.study.configurations]
    named = {name for s in scenarios for name in (s.strategy.name, s.scenario.mission) if ":" in name}
    files = {name: inspect.getsourcefile(importlib.import_module(name.partition(":")[0])) for name in sorted(named)}
    return {
        name: hashlib.sha256(Path(file).read_bytes()).hexdigest()[:12]
        for name, file in files.items()
        if file is not None and not Path(file).is_relative_to(Path(__file__).parents[1])
    }


def _differences(folder: Path, record: Mapping[str, Any]) -> Iterator[str]:
    """What differs from the study that the folder is for, one line per key."""
    path = folder / STUDY
    if not path.is_file():
        if (folder / LEDGER).is_file():
            yield f"{STUDY} is missing"
        return
    try:
        old = dict(_leaves(json.loads(path.read_text(encoding="utf-8"))))
    except ValueError:
        yield f"{STUDY} cannot be read"
        return
    new = dict(_leaves(record))
    changed = [key for key in [*old, *(key for key in new if key not in old)] if old.get(key) != new.get(key)]
    for key in changed:
        before, now = (toml_value(side[key])[:60] if key in side else "absent" for side in (old, new))
        if key != "digests" or len(changed) == 1:  # they differ with whatever else does
            yield f"{key.removeprefix('study.')}: was {before}, now {now}"


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from _leaves(entry, f"{path}.{key}".removeprefix("."))
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        for number, entry in enumerate(value, 1):
            name = entry.get("name", number) if isinstance(entry, dict) else number
            yield from _leaves(entry, f"{path}.{name}")
    else:
        yield path, value


def _set_aside(folder: Path) -> None:
    number = 1
    while (folder / f"before-{number}").exists():
        number += 1
    aside = folder / f"before-{number}"
    aside.mkdir()
    for name in (LEDGER, RUNS, PARTS, TABLES, "study.toml", STUDY):
        if (folder / name).exists():
            (folder / name).rename(aside / name)


def _write_synced(path: Path, text: str) -> None:
    draft = path.with_name(f".{path.name}")
    with draft.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    draft.replace(path)
