"""Plan: runs that a study needs, and its stopping rule.

Common random numbers: a run's seed depends only on master seed and repeat, so the n-th repeats of all configurations
meet the same losses. The runs still needed depend only on the finished ones, not on their order.
"""

from __future__ import annotations

import hashlib
import json
import math
import shlex
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

from missions.files import is_reference, texts, toml_value
from missions.scenarios.parts import strategy_of
from remoras.version import __version__

if TYPE_CHECKING:
    from missions.metric import Metric
    from missions.scenarios import Scenario
    from missions.sweeps.ledger import Line
    from missions.sweeps.study import Configuration, Study
    from missions.sweeps.study_file import StoppingRule, StudyFile

UNFORESEEN = "unforeseen"  # column of the table of runs with the name of the unforeseen case
DRAWN = "drawn"  # summary field: whether the run drew random numbers; null if unknown
OF_THE_SEED = frozenset({"seed", DRAWN})  # fields that differ between repeats of one run
Summaries = Mapping[str, Mapping[str, Any]]  # summary of every finished run by key


def run_content(scenario: Scenario) -> str:
    """Return the content of a scenario that determines its runs: all but its metrics."""
    table = scenario.scenario.model_copy(update={"metrics": ()})
    return scenario.model_copy(update={"scenario": table}).model_dump_json()


def seed_of(master: int, repeat: int) -> int:
    """Return the seed (48 bits) of all runs of a repeat."""
    return int.from_bytes(hashlib.sha256(f"{master}:{repeat}".encode()).digest()[:6], "big")


@dataclass(frozen=True)
class RunTask:
    """Run to make, with all data that a worker needs.

    ``key`` is a hash of version, resolved configuration (``number``) and seed. Runs of one ``repeat`` (from 0) share
    their seed. ``replay`` is the command that repeats the run alone.
    """

    key: str
    number: int
    scenario: Scenario
    seed: int
    repeat: int
    settings: Mapping[str, Any]
    replay: str
    keep_tables: bool


@dataclass(frozen=True)
class ConfigurationLabel:
    """Configuration as stored; ``digest`` identifies the resolved scenario, ``source`` is as for `remoras run`.

    ``unforeseen`` names the case; ``duration_s`` ends an incomplete run; ``assumed`` are assumptions of its channel.
    """

    source: str
    settings: tuple[tuple[str, Any], ...]
    unforeseen: str
    duration_s: float
    digest: str
    assumed: str = ""

    @classmethod
    def of(cls, configuration: Configuration) -> ConfigurationLabel:
        """Return the label of a configuration."""
        scenario = configuration.scenario
        return cls(
            configuration.source,
            configuration.settings,
            configuration.unforeseen,
            scenario.scenario.duration_s,
            hashlib.sha256(run_content(scenario).encode()).hexdigest(),
            scenario.channel.assumed(),
        )

    @property
    def columns(self) -> dict[str, Any]:
        """Settings as columns of the table of runs."""
        return {**dict(self.settings), **({UNFORESEEN: self.unforeseen} if self.unforeseen else {})}

    def on(self, line: Line) -> Line:
        """Return the line of a run with the settings of this configuration."""
        replay = replay_command(self, line["summary"]["seed"]) if line["error"] else ""
        return {**line, "settings": self.columns, "replay": replay, "duration_s": self.duration_s}


@cache  # asked for each run at each finished one
def _key(version: str, digest: str, master: int, repeat: int) -> str:
    return hashlib.sha256(f"{version} {digest} {seed_of(master, repeat)}".encode()).hexdigest()[:20]


@dataclass(frozen=True)
class RunSchedule:
    """Keys of the runs of a study, sufficient for its progress without scenarios.

    A run without a value of the stopping rule's metric counts with its duration if the metric is censored.
    ``repeats_of`` has the repeats of each configuration; None for those of the study.
    """

    version: str
    file: StudyFile
    labels: tuple[ConfigurationLabel, ...]
    metrics: Mapping[str, Metric] = field(default_factory=dict)
    repeats_of: Sequence[int] | None = None

    def key(self, number: int, repeat: int) -> str:
        """Return the key of a repeat of a configuration."""
        return _key(self.version, self.labels[number].digest, self.file.study.seed, repeat)

    def repeats(self, number: int, summaries: Summaries) -> int:
        """Return the repeats that a configuration needs, given the finished runs.

        A run without random draws is made once. If draws are unknown, two runs decide: equal outcomes end the repeats.
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
        """True if earlier repeats already show that this one is needed."""
        if repeat == 0:
            return True
        first, second = (summaries.get(self.key(number, earlier)) for earlier in (0, 1))
        if first is None:
            return False
        return repeat == 1 or second is not None or bool(first.get(DRAWN, True))

    def _demanded(self, number: int, summaries: Summaries) -> int:
        rule = self.file.stopping
        if rule is None or self.repeats_of is not None:
            return self.file.study.repeats if self.repeats_of is None else self.repeats_of[number]
        values: list[float | None] = []
        for repeat in range(rule.maximum):
            # Repeats count up to the first gap, so that the order in which runs finish does not matter.
            summary = summaries.get(self.key(number, repeat))
            if summary is None:
                break
            value = summary.get(rule.metric)
            is_restricted = value is None and self.metrics[rule.metric].censored
            values.append(self.labels[number].duration_s if is_restricted else value)
        return repeats_needed(rule, values)

    def lacking(self, number: int, summaries: Summaries) -> list[int]:
        """Return the repeats of a configuration that are needed and not finished."""
        return [n for n in range(self.repeats(number, summaries)) if self.key(number, n) not in summaries]

    def missing(self, summaries: Summaries, busy: Collection[str] = ()) -> Iterator[tuple[int, int]]:
        """Yield configuration and repeat of the runs needed, not finished and not ``busy``, first repeats first."""
        numbers = range(len(self.labels))
        due = sorted((repeat, number) for number in numbers for repeat in self.lacking(number, summaries))
        return ((number, repeat) for repeat, number in due if self.key(number, repeat) not in busy)

    def labelled(self, lines: Mapping[str, Line]) -> dict[str, Line]:
        """Return ledger lines with the current settings of their configurations; a grown study may set more keys."""
        n_repeats = 1 + max((line["repeat"] for line in lines.values()), default=-1)
        labels = {self.key(n, repeat): label for n, label in enumerate(self.labels) for repeat in range(n_repeats)}
        return {key: labels[key].on(line) if key in labels else line for key, line in lines.items()}


@dataclass(frozen=True)
class SweepPlan:
    """Runs of a study; ``repeats_of`` as in ``RunSchedule``."""

    study: Study
    repeats_of: Sequence[int] | None = None

    @cached_property  # each configuration as JSON
    def schedule(self) -> RunSchedule:
        """Keys of the runs."""
        labels = map(ConfigurationLabel.of, self.study.configurations)
        return RunSchedule(__version__, self.study.file, tuple(labels), self.study.metrics, self.repeats_of)

    def task(self, number: int, repeat: int) -> RunTask:
        """Return a repeat of a configuration, ready to run."""
        configuration = self.study.configurations[number]
        label, keep = self.schedule.labels[number], self.study.design.keep_tables
        seed = seed_of(self.study.design.seed, repeat)
        return RunTask(
            self.schedule.key(number, repeat),
            number,
            configuration.scenario,
            seed,
            repeat,
            label.columns,
            replay_command(label, seed),
            keep is None or repeat < keep,
        )

    @cached_property  # each configuration as JSON
    def alike(self) -> list[int]:
        """First configuration with equal runs, of each: a loss rate has no effect where no vehicle sends packets.

        Only shipped code is known not to read the loss rate.
        """
        first: dict[str, int] = {}
        keys = (_key_of_runs(part.scenario) for part in self.study.configurations)
        return [first.setdefault(key or str(number), number) for number, key in enumerate(keys)]

    def due(self, summaries: Summaries, busy: Collection[str] = ()) -> Iterable[list[RunTask]]:
        """Return missing runs known to be needed, except ``busy`` ones; equal runs in one list."""
        due: dict[tuple[int, int], list[RunTask]] = {}
        for number, repeat in self.schedule.missing(summaries, busy):
            if self.schedule.is_known(number, repeat, summaries):
                due.setdefault((self.alike[number], repeat), []).append(self.task(number, repeat))
        return due.values()

    def missing(self, summaries: Summaries) -> Iterator[RunTask]:
        """Yield runs needed and not finished, first repeats first."""
        return (self.task(number, repeat) for number, repeat in self.schedule.missing(summaries))


def _key_of_runs(scenario: Scenario) -> str:
    """Return the content of a shipped scenario without packets, apart from the loss rate; else an empty text."""
    table = json.loads(run_content(scenario))
    if any(map(is_reference, texts(table))) or strategy_of(scenario).declaration.communicates:
        return ""
    table["channel"].pop("per", None)
    return json.dumps(table)


def outcome(summary: Mapping[str, Any], but: Collection[str] = ()) -> dict[str, Any]:
    """Return the outcome fields of a summary, equal in repeats without random draws."""
    return {name: value for name, value in summary.items() if name not in OF_THE_SEED and name not in but}


def repeats_needed(rule: StoppingRule, values: Sequence[float | None]) -> int:
    """Return the repeats that a stopping rule demands, given the first repeats' values; None counts as a repeat.

    It is evaluated at the minimum and after every further half of it.
    """
    from missions.statistics import t_half_width  # slow to load, and workers need no statistics

    looked = rule.minimum
    while looked < rule.maximum and len(values) >= looked:
        known = [float(value) for value in values[:looked] if value is not None]
        if len(known) > 1 and rule.is_met(t_half_width(known), math.fsum(known) / len(known)):
            break
        looked = min(looked + max(1, rule.minimum // 2), rule.maximum)
    return looked


def replay_command(label: ConfigurationLabel, seed: int) -> str:
    """Return the command that repeats a run alone."""
    parts = ["remoras", "run", label.source, "--seed", str(seed)]
    for key, value in label.settings:
        parts += ["--set", f"{key}={value if isinstance(value, str) else toml_value(value)}"]
    return shlex.join(parts)
