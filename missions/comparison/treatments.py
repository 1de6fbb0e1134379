"""Treatments: what a sweep compares, and the values of a metric that its runs gave.

A treatment, as in the design of experiments, is a configuration without its repeat.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from missions.errors import OutputError
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import DONE, Line
from missions.sweeps.study_file import flattened
from worldmodel import suggestion

FIELDS = ("scenario", "strategy", "policy", "channel", "per")
OWN_COLUMNS = ("strategy.name", "communication.policy", "channel.name", "channel.per")
"""Settings that have a column of their own."""

Summary = Mapping[str, Any]


@dataclass(frozen=True)
class Treatment:
    """What was run.

    Args:
        settings: other keys of the scenario that the study varies, with their values as text.
    """

    scenario: str
    strategy: str
    policy: str
    channel: str
    per: float
    settings: tuple[tuple[str, str], ...]

    def columns(self) -> dict[str, Any]:
        """The columns of a row that say which treatment it is about."""
        return {**vars(self), "settings": dict(self.settings)}


def treatments_of(results: SweepResults) -> dict[Treatment, dict[int, Summary]]:
    """Summaries of the runs that did not fail, by treatment and repeat, in a fixed order.

    Raises:
        OutputError: no run has finished.
    """
    constant = dict(flattened(results.schedule.file.set))
    found = _grouped(results.lines.values(), {*OWN_COLUMNS, *constant})
    if not found:
        raise OutputError(f"{results.folder}: no run has finished yet, there is nothing to compare")
    return found


def _grouped(lines: Iterable[Line], left_out: Collection[str]) -> dict[Treatment, dict[int, Summary]]:
    """Summaries by treatment and repeat; ``left_out`` are keys of settings that do not tell treatments apart."""
    found: dict[Treatment, dict[int, Summary]] = {}
    for line in lines:
        summary = line["summary"]
        settings = tuple((key, str(value)) for key, value in sorted(line["settings"].items()) if key not in left_out)
        if line["status"] == DONE:
            scenario, strategy, policy, channel, per = (summary[key] for key in FIELDS)
            treatment = Treatment(scenario, strategy, policy, channel, per, settings)
            found.setdefault(treatment, {})[line["repeat"]] = summary
    return {treatment: dict(sorted(found[treatment].items())) for treatment in sorted(found, key=_in_order)}


def _in_order(treatment: Treatment) -> tuple[Any, ...]:
    """Key to sort by; settings that are numbers go by their value: 4 vehicles come before 16."""
    settings = tuple((key, _number(value), value) for key, value in treatment.settings)
    return (
        treatment.scenario,
        treatment.channel,
        treatment.per,
        settings,
        treatment.strategy,
        treatment.policy,
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def values_of(runs: Mapping[int, Summary], metric: str) -> dict[int, float]:
    """Values of a metric by repeat; runs in which it has none (a latency without a packet) are left out."""
    return {repeat: float(run[metric]) for repeat, run in runs.items() if run.get(metric) is not None}


def check_name(option: str, name: str, known: Collection[str]) -> None:
    """Refuse a name that is none of those allowed.

    Args:
        option: by which a user gives the name, for the message.
        name: as it was given.
        known: names that are allowed.

    Raises:
        OutputError: with the option, the name, what is allowed and the nearest of it.
    """
    if name not in known:
        raise OutputError(f"{option} {name!r}: allowed are {', '.join(known)}{suggestion(name, known)}")
