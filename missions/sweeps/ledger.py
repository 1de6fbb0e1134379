"""RunLedger: one line of JSON per finished run, appended and synced to the disk before the run counts as finished.

A kill at any moment leaves at most a torn last line. It is cut off when the ledger is opened again, and its run is made
again. So no run is lost or doubled.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missions.errors import OutputError

if sys.platform != "win32":
    import fcntl

LEDGER, LOCK = "ledger.jsonl", "lock"
DONE, FAILED = "done", "failed"
"""How a run ended: with a summary, or with an error."""
MACHINE_COLUMNS = ("wall_s", "cpu_s", "host", "worker", "finished_at")
"""What depends on the machine, and nothing else does."""
LINE_KEYS = {"key", "status", "repeat", "settings", "summary", "error", "replay", "tables", "machine"}

Line = dict[str, Any]
"""What the ledger keeps of a run; it has all of ``LINE_KEYS``."""


@dataclass(frozen=True)
class FinishedRun:
    """A run that has ended.

    Args:
        line: what the ledger keeps of it.
        tables: its tables as Parquet files by name, if they are kept.
    """

    line: Mapping[str, Any]
    tables: Mapping[str, bytes]

    @property
    def key(self) -> str:
        """Key of the run."""
        return str(self.line["key"])


class RunLedger:
    """The ledger of a sweep that is going on, open for appending.

    Args:
        path: of the file, made if it is not there; a torn last line is cut off.

    Raises:
        OutputError: a line before the last is not one of a run.
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        try:
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
        return {line["key"]: line for line in parsed(content[:whole], self._path)}

    def append(self, lines: Iterable[Mapping[str, Any]]) -> None:
        """Add lines of runs that the ledger does not have; when this returns they are on the disk.

        Raises:
            OutputError: the disk does not take them; the ledger is then as it was before.
        """
        new = [dict(line) for line in lines]
        size = os.fstat(self._file).st_size
        try:
            content = "".join(json.dumps(line, allow_nan=False) + "\n" for line in new).encode()
            while content:
                content = content[os.write(self._file, content) :]
            os.fsync(self._file)
        except OSError as error:
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


def read_ledger(path: Path) -> dict[str, Line]:
    """Whole lines of a ledger by key, in the order of the keys; it may be one that a sweep is writing.

    Raises:
        OutputError: a whole line is not one of a run.
    """
    content = path.read_bytes() if path.is_file() else b""
    return dict(sorted((line["key"], line) for line in parsed(content, path)))


def parsed(content: bytes, path: Path) -> Iterator[Line]:
    """Lines of a ledger that are whole.

    Args:
        content: of the file.
        path: of the file, for messages.

    Raises:
        OutputError: a whole line is not one of a run.
    """
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
