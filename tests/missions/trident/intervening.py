"""The shipped scenario of this mission as tables to be varied, and runs of it with modules that fail."""

import copy
import tomllib
from functools import cache
from typing import Any

from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.scenarios import load, shipped

Raw = dict[str, Any]
NAME = "trident-intervention"
SEED = 2
"""Of most runs: without faults its first choice is the target."""


def tables() -> Raw:
    return copy.deepcopy(tomllib.loads(shipped()[NAME].read_text(encoding="utf-8")))


def named(entries: list[Raw], name: str) -> Raw:
    return next(entry for entry in entries if entry["name"] == name)


def module(raw: Raw, service: str) -> Raw:
    """The table of the module that offers a service."""
    vehicle, _, name = service.partition(" ")
    return named(named(raw["vehicle"], vehicle)["sensor"], name)


@cache
def run(
    *settings: str,
    response: str = "matching",
    failing: tuple[str, ...] = (),
    at_s: float = 300.0,
    seed: int = SEED,
    per: float = 0.2,
    until_s: float = 3600.0,
) -> Run:
    """A run in which the modules of some services fail for good at a time."""
    dead = ",".join(_fault(service, at_s) for service in failing)
    given = [f"mission.response={response}", f"scenario.duration_s={until_s}", *settings]
    given += [f"fault=[{dead}]"] if dead else []
    loaded = load(NAME, [("--per", f"channel.per={per}"), *(("--set", one) for one in given)])
    return run_scenario(loaded, seed)


def _fault(service: str, at_s: float) -> str:
    vehicle, _, name = service.partition(" ")
    return f'{{kind="sensor",vehicle="{vehicle}",sensor="{name}",at_s={at_s}}}'


def metric(of: Run, name: str) -> Any:
    return next(one.of for one in type(of.mission).metrics if one.name == name)(of)


def said(of: Run, attribute: str) -> list[tuple[float, str, str, str]]:
    """Time, vehicle, subject and value of every fact of an attribute, as recorded."""
    return [(row[3], row[1], row[4], row[6]) for row in of.recorder.items if row[5] == attribute]
