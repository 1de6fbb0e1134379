"""Random variants of the applications: each reaches its goal, or names what is impossible or awaited."""

import math
import random
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from sampling import sampled

from missions.errors import ConfigurationError
from missions.runs.run import Run, run
from missions.scenarios import load, shipped

NAMES = (
    "mapping-inspection", "pandora-inspection", "trident-intervention", "arrows-archaeology", "minehunting-contacts",
    "recovery-field", "ferry-passage", "escort-lines", "resupply-field",
)  # fmt: skip
KINDS = ("slow", "deaf", "mute", "lost", "drains")
OTHERS = ("central", "contract-net", "cbba", "status-broadcast")


def variant(name: str, number: int) -> dict[str, Any]:
    """A shipped scenario with losses, a current, faults, a vehicle with less energy, and another strategy drawn."""
    drawn, raw = random.Random(f"{name} {number}"), tomllib.loads(shipped()[name].read_text(encoding="utf-8"))
    vehicles = raw["vehicle"]
    raw["channel"] = {"name": "bernoulli", "per": drawn.choice([0.0, 0.2, 0.4, 0.6])}
    slowest_mps = min(vehicle["survey_speed_mps"] for vehicle in vehicles)
    if drawn.random() < 0.5:
        speed_mps, course_rad = drawn.uniform(0.1, 0.9) * slowest_mps, drawn.uniform(0.0, 2.0 * math.pi)
        raw["current"] = {
            "east_mps": round(speed_mps * math.cos(course_rad), 3),
            "north_mps": round(speed_mps * math.sin(course_rad), 3),
        }
    raw["fault"] = []
    for _ in range(drawn.choice([0, 1, 2])):
        kind = drawn.choice(KINDS)
        given = {"slow": {"factor": drawn.uniform(0.15, 0.9)}, "drains": {"drain_w": drawn.uniform(50.0, 2000.0)}}
        fault = {"kind": kind, "vehicle": drawn.choice(vehicles)["name"], "at_s": drawn.uniform(0.0, 1500.0)}
        raw["fault"].append({**fault, **given.get(kind, {})})
    if drawn.random() < 0.25:
        drawn.choice(vehicles)["energy_j"] *= drawn.uniform(0.02, 0.6)
    if drawn.random() < 0.3:
        raw["strategy"] = {"name": drawn.choice(OTHERS)}
    if name == "recovery-field":
        raw["lifts"] = {**raw["lifts"], "vehicles": drawn.choice([1, 2, 3, 4]), "lift_s": drawn.choice([60.0, 400.0])}
    return raw


def flown(folder: Path, name: str, number: int) -> Run | None:
    """A run of a variant; None where it is refused."""
    file = folder / f"{number}.toml"
    file.write_text(tomli_w.dumps(variant(name, number)), encoding="utf-8")
    try:
        return run(load(str(file)), number)
    except ConfigurationError:
        return None


@pytest.mark.slow
@pytest.mark.parametrize("name", sampled(NAMES, "mapping-inspection", "arrows-archaeology"))
def test_run_reaches_its_goal_or_names_what_is_impossible_or_awaited(name: str, tmp_path: Path) -> None:
    """A search may end early below its goal: then it gives the identified share."""
    runs = [made for number in range(2) if (made := flown(tmp_path, name, number)) is not None]
    assert runs
    for one in runs:
        waits = ["no vehicle left that is able to", "impossible", "waits for", "under way", "wait for strips"]
        if one.end_s < one.scenario.scenario.duration_s:
            waits += ["identified", "reported as done, but not done", "given up", "left its survey"]
        assert one.completed or any(words in one.reason for words in waits), one
        if "no vehicle left" in one.reason:
            assert one.reachable_fraction < 1.0
