"""Durable files: atomic writes that survive a power cut, replacement of results folders.

New results are written beside the folder, then exchanged with it: a kill at any moment leaves the old or the new run. A
folder that cannot be moved (current directory, mount point, foreign content) is updated file by file.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Set
from contextlib import contextmanager, suppress
from pathlib import Path

from missions.errors import OutputError, writing

if sys.platform != "win32":
    import fcntl

SUMMARY, MANIFEST, REPLAY, STUDY = "summary.json", "manifest.json", "replay.html", "study.json"
FIGURES = (".png", ".svg", ".pdf", ".csv")
"""Suffixes of figures and their data; a text file of the same name marks a run's figure."""
OF_FILES = (*FIGURES, ".html", ".json", ".parquet", ".tex", ".toml", ".txt")
AT_WORKING_FOLDER, EXCHANGE = -100, 2  # arguments of the system call ``renameat2``


def synced(*paths: Path) -> None:
    """Flush files, or the entries of folders, to disk."""
    for path in paths:
        # Windows cannot open a folder as a file.
        if path.is_dir() and sys.platform == "win32":
            continue
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextmanager
def drafted(path: Path, lasts: bool = False) -> Iterator[Path]:
    """Yield a draft that replaces ``path`` on success and vanishes on error; ``lasts`` waits for the disk. OSError."""
    draft = path.with_name(f".{path.name}.draft")
    try:
        _clear(draft)
        yield draft
        if lasts:
            synced(draft)
        # A rename replaces files and empty folders only; a file never replaces a folder.
        if path.is_dir() and draft.is_dir():
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
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def write_synced(path: Path, text: str) -> None:
    """Write a file atomically and durably."""
    with drafted(path, lasts=True) as draft:
        draft.write_text(text, encoding="utf-8")


def lock(path: Path, flags: int = os.O_RDONLY, *, is_required: bool = False) -> int | None:
    """Open and lock a file or folder until its handle is closed or the process exits; None if held elsewhere.

    On a file system without locks, a required lock raises OSError, another one is left out.
    """
    handle = os.open(path, flags, 0o644)
    if sys.platform != "win32":
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            return None
        except OSError:  # file system without locks
            if is_required:
                os.close(handle)
                raise
    return handle


def check_folder(path: Path) -> None:
    """Raise OutputError for a file, or a new path that is named like one, such as ``report.html``."""
    if not path.is_dir() and (path.exists() or path.suffix in OF_FILES):
        raise OutputError(f"--out {path}: names a file; allowed: a folder")


def check_output(folder: Path, force: bool) -> None:
    """Raise OutputError unless results can be written to ``folder`` without data loss."""
    with writing(f"--out {folder}"):
        # Before the checks: during an interrupted exchange the folder has another name.
        _recover(folder)
        check_folder(folder)
        if (folder / "ledger.jsonl").exists():
            raise OutputError(f"--out {folder}: holds a sweep; name another folder")
        if folder.is_dir() and any(folder.iterdir()) and not force:
            raise OutputError(f"--out {folder}: exists and is not empty; name another folder or add --force")
        parent = folder if folder.is_dir() else folder.parent
        while not parent.exists():
            parent = parent.parent
        # A trial file shows before the run, not after it, that the place cannot be written.
        with tempfile.TemporaryFile(dir=parent):
            pass


def holds_sweep(folder: Path) -> bool:
    """Return whether a folder holds a sweep, not a single run; OutputError if neither."""
    if (folder / STUDY).is_file():
        return True
    if (folder / SUMMARY).is_file():
        return False
    raise OutputError(f"{folder}: no results of a run ({SUMMARY} is missing), nor of a sweep ({STUDY} is missing)")


def files_of_run(names: Set[str]) -> set[str]:
    """Return the files that a run wrote or that were plotted from it; none without results."""
    if SUMMARY not in names:
        return set()
    captions = {Path(name).stem for name in names if name.endswith(".txt")}
    figures = {Path(name).stem for name in names if name.endswith(FIGURES)} & captions
    drawn = {name for name in names if Path(name).stem in figures and name.endswith((*FIGURES, ".txt"))}
    return drawn | {name for name in names if name in {SUMMARY, MANIFEST, REPLAY} or name.endswith(".parquet")}


@contextmanager
def new_content(
    folder: Path, of_older: Callable[[Set[str]], set[str]] = files_of_run, last: str | None = MANIFEST
) -> Iterator[Path]:
    """Yield an empty folder that replaces ``folder`` at the end; OutputError if another run is writing it.

    Of the old content, the files that ``of_older`` selects by name are removed.
    """
    place = folder.resolve()
    _recover(place)
    place.parent.mkdir(parents=True, exist_ok=True)
    # A draft in the folder itself serves folders that cannot be renamed.
    in_place = place.is_dir() and not _can_be_moved(place, of_older)
    draft = place / ".draft" if in_place else _beside(place, "draft")
    with _held(draft, folder):
        for left_over in draft.iterdir():  # by a killed run
            _clear(left_over)
        try:
            yield draft
            if in_place:
                _fill(place, draft, of_older, last)
            else:
                _exchange(place, draft, of_older)
        finally:
            shutil.rmtree(draft, ignore_errors=True)


def _beside(place: Path, suffix: str) -> Path:
    return place.with_name(f".{place.name}-{suffix}")


def _names(place: Path) -> set[str]:
    return {path.name for path in place.iterdir()}


def _can_be_moved(place: Path, of_older: Callable[[Set[str]], set[str]]) -> bool:
    """True if a folder has only replaceable content and is neither in use nor mounted."""
    if (names := _names(place)) and not of_older(names):
        return False
    if Path.cwd().is_relative_to(place) or place.is_mount():
        return False
    return os.access(place.parent, os.W_OK)


@contextmanager
def _held(draft: Path, folder: Path) -> Iterator[None]:
    draft.mkdir(exist_ok=True)
    if sys.platform == "win32":
        yield
        return
    if (held := lock(draft)) is None:
        raise OutputError(f"--out {folder}: another run is writing this folder")
    try:
        yield
    finally:
        os.close(held)


def _exchange(place: Path, draft: Path, of_older: Callable[[Set[str]], set[str]]) -> None:
    if not place.is_dir():
        draft.rename(place)
        return
    gone = of_older(_names(place))
    # Copy before the exchange, so that no moment has a folder without the files to keep. Links cost no space.
    shutil.copytree(
        place,
        draft,
        symlinks=True,
        ignore=lambda folder, names: gone if Path(folder) == place else set(),
        copy_function=_linked,
        dirs_exist_ok=True,
    )
    # Without an atomic exchange, a kill between both renames leaves no folder; ``_recover`` then restores it.
    if not _swapped(place, draft):
        before = _beside(place, "before")
        place.rename(before)
        try:
            draft.rename(place)
        except OSError:
            before.rename(place)
            raise
        shutil.rmtree(before, ignore_errors=True)


def _swapped(path: Path, other: Path) -> bool:
    if sys.platform != "linux":
        return False
    exchange = getattr(ctypes.CDLL(None), "renameat2", None)
    if exchange is None:
        return False
    names = os.fsencode(path), os.fsencode(other)
    return bool(exchange(AT_WORKING_FOLDER, names[0], AT_WORKING_FOLDER, names[1], EXCHANGE) == 0)


def _recover(folder: Path) -> None:
    before = _beside(folder.resolve(), "before")
    if not before.is_dir():
        return
    if folder.exists():
        shutil.rmtree(before, ignore_errors=True)
    else:
        before.rename(folder)


def _fill(place: Path, draft: Path, of_older: Callable[[Set[str]], set[str]], last: str | None) -> None:
    # Readers reject the folder from here on until the last file is in place.
    if last is not None:
        (place / last).unlink(missing_ok=True)
    # The summary goes last: without it, a run after a kill no longer recognises the other old files.
    for name in sorted(of_older(_names(place)), key=lambda name: name == SUMMARY):
        (place / name).unlink(missing_ok=True)
    for path in sorted(draft.iterdir(), key=lambda path: path.name == last):
        path.replace(place / path.name)


def _linked(source: str, target: str) -> None:
    with suppress(OSError):
        os.link(source, target, follow_symlinks=False)
        return
    shutil.copy2(source, target, follow_symlinks=False)
