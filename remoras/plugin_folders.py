"""Folders of plug-ins: where a module is looked for that a file or an option names, and nothing else is.

A folder on Python's path serves everybody: a library that tries ``import orjson`` gets whatever lies there under that
name. So folders of plug-ins are not on the path. A finder behind all others takes from them the module that is being
``asked_for``, and what a module that came from a folder imports itself, then or later. What is installed comes first.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Final

SAFE_PATH: Final = "PYTHONSAFEPATH"
"""Variable of the environment by which Python does not put the current folder before all others."""
IMPORT_SYSTEM = frozenset({"_frozen_importlib", "_frozen_importlib_external", "importlib"})
_asked: ContextVar[str] = ContextVar("_asked", default="")


class PluginFolders:
    """Finds modules in folders of plug-ins, for those who may have them."""

    def __init__(self) -> None:
        self.folders: list[str] = []
        self._found_in: dict[str, str] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Where a module is, if none of the other finders has it; for arguments see ``importlib``."""
        if path is not None or not self.folders:  # what is in a package is found in it
            return None
        home = self._found_in.get(_importer())
        for folder in self.folders if fullname == _asked.get() else [] if home is None else [home]:
            spec = PathFinder.find_spec(fullname, [folder])
            if spec is not None:
                self._found_in[fullname] = folder
                return spec
        return None

    def invalidate_caches(self) -> None:
        """Nothing is kept: a folder that was added is looked at anew."""


def _importer() -> str:
    """Top package of the code that imports a module now; empty if none does."""
    frame = sys._getframe(1).f_back
    while frame is not None:
        top = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        if top not in IMPORT_SYSTEM:
            return top
        frame = frame.f_back
    return ""


_finder = PluginFolders()


def look_in(folders: Sequence[str]) -> None:
    """Take named plug-ins from more folders, behind those that are known already.

    Args:
        folders: absolute paths.
    """
    if _finder not in sys.meta_path:
        sys.meta_path.append(_finder)
    _finder.folders += [folder for folder in folders if folder not in _finder.folders]
    PathFinder.invalidate_caches()


def plugin_folders() -> tuple[str, ...]:
    """The folders that named plug-ins are taken from."""
    return tuple(_finder.folders)


@contextmanager
def asked_for(module: str) -> Iterator[None]:
    """Let the module that a file or an option names be found in the folders.

    Args:
        module: its dotted name.
    """
    token = _asked.set(module.partition(".")[0])
    try:
        yield
    finally:
        _asked.reset(token)


@contextmanager
def safe_path() -> Iterator[None]:
    """Let processes of Python that start meanwhile not put the current folder before all others, as ``-c`` does."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        del os.environ[SAFE_PATH]
        if before is not None:
            os.environ[SAFE_PATH] = before


def drop_current_folder() -> None:
    """Take the current folder off the path where ``python -m`` has put it, unless this program itself lies there."""
    here, program = os.path.realpath(os.curdir), os.path.realpath(__file__)
    if sys.path and os.path.realpath(sys.path[0] or os.curdir) == here and not program.startswith(here + os.sep):
        del sys.path[0]
