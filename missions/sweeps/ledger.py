"""RunLedger: one line of JSON per finished run, appended and synced to the disk before the run counts as finished.

A kill at any moment leaves at most a torn last line. It is cut off when the ledger is opened again, and its run is made
again. So no run is lost or doubled. Each line begins with a checksum of the rest and names its study: a line that was
altered, that is of another study, or that contradicts another is told by its number, and nothing is counted before it
is taken out. A run that failed may have a later line, which counts instead.
"""

from __future__ import annotations

import json
import os
import sys
import zlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missions.disk import synced
from missions.errors import OutputError

if sys.platform != "win32":
    import fcntl

LEDGER, LOCK = "ledger.jsonl", "lock"
DONE, FAILED = "done", "failed"
"""How a run ended: with a summary, or with an error."""
MACHINE_COLUMNS = ("wall_s", "cpu_s", "host", "worker", "finished_at")
"""What depends on the machine, and nothing else does."""
LINE_KEYS = {"key", "status", "repeat", "settings", "summary", "error", "replay", "tables", "machine"}

SEAL = b'{"crc": "'
"""How a line with a checksum begins; older ones have none."""
TAKE_OUT = "Take the line out, and the same sweep makes its run again"
MAY_DIFFER = {"machine", "code", "replay", "crc"}
"""What may differ between two lines of one run."""

Line = dict[str, Any]
"""What the ledger keeps of a run; it has all of ``LINE_KEYS``."""


@dataclass(frozen=True)
class FinishedRun:
    """A run that has ended.

    Args:
        line: what the ledger keeps of it.
        tables: its tables as ``missions.runs.tables.encoded`` gives them; empty if they are not kept.
    """

    line: Mapping[str, Any]
    tables: bytes = b""

    @property
    def key(self) -> str:
        """Key of the run."""
        return str(self.line["key"])


class RunLedger:
    """The ledger of a sweep that is going on, open for appending.

    Args:
        path: of the file, made if it is not there; a torn last line is cut off.
        study: identity of the study, which goes into every line.

    Raises:
        OutputError: a line before the last is not one of a run.
        OSError: the file cannot be opened.
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
        """Lines by key, after the torn last one has been cut off."""
        content = self._path.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.ftruncate(self._file, whole)
            os.fsync(self._file)
        return ledger_lines(content[:whole], self._path, self._study)

    def append(self, lines: Iterable[Mapping[str, Any]]) -> None:
        """Add lines of runs that the ledger does not have; when this returns they are on the disk.

        Raises:
            OutputError: the disk does not take them; the ledger is then as it was before, at the latest when it is
                opened again, but for lines that were whole.
        """
        new = [{**line, "study": self._study} for line in lines]
        size = os.fstat(self._file).st_size
        try:
            content = b"".join(_sealed(line) for line in new)
            while content:
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


class FolderLock:
    """Held while a sweep writes a folder; the system lets go of it when the process ends, however it ends.

    Args:
        folder: has to be there.

    Raises:
        OutputError: another sweep holds it.
    """

    def __init__(self, folder: Path) -> None:
        self._file = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        if sys.platform == "win32":
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._file)
            raise OutputError(f"--out {folder}: another sweep is writing this folder") from None

    def release(self) -> None:
        """Let another sweep have the folder."""
        os.close(self._file)


def read_ledger(path: Path, study: str = "") -> dict[str, Line]:
    """Whole lines of a ledger by key, in the order of the keys; it may be one that a sweep is writing.

    Args:
        path: of the file.
        study: identity of the study that the lines have to be of.

    Raises:
        OutputError: a whole line is not one of a run of the study, or contradicts another.
    """
    content = path.read_bytes() if path.is_file() else b""
    return dict(sorted(ledger_lines(content, path, study).items()))


def ledger_lines(content: bytes, path: Path, study: str = "") -> dict[str, Line]:
    """Lines of a ledger that are whole, by key; of two of a run that had failed the last.

    Args:
        content: of the file.
        path: of the file, for messages.
        study: identity of the study that the lines have to be of; empty if that does not matter.

    Raises:
        OutputError: a whole line is not one of a run of the study, or contradicts another.
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
    """A line of a run; None if it is none, or its checksum is another."""
    try:
        line = json.loads(raw)
    except (ValueError, RecursionError):
        return None
    if not isinstance(line, dict) or not line.keys() >= LINE_KEYS or not isinstance(line["summary"], dict):
        return None
    if (crc := line.pop("crc", None)) is not None:
        rest = raw[len(SEAL) + 11 :]
        if not raw.startswith(SEAL) or crc != f"{zlib.crc32(rest):08x}":
            return None
    return line


def _differ(line: Line, other: Line) -> bool:
    return any(line.get(key) != other.get(key) for key in (line.keys() | other.keys()) - MAY_DIFFER)
