"""Durable files: atomic writes that survive a power cut, and digests."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl


def synced(*paths: Path) -> None:
    """Flush files, or the entries of folders, to disk."""
    for path in paths:
        if path.is_dir() and sys.platform == "win32":
            continue
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextmanager
def drafted(path: Path, lasts: bool = False) -> Iterator[Path]:
    """Yield a draft file or folder that replaces ``path`` on success and vanishes on error.

    ``lasts`` waits until it is on disk.

    Raises:
        OSError: not writable; names ``path``.
    """
    draft = path.with_name(f".{path.name}.draft")
    try:
        _clear(draft)
        yield draft
        if lasts:
            synced(draft)
        if path.is_dir():
            _clear(path)
        draft.replace(path)
        if lasts:
            synced(path.parent)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        with suppress(OSError):
            _clear(draft)


def _clear(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def write_synced(path: Path, text: str) -> None:
    """Write a file atomically and durably."""
    with drafted(path, lasts=True) as draft:
        draft.write_text(text, encoding="utf-8")


def lock(path: Path, flags: int = os.O_RDONLY) -> int | None:
    """Open and lock a file or folder until its handle is closed or the process exits; None if held elsewhere."""
    handle = os.open(path, flags, 0o644)
    if sys.platform != "win32":
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            return None
        except OSError:  # file system without locks
            pass
    return handle


DIGESTS = "digests.json"
"""File with the digests of a folder's other files."""


def note_digests(folder: Path, pattern: str) -> None:
    """Store the digests of a folder's files, to detect loss or changes."""
    found = {path.name: _digest(path) for path in sorted(folder.glob(pattern))}
    write_synced(folder / DIGESTS, json.dumps(found, indent=1))


def not_as_noted(folder: Path) -> list[str]:
    """Return names of files that differ from their digests; empty without stored digests."""
    try:
        noted = json.loads((folder / DIGESTS).read_text(encoding="utf-8"))
        return sorted(name for name, digest in noted.items() if digest != _digest(folder / name))
    except FileNotFoundError:
        return []
    except (OSError, ValueError, AttributeError, RecursionError):
        return [DIGESTS]


def _digest(path: Path) -> str | None:
    """SHA-256 of a file; None if unreadable."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
