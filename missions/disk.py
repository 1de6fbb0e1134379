"""Disk: what has to outlast a power cut."""

from __future__ import annotations

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
