"""Shipped scenario of this mission as tables to be varied, and runs with failing modules."""

from functools import cache

from small_mission import Raw, named
from varied import Varied

from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.scenarios import load

NAME = "trident-intervention"
SEED = 2
"""Of most runs: without faults its first choice is the target."""


tables = Varied(NAME, "own.toml").raw


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
