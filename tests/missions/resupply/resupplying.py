"""The shipped field of sites and holes for tests: its tables, and runs of it with settings changed."""

import copy
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from missions.runs.run import Run, run
from missions.scenarios import load, shipped

RAW = tomllib.loads(shipped()["resupply-field"].read_text(encoding="utf-8"))
OFF = "decision.weight_external=0.0"
FULL = ("vehicle.AUV03.sensor.corer.battery_j=1e6", "vehicle.AUV04.sensor.auger.battery_j=1e6")
EMPTY = tuple(f"vehicle.AUV0{number}.sensor.charger.store_j=0.0" for number in range(3))


def raw() -> dict[str, Any]:
    return copy.deepcopy(RAW)


def written(folder: Path, tables: dict[str, Any]) -> Path:
    """The tables as a file."""
    path = folder / "field.toml"
    path.write_text(tomli_w.dumps(tables), encoding="utf-8")
    return path


@cache
def sampled(seed: int, *keys: str) -> Run:
    """A run with keys set."""
    return run(load("resupply-field", [("--set", key) for key in keys]), seed)


def events(of: Run, event: str) -> list[tuple[float, str, str, float]]:
    """What befell holes: time, vehicle, hole, energy."""
    return [(row[0], row[1], row[2], row[4]) for row in of.recorder.rows("energy") if row[3] == event]
