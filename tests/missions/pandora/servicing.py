"""Small structure for tests: the shipped scenario with one panel, its three valves and two vehicles."""

from pathlib import Path
from typing import Any

from varied import Varied

from missions.runs.run import Run, run
from missions.scenarios import load
from missions.scenarios.scenario import Scenario

SHIPPED = Varied("pandora-inspection", "little.toml")
written = SHIPPED.written


def raw() -> dict[str, Any]:
    """Scenario tables without faults, upsets and surges."""
    tables = SHIPPED.raw()
    for key in ("fault", "upset", "chain"):
        del tables[key]
    del tables["current"]["surge"]
    tables["panel"] = tables["panel"][:1]
    tables["valve"] = [one for one in tables["valve"] if one["panel"] == "panel A"]
    tables["anode"] = [one for one in tables["anode"] if one["name"] == "anode NW"]
    tables["vehicle"] = tables["vehicle"][:2]
    return tables


def little(folder: Path, adaptation: str = "all", **more: Any) -> Scenario:
    """Scenario with further tables; ``surge`` are changes of the current."""
    tables = raw()
    tables["mission"]["adaptation"] = adaptation
    if "surge" in more:
        tables["current"]["surge"] = more.pop("surge")
    for key, value in more.items():
        tables[key] = {**tables[key], **value} if isinstance(value, dict) else value
    return load(str(written(folder, tables)))


def flown(folder: Path, adaptation: str = "all", seed: int = 1, **more: Any) -> Run:
    """A run of it."""
    return run(little(folder, adaptation, **more), seed)


def found(done: Run) -> list[tuple[str, str]]:
    """(subject, finding) of everything that vehicles found."""
    return [(row[4], row[6]) for row in done.recorder.items if row[5] in ("diagnosis", "anomaly") and row[6] != "sound"]


def fault(kind: str, **more: Any) -> dict[str, Any]:
    """A fault of AUV01 early in the mission."""
    return {"vehicle": "AUV01", "kind": kind, "at_s": 20.0, **more}
