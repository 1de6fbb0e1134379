"""The shipped scenario of escorts for tests: its tables, and runs of it with settings changed."""

import copy
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from missions.runs.run import Run, run
from missions.scenarios import load, shipped

RAW = tomllib.loads(shipped()["escort-lines"].read_text(encoding="utf-8"))


def raw() -> dict[str, Any]:
    return copy.deepcopy(RAW)


def written(folder: Path, tables: dict[str, Any]) -> Path:
    """The tables as a file."""
    path = folder / "lines.toml"
    path.write_text(tomli_w.dumps(tables), encoding="utf-8")
    return path


@cache
def flown(seed: int, *keys: str) -> Run:
    """A run with keys set."""
    return run(load("escort-lines", [("--set", key) for key in keys]), seed)
