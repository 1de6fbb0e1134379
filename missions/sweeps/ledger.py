"""Ledger of a sweep: one line of JSON per finished run, synced to disk before it counts.

A kill leaves at most a torn last line, which is removed on reopening; its run is repeated. So no run is lost or
doubled. An altered, foreign or contradicting line is reported by number and blocks the ledger until it is removed. A
later line of a run that failed, or whose tables were made again, replaces the earlier one.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from missions.disk import synced
from missions.errors import OutputError

LEDGER = "ledger.jsonl"
DONE, FAILED = "done", "failed"  # outcome of a run: a summary, or an error
MACHINE_COLUMNS = ("wall_s", "cpu_s", "host", "worker", "finished_at")
LINE_KEYS = {"key", "status", "repeat", "settings", "summary", "error", "replay", "tables", "machine"}

SEAL = b'{"crc": "'  # start of a line with checksum; older lines have none
TAKE_OUT = "Take the line out, and the same sweep makes its run again"
MAY_DIFFER = {"machine", "code", "replay", "tables", "crc"}  # keys that may differ between two lines of one run

Line = dict[str, Any]  # record of a run in the ledger, with all of ``LINE_KEYS``


@dataclass(frozen=True)
class FinishedRun:
    """Finished run; ``files`` has the content of its results folder, if kept."""

    line: Mapping[str, Any]
    files: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Key of the run."""
        return str(self.line["key"])


class RunLedger:
    """Ledger of a running sweep, open for appending; ``study`` is stored in every line.

    Raises OutputError if a line other than a torn last one is malformed, OSError if the file cannot be opened.
    """

    def __init__(self, path: Path, study: str = "") -> None:
        self._path = path
        self._study = study
        is_new = not path.exists()
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        try:
            if is_new:
                synced(path.parent)
            self.lines = self._recovered()
        except BaseException:
            os.close(self._file)
            raise

    def _recovered(self) -> dict[str, Line]:
        content = self._path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.ftruncate(self._file, whole)
            os.fsync(self._file)
        return ledger_lines(content[:whole], self._path, self._study)

    def append(self, lines: Iterable[Mapping[str, Any]]) -> None:
        """Append and sync lines of new runs; on OutputError the ledger keeps only whole lines."""
        new = [{**line, "study": self._study} for line in lines]
        size = os.fstat(self._file).st_size
        try:
            content = b"".join(_sealed(line) for line in new)
            while content:
                # A write may be partial, as on a full disk.
                content = content[os.write(self._file, content) :]
            os.fsync(self._file)
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._file, size)
            raise OutputError(f"{self._path}: cannot be written: {error.strerror}") from None
        self.lines.update((line["key"], line) for line in new)

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)


def read_ledger(path: Path, study: str = "") -> dict[str, Line]:
    """Return the whole lines of a ledger by key, in key order, even during a sweep; errors as ``ledger_lines``."""
    content = path.read_bytes() if path.is_file() else b""
    return dict(sorted(ledger_lines(content, path, study).items()))


def ledger_lines(content: bytes, path: Path, study: str = "") -> dict[str, Line]:
    """Parse the whole lines of a ledger by key; of a failed run's lines the last counts.

    Raises OutputError for a line that is malformed, contradicting, or of another ``study`` (empty for any).
    """
    lines: dict[str, Line] = {}
    numbers: dict[str, int] = {}
    for number, raw in enumerate(content.split(b"\n")[:-1], 1):
        line = _read(raw)
        if line is None:
            why = "not a line of a run, or altered since; the file was changed by something else"
        elif study and line.get("study", study) != study:
            why = f"of another study, {line['study']}; this folder holds the study {study}"
        elif (before := lines.get(line["key"])) is not None and before["status"] != FAILED and _differ(before, line):
            why = f"contradicts line {numbers[line['key']]}, of the same run"
        else:
            lines[line["key"]], numbers[line["key"]] = line, number
            continue
        raise OutputError(f"{path}:{number}: {why}. {TAKE_OUT}")
    return lines


def _sealed(line: Mapping[str, Any]) -> bytes:
    rest = json.dumps(line, allow_nan=False).encode()[1:]
    return SEAL + f'{zlib.crc32(rest):08x}", '.encode() + rest + b"\n"


def _read(raw: bytes) -> Line | None:
    try:
        line = json.loads(raw)
    except (ValueError, RecursionError):
        return None
    if not isinstance(line, dict) or not line.keys() >= LINE_KEYS or not isinstance(line["summary"], dict):
        return None
    if (crc := line.pop("crc", None)) is not None:
        # Behind the eight digits of the checksum and three characters.
        rest = raw[len(SEAL) + 11 :]
        if not raw.startswith(SEAL) or crc != f"{zlib.crc32(rest):08x}":
            return None
    return line


def _differ(line: Line, other: Line) -> bool:
    return any(line.get(key) != other.get(key) for key in (line.keys() | other.keys()) - MAY_DIFFER)
