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
from typing import TYPE_CHECKING, Any

from missions.files import toml_value
from remoras.version import __version__

if TYPE_CHECKING:
    from missions.scenarios import Scenario
    from missions.sweeps.ledger import Line
    from missions.sweeps.study import Configuration, Study
    from missions.sweeps.study_file import StudyFile

UNFORESEEN = "unforeseen"
"""Column of the table of runs with the name of what is unforeseen in them."""
DRAWN = "drawn"
"""Field of a summary: whether anything was drawn in the run; null where nobody can say."""
OF_THE_SEED = frozenset({"seed", DRAWN})
"""Fields that differ between repeats of one run."""
Summaries = Mapping[str, Mapping[str, Any]]
"""Summary of every finished run by key."""


def version() -> str:
    """Version of this program."""
    return __version__


def run_content(scenario: Scenario) -> str:
    """What a scenario makes of its runs: all of it but the metrics that it names itself, which are asked afterwards."""
    about = scenario.scenario.model_copy(update={"metrics": ()})
    return scenario.model_copy(update={"scenario": about}).model_dump_json()


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
class ConfigurationLabel:
    """What a folder says of a configuration, beside its digest.

    Args:
        source: scenario as `remoras run` takes it.
        settings: every key that the study sets, with its value.
        unforeseen: name of what is unforeseen in its runs; empty in a study without that axis.
        duration_s: end of a run whose mission has not completed.
    """

    source: str
    settings: tuple[tuple[str, Any], ...]
    unforeseen: str
    duration_s: float

    @classmethod
    def of(cls, configuration: Configuration) -> ConfigurationLabel:
        """The label of a configuration."""
        duration_s = configuration.scenario.scenario.duration_s
        return cls(configuration.source, configuration.settings, configuration.unforeseen, duration_s)

    @property
    def columns(self) -> dict[str, Any]:
        """Settings as the table of runs has them."""
        return {**dict(self.settings), **({UNFORESEEN: self.unforeseen} if self.unforeseen else {})}

    def on(self, line: Line) -> Line:
        """The line of a run of this configuration, with these settings."""
        replay = replay_command(self, line["summary"]["seed"]) if line["error"] else ""
        return {**line, "settings": self.columns, "replay": replay, "duration_s": self.duration_s}


@dataclass(frozen=True)
class StoppingLimits:
    """When a configuration has been repeated often enough; see ``StoppingRule`` of a study's file."""

    metric: str
    minimum: int
    maximum: int
    half_width: float | None = None
    half_width_share: float | None = None

    def is_met(self, half_width: float, mean: float) -> bool:
        """True if a mean with an interval of that half-width is known well enough."""
        limits = [] if self.half_width is None else [self.half_width]
        limits += [] if self.half_width_share is None else [self.half_width_share * abs(mean)]
        return any(half_width <= limit for limit in limits)


@dataclass(frozen=True)
class Demand:
    """What a study asks of every configuration: repeats of a master seed, or a rule when to stop."""

    seed: int
    repeats: int
    stopping: StoppingLimits | None = None

    @classmethod
    def of(cls, file: StudyFile) -> Demand:
        """The demand of a study's file."""
        return cls.read(file.model_dump(mode="json"))

    @classmethod
    def read(cls, tables: Mapping[str, Any]) -> Demand:
        """The demand of a study's tables, as its folder records them.

        Raises:
            KeyError, TypeError: something is missing, or is no number.
        """
        design, rule = tables["study"], tables.get("stopping")
        numbers = [design["seed"], design["repeats"], *((rule["minimum"], rule["maximum"]) if rule else ())]
        if not all(isinstance(number, int) for number in numbers):
            raise TypeError(f"expected whole numbers, not {numbers}")
        return cls(design["seed"], design["repeats"], StoppingLimits(**rule) if rule else None)


@dataclass(frozen=True)
class RunSchedule:
    """Keys of the runs that a study asks for; enough to say how far a sweep is, without its scenarios.

    Args:
        version: of the program.
        demand: what the study asks of every configuration.
        digests: a hash of every resolved configuration.
        labels: of every configuration; none in folders of older versions.
        restricted: whether a run without a value of the stopping rule's metric counts with its duration.
    """

    version: str
    demand: Demand
    digests: tuple[str, ...]
    labels: tuple[ConfigurationLabel, ...] = ()
    restricted: bool = False

    def key(self, number: int, repeat: int) -> str:
        """Key of a repeat of the configuration with that number."""
        if (key := self._keys.get((number, repeat))) is None:
            seed = seed_of(self.demand.seed, repeat)
            key = hashlib.sha256(f"{self.version} {self.digests[number]} {seed}".encode()).hexdigest()[:20]
            self._keys[number, repeat] = key
        return key

    @cached_property  # a digest for each run, asked at each finished one
    def _keys(self) -> dict[tuple[int, int], str]:
        """Keys by configuration and repeat, as far as they have been asked for."""
        return {}

    def repeats(self, number: int, summaries: Summaries) -> int:
        """Repeats that a configuration needs, as far as the finished runs tell.

        Where nothing is drawn all repeats are one run, so it is made once; where nobody can say whether anything is,
        twice, and no more if both end alike.
        """
        demanded = self._demanded(number, summaries)
        first, second = (summaries.get(self.key(number, repeat)) for repeat in (0, 1))
        if first is None or first.get(DRAWN, True):
            return demanded
        if first[DRAWN] is False:
            return min(demanded, 1)
        alike = second is not None and second.get(DRAWN, True) is None and outcome(first) == outcome(second)
        return min(demanded, 2) if alike else demanded

    def is_known(self, number: int, repeat: int, summaries: Summaries) -> bool:
        """True if the repeats before this one say that it is needed: the first, and a second where that is silent."""
        if repeat == 0:
            return True
        first, second = (summaries.get(self.key(number, earlier)) for earlier in (0, 1))
        if first is None:
            return False
        return repeat == 1 or second is not None or bool(first.get(DRAWN, True))

    def _demanded(self, number: int, summaries: Summaries) -> int:
        """Repeats that the study asks for."""
        rule = self.demand.stopping
        if rule is None:
            return self.demand.repeats
        values: list[float | None] = []
        for repeat in range(rule.maximum):
            summary = summaries.get(self.key(number, repeat))
            if summary is None:
                break
            value = summary.get(rule.metric)
            values.append(self.labels[number].duration_s if value is None and self.restricted else value)
        return repeats_needed(rule, values)

    def n_missing(self, summaries: Summaries) -> int:
        """Runs that are needed and not finished, as far as the finished runs tell."""
        return sum(
            self.key(number, repeat) not in summaries
            for number in range(len(self.digests))
            for repeat in range(self.repeats(number, summaries))
        )

    def labelled(self, lines: Mapping[str, Line]) -> dict[str, Line]:
        """Lines of the ledger with the settings that the study gives their configurations now.

        A study that has grown may set keys that it left to the scenario before; the runs are the same.
        """
        n_repeats = 1 + max((line["repeat"] for line in lines.values()), default=-1)
        label_of = {
            self.key(number, repeat): label for number, label in enumerate(self.labels) for repeat in range(n_repeats)
        }
        return {key: label_of[key].on(line) if key in label_of else line for key, line in lines.items()}


@dataclass(frozen=True)
class SweepPlan:
    """The runs of a study."""

    study: Study

    @cached_property  # each configuration as JSON
    def schedule(self) -> RunSchedule:
        """Keys of the runs."""
        digests = (
            hashlib.sha256(run_content(configuration.scenario).encode()).hexdigest()
            for configuration in self.study.configurations
        )
        labels = map(ConfigurationLabel.of, self.study.configurations)
        return RunSchedule(version(), Demand.of(self.study.file), tuple(digests), tuple(labels), self._is_restricted)

    @property
    def _is_restricted(self) -> bool:
        rule = self.study.file.stopping
        return rule is not None and self.study.metrics[rule.metric].censored

    def task(self, number: int, repeat: int) -> RunTask:
        """A repeat of the configuration with that number, ready to run."""
        configuration = self.study.configurations[number]
        label, keep = self.schedule.labels[number], self.study.design.keep_tables
        seed = seed_of(self.study.design.seed, repeat)
        return RunTask(
            self.schedule.key(number, repeat),
            configuration.scenario,
            seed,
            repeat,
            label.columns,
            replay_command(label, seed),
            keep is None or repeat < keep,
        )

    def due(self, summaries: Summaries, busy: Collection[str] = ()) -> Iterator[RunTask]:
        """Of ``missing`` those of which it is known that they are needed: further repeats wait for the first.

        Args:
            summaries: of the finished runs, by key.
            busy: keys of the runs that workers have, left out.
        """
        for number, repeat in self._missing(summaries, busy):
            if self.schedule.is_known(number, repeat, summaries):
                yield self.task(number, repeat)

    def missing(self, summaries: Summaries) -> Iterator[RunTask]:
        """Runs that are needed and not finished: the first repeat of every configuration, then the second."""
        return (self.task(number, repeat) for number, repeat in self._missing(summaries, ()))

    def _missing(self, summaries: Summaries, busy: Collection[str]) -> Iterator[tuple[int, int]]:
        schedule = self.schedule
        needed = [schedule.repeats(number, summaries) for number in range(len(schedule.digests))]
        for repeat in range(max(needed, default=0)):
            for number, repeats in enumerate(needed):
                if repeat < repeats:
                    key = schedule.key(number, repeat)
                    if key not in summaries and key not in busy:
                        yield number, repeat


def outcome(summary: Mapping[str, Any], but: Collection[str] = ()) -> dict[str, Any]:
    """What a summary says of how a run ended: alike in repeats in which nothing was drawn.

    Args:
        summary: of the run.
        but: fields that not every run has, such as those of metrics that are read of the tables of a sample.
    """
    return {name: value for name, value in summary.items() if name not in OF_THE_SEED and name not in but}


def repeats_needed(rule: StoppingLimits, values: Sequence[float | None]) -> int:
    """Repeats that a stopping rule asks for, given the values of the first repeats in their order.

    It looks after the minimum and then after every further half of it. A missing value (a failed run, a latency without
    a packet) counts as a repeat.

    Args:
        rule: metric, limits of the half-width of its interval, fewest and most repeats.
        values: of the metric; None where a run has none.
    """
    from missions.statistics import t_half_width  # workers need no statistics, and loading them takes half a second

    looked = rule.minimum
    while looked < rule.maximum and len(values) >= looked:
        known = [float(value) for value in values[:looked] if value is not None]
        if len(known) > 1 and rule.is_met(t_half_width(known), math.fsum(known) / len(known)):
            break
        looked = min(looked + max(1, rule.minimum // 2), rule.maximum)
    return looked


def replay_command(label: ConfigurationLabel, seed: int) -> str:
    """The one-line command that repeats a run alone."""
    parts = ["remoras", "run", label.source, "--seed", str(seed)]
    for key, value in label.settings:
        parts += ["--set", f"{key}={value if isinstance(value, str) else toml_value(value)}"]
    return shlex.join(parts)
