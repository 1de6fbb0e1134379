"""Runs of shipped scenarios with keys set, and what they have recorded."""

from typing import Any

from missions.runs.run import Run, run
from missions.scenarios import load


def flown(name: str, *keys: str, seed: int = 1) -> Run:
    return run(load(name, [("--set", key) for key in keys]), seed)


def with_energy(name: str, energy_j: float) -> list[str]:
    """Keys by which every vehicle of a scenario has so much (J)."""
    return [f"vehicle.{one.name}.energy_j={energy_j}" for one in load(name).vehicle]


def metric(of: Run, name: str) -> Any:
    """A metric that the mission declares."""
    return next(one.of for one in type(of.mission).metrics if one.name == name)(of)


def said(of: Run, attribute: str) -> list[tuple[float, str, str, str]]:
    """Time, vehicle, subject and value of every fact of an attribute, as recorded."""
    return [(row[3], row[1], row[4], row[6]) for row in of.recorder.items if row[5] == attribute]


def faults(of: Run, kind: str) -> list[tuple[str, str]]:
    """Vehicle and detail of every row of a kind."""
    return [(row[1], row[3]) for row in of.recorder.faults if row[2] == kind]


def point(text: str) -> tuple[float, float]:
    """A point as it is recorded."""
    x, y = text.removeprefix("POINT (").removesuffix(")").split()
    return float(x), float(y)
