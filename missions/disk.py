"""Disk: what has to outlast a power cut."""

from __future__ import annotations

import hashlib
import json
import os
import sys
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


def write_synced(path: Path, text: str) -> None:
    """Write a file that is there whole or not at all, even after a power cut."""
    draft = path.with_name(f".{path.name}")
    draft.write_text(text, encoding="utf-8")
    synced(draft)
    draft.replace(path)
    synced(path.parent)


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
