"""A shipped scenario for tests: its tables, files with changed tables, and cached runs with keys set."""

import copy
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w
from recorded import flown

from missions.runs.run import Run
from missions.scenarios import shipped

_flown = cache(flown)


class Varied:
    """One of them.

    Args:
        name: of the scenario; file: that changed tables are written to.
    """

    def __init__(self, name: str, file: str) -> None:
        self._name, self._file = name, file
        self._tables = tomllib.loads(shipped()[name].read_text(encoding="utf-8"))

    def raw(self) -> dict[str, Any]:
        """Its tables, to be changed."""
        return copy.deepcopy(self._tables)

    def written(self, folder: Path, tables: dict[str, Any]) -> Path:
        """Tables as a file."""
        path = folder / self._file
        path.write_text(tomli_w.dumps(tables), encoding="utf-8")
        return path

    def flown(self, seed: int, *keys: str) -> Run:
        """A run with keys set, made once."""
        return _flown(self._name, *keys, seed=seed)


def tracks(of: Run) -> list[tuple[object, ...]]:
    """Positions of all vehicles over time."""
    return list(of.recorder.trajectories)
