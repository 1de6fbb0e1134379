"""Runs of archaeological search, each made once, and a small area for tests of parts."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import missions.runs.run
from missions.arrows.mission import ArrowsMission
from missions.files import shipped
from missions.runs.run import Run
from missions.scenarios import load
from remoras.beliefs import Known

SCENARIO = "arrows-archaeology"
SEED = 3
"""Of a run in which several sites lie in reach."""
SILENCE = ("channel.name=bernoulli", "channel.per=0.999999")
"""Nobody hears anybody."""


def text() -> str:
    """The shipped scenario."""
    return Path(shipped()[SCENARIO]).read_text(encoding="utf-8")


def mission(*settings: str) -> ArrowsMission:
    """The mission of the shipped scenario, some keys of it set."""
    return ArrowsMission.from_scenario(load(SCENARIO, [("--set", one) for one in settings]))


@cache
def run(*settings: str, seed: int = SEED, search_s: float = 1200.0) -> Run:
    """A short run of the shipped scenario, some keys of it set as ``key=value``."""
    return run_of(SCENARIO, *settings, seed=seed, search_s=search_s)


def run_of(scenario: str, *settings: str, seed: int = SEED, search_s: float = 1200.0) -> Run:
    """A short run of a scenario file."""
    given = f"mission.search_s={search_s}", f"scenario.duration_s={search_s + 900.0}", *settings
    return missions.runs.run.run(load(scenario, [("--set", one) for one in given]), seed=seed)


class Facts(Known):
    """What is known, as maps and behaviours ask for it.

    Attributes:
        told: every value of facts; known: the latest of others; anomalies: names of those that are known.
    """

    def __init__(self, told: dict[tuple[str, str], set[int]]) -> None:
        self.told = told
        self.known: dict[tuple[str, str], object] = {}
        self.anomalies: tuple[str, ...] = ()

    def get(self, key: tuple[str, str], default: object = None) -> object:
        return self.known.get(key, default)

    def values(self, key: tuple[str, str]) -> set[int]:
        return self.told.get(key, set())

    def instances(self, of_class: str) -> tuple[str, ...]:
        return self.anomalies if of_class == "Anomaly" else ()

    def add(self, name: str, place_m: tuple[float, float]) -> None:
        """An anomaly is known."""
        self.anomalies += (name,)
        self.known["location", name] = place_m
