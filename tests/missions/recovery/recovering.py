"""The shipped field of sites and objects for tests: its tables, and runs of it with settings changed."""

import copy
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from missions.runs.run import Run, run
from missions.scenarios import load, shipped

RAW = tomllib.loads(shipped()["recovery-field"].read_text(encoding="utf-8"))


def raw() -> dict[str, Any]:
    return copy.deepcopy(RAW)


def written(folder: Path, tables: dict[str, Any]) -> Path:
    """The tables as a file."""
    path = folder / "field.toml"
    path.write_text(tomli_w.dumps(tables), encoding="utf-8")
    return path


@cache
def flown(seed: int, *keys: str) -> Run:
    """A run with keys set."""
    return run(load("recovery-field", [("--set", key) for key in keys]), seed)


def events(of: Run, event: str) -> dict[str, float]:
    """When a lift came to an event, by name."""
    return {row[2]: row[0] for row in of.recorder.rows("lifts") if row[3] == event}
