"""Disk: files that appear whole or not at all, and outlast a power cut."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


def synced(*paths: Path) -> None:
    """Return when files, or the names in folders, are on the disk: a power cut takes nothing of them."""
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
    """A path to write a file or a folder to, which then takes the place of ``path`` whole; after an error it is gone.

    Args:
        path: of the file or folder.
        lasts: end when it is on the disk, so that a power cut takes nothing of it.

    Raises:
        OSError: it cannot be written; names ``path``.
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
    """Remove a file or a folder, if it is there."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def write_synced(path: Path, text: str) -> None:
    """Write a file that is there whole or not at all, even after a power cut."""
    with drafted(path, lasts=True) as draft:
        draft.write_text(text, encoding="utf-8")


DIGESTS = "digests.json"
"""Name of the file in a folder that says what its other files hold."""


def note_digests(folder: Path, pattern: str) -> None:
    """Write down what the files of a folder hold, so that it can be told when one is lost or changed."""
    found = {path.name: _digest(path) for path in sorted(folder.glob(pattern))}
    write_synced(folder / DIGESTS, json.dumps(found, indent=1))


def not_as_noted(folder: Path) -> list[str]:
    """Names of files of a folder that are not as ``note_digests`` found them; none where nothing was noted."""
    try:
        noted = json.loads((folder / DIGESTS).read_text(encoding="utf-8"))
        return sorted(name for name, digest in noted.items() if digest != _digest(folder / name))
    except FileNotFoundError:
        return []
    except (OSError, ValueError, AttributeError, RecursionError):
        return [DIGESTS]


def _digest(path: Path) -> str | None:
    """Digest of what a file holds; None if it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
