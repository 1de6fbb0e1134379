"""Disk on which any operation fails: with an error, once or from then on, half done, or by a kill of the process."""

import errno
import io
import os
from collections import Counter
from typing import Any

import pyarrow.parquet as pq
import pytest

OF_SYSTEM = ("open", "write", "fsync", "ftruncate", "mkdir", "rename", "replace", "link", "unlink", "rmdir")
"""Operations that Python's files and the ledger are written by; ``write`` is also that of an open file."""
OPERATIONS = (*OF_SYSTEM, "parquet")
"""And what pyarrow writes past them: a row group, or the end of a file."""
ERRORS = {"error": errno.EIO, "full": errno.ENOSPC, "dead": errno.EIO, "short": errno.ENOSPC}
FAULTS = (*ERRORS, "killed")
"""An error once; a full disk once; a disk that does nothing from then on; half of a write, then a full disk; a kill."""


class Killed(BaseException):
    """A process that is killed does nothing any more: it does not clear up either."""


class FailingDisk:
    """Replaces the write operations, counts them, and lets one fail.

    Args:
        patch: takes it away again.
        operation: that fails; None for any.
        fault: how.

    Attributes:
        counts: calls of each operation since it was healed.
    """

    def __init__(self, patch: pytest.MonkeyPatch, operation: str | None, fault: str) -> None:
        self.counts = Counter[str]()
        self._operation = operation
        self._fault = fault
        self._fails_at = 0
        self._is_down = False
        for name in OF_SYSTEM:
            patch.setattr(os, name, self._before(name, getattr(os, name)))
        patch.setattr(io, "open", self._opening(io.open))
        for name in ("write_table", "close"):
            patch.setattr(pq.ParquetWriter, name, self._before("parquet", getattr(pq.ParquetWriter, name)))

    def fail_at(self, number: int) -> None:
        """Let the operation fail at this call of it; at none for 0."""
        self.counts.clear()
        self._fails_at, self._is_down = number, False

    def heal(self) -> None:
        """Let nothing fail."""
        self.fail_at(0)

    def _fails(self, name: str) -> bool:
        """Count a call; raise the chosen error, or return True if half of the operation is done first."""
        self.counts[name] += 1
        number = self.counts.total() if self._operation is None else self.counts[self._operation]
        is_it = self._operation in (None, name) and number == self._fails_at
        if is_it and self._fault == "short":
            self._is_down = True
            return True
        if is_it or self._is_down:
            self._is_down = self._fault in ("dead", "killed")
            if self._fault == "killed":
                raise Killed
            raise OSError(ERRORS[self._fault], os.strerror(ERRORS[self._fault]))
        return False

    def _before(self, name: str, real: Any) -> Any:
        def failing(*arguments: Any, **options: Any) -> Any:
            if name == "parquet" and (arguments[0].file_handle is None or not arguments[0].is_open):
                return real(*arguments, **options)  # in memory, or closed before
            try:
                is_half = self._fails(name)
            except BaseException:
                if real.__name__ == "close":  # as pyarrow: nothing is written later on
                    arguments[0].is_open = False
                    arguments[0].file_handle.close()
                raise
            if is_half:
                return real(arguments[0], arguments[1][: len(arguments[1]) // 2])
            return real(*arguments, **options)

        return failing

    def _opening(self, real: Any) -> Any:
        def opened(file: Any, mode: str = "r", *arguments: Any, **options: Any) -> Any:
            if mode.startswith("r"):
                return real(file, mode, *arguments, **options)
            self._fails("open")
            found = real(file, mode, *arguments, **options)
            write = found.write

            def failing(content: Any) -> Any:
                if self._fails("write"):
                    write(content[: len(content) // 2])
                    found.flush()
                    self._fails("write")
                return write(content)

            found.write = failing
            return found

        return opened
