"""Plan: which runs a study asks for, and when it has enough of them.

Common random numbers: the seed of a run depends on the master seed and the repeat alone, so that the n-th repeats of
all configurations meet the same losses. A run's key is a hash of version, resolved configuration and seed. Which
runs are still needed is a function of the finished ones alone, whatever order they finished in.
"""

from __future__ import annotations

import hashlib
import math
import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from typing import TYPE_CHECKING, Any

from missions.document import toml_value
from missions.sweeps.study_file import StoppingRule, StudyFile

if TYPE_CHECKING:
    from missions.scenarios import Scenario
    from missions.sweeps.study import Configuration, Study

Summaries = Mapping[str, Mapping[str, Any]]
"""Summary of every finished run by key."""


def version() -> str:
    """Version of this program."""
    return metadata.version("remoras")


def seed_of(master: int, repeat: int) -> int:
    """Seed of all runs of a repeat, 48 bits."""
    return int.from_bytes(hashlib.sha256(f"{master}:{repeat}".encode()).digest()[:6], "big")


@dataclass(frozen=True)
class RunTask:
    """One run to make, with everything that a worker needs for it.

    Args:
        key: hash of version, resolved configuration and seed.
        scenario: resolved; a worker reads no file.
        seed: of the run.
        repeat: number from 0; runs of one repeat share their seed.
        settings: keys that the study sets, with their values.
        replay: command that repeats the run alone.
        keep_tables: True if its tables go into the sample.
    """

    key: str
    scenario: Scenario
    seed: int
    repeat: int
    settings: Mapping[str, Any]
    replay: str
    keep_tables: bool


@dataclass(frozen=True)
class RunSchedule:
    """Keys of the runs that a study asks for; enough to say how far a sweep is, without its scenarios.

    Args:
        version: of the program.
        file: the study.
        digests: a hash of every resolved configuration.
    """

    version: str
    file: StudyFile
    digests: tuple[str, ...]

    def key(self, number: int, repeat: int) -> str:
        """Key of a repeat of the configuration with that number."""
        seed = seed_of(self.file.study.seed, repeat)
        return hashlib.sha256(f"{self.version} {self.digests[number]} {seed}".encode()).hexdigest()[:20]

    def repeats(self, number: int, summaries: Summaries) -> int:
        """Repeats that a configuration needs, as far as the finished runs tell."""
        rule = self.file.stopping
        if rule is None:
            return self.file.study.repeats
        values: list[float | None] = []
        for repeat in range(rule.maximum):
            summary = summaries.get(self.key(number, repeat))
            if summary is None:
                break
            values.append(summary.get(rule.metric))
        return repeats_needed(rule, values)

    def count(self, summaries: Summaries) -> int:
        """Runs that are planned, as far as the finished runs tell."""
        return sum(self.repeats(number, summaries) for number in range(len(self.digests)))


@dataclass(frozen=True)
class SweepPlan:
    """The runs of a study."""

    study: Study

    @cached_property
    def schedule(self) -> RunSchedule:
        """Keys of the runs."""
        digests = (
            hashlib.sha256(configuration.scenario.model_dump_json().encode()).hexdigest()
            for configuration in self.study.configurations
        )
        return RunSchedule(version(), self.study.file, tuple(digests))

    def task(self, number: int, repeat: int) -> RunTask:
        """A repeat of the configuration with that number, ready to run."""
        configuration = self.study.configurations[number]
        seed = seed_of(self.study.design.seed, repeat)
        return RunTask(
            self.schedule.key(number, repeat),
            configuration.scenario,
            seed,
            repeat,
            dict(configuration.settings),
            replay_command(configuration, seed),
            repeat < self.study.design.keep_tables,
        )

    def missing(self, summaries: Summaries, busy: Collection[str] = ()) -> Iterator[RunTask]:
        """Runs that are needed, neither finished nor busy: the first repeat of every configuration, then the second.

        Args:
            summaries: of the finished runs, by key.
            busy: keys of the runs that workers have.
        """
        schedule = self.schedule
        needed = [schedule.repeats(number, summaries) for number in range(len(schedule.digests))]
        for repeat in range(max(needed, default=0)):
            for number, repeats in enumerate(needed):
                if repeat < repeats:
                    key = schedule.key(number, repeat)
                    if key not in summaries and key not in busy:
                        yield self.task(number, repeat)


def repeats_needed(rule: StoppingRule, values: Sequence[float | None]) -> int:
    """Repeats that a stopping rule asks for, given the values of the first repeats in their order.

    It looks after the minimum and then after every further half of it. A missing value (a failed run, a latency without
    a packet) counts as a repeat.

    Args:
        rule: metric, half-width of its interval, fewest and most repeats.
        values: of the metric; None where a run has none.
    """
    from missions.statistics import t_half_width  # workers need no statistics, and loading them takes half a second

    looked = rule.minimum
    while looked < rule.maximum and len(values) >= looked:
        known = [float(value) for value in values[:looked] if value is not None]
        half_width = t_half_width(known) if len(known) > 1 else math.inf
        if half_width <= rule.half_width:
            break
        looked = min(looked + max(1, rule.minimum // 2), rule.maximum)
    return looked


def replay_command(configuration: Configuration, seed: int) -> str:
    """The one-line command that repeats a run alone."""
    parts = ["remoras", "run", configuration.source, "--seed", str(seed)]
    for key, value in configuration.settings:
        parts += ["--set", f"{key}={value if isinstance(value, str) else toml_value(value)}"]
    return shlex.join(parts)
