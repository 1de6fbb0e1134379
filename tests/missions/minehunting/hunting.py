"""The shipped contacts for tests: their tables, and runs of them with settings changed."""

import copy
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from missions.runs.run import Run, run
from missions.scenarios import load, shipped

RAW = tomllib.loads(shipped()["minehunting-contacts"].read_text(encoding="utf-8"))
AMPLE = 'communication.modem="whoi-psk-5"'
"""A modem by which all strips of a view fit one packet."""


def raw() -> dict[str, Any]:
    return copy.deepcopy(RAW)


def written(folder: Path, tables: dict[str, Any]) -> Path:
    """The tables as a file."""
    path = folder / "contacts.toml"
    path.write_text(tomli_w.dumps(tables), encoding="utf-8")
    return path


@cache
def hunted(seed: int, *keys: str) -> Run:
    """A run with keys set."""
    return run(load("minehunting-contacts", [("--set", key) for key in keys]), seed)
