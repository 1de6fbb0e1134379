"""Metric: a figure that says how a run went, declared once beside the function that computes it.

The summary of a run, the metrics that a study may name, the direction of a ranking, axes and captions follow from the
declaration.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from missions.errors import ConfigurationError, ConfigurationFault, OutputError

if TYPE_CHECKING:
    from missions.runs.run import Run


TAKEN = frozenset({
    "scenario", "strategy", "policy", "channel", "per", "seed", "n_vehicles", "reason", "milestones",
    "key", "repeat", "unforeseen", "status", "error", "replay", "wall_s", "cpu_s", "host", "worker", "finished_at",
})  # fmt: skip
"""Fields of a summary and columns of the table of runs that are no metrics."""


class Better(Enum):
    """Which of two values of a metric is the better one."""

    HIGHER = "higher"
    LOWER = "lower"
    NEITHER = "neither"


class Absent(Enum):
    """Value of a metric that says nothing of a run; the summary leaves its field out."""

    NOT_APPLICABLE = "not applicable"


NOT_APPLICABLE = Absent.NOT_APPLICABLE
"""The metric makes no sense in this run: nothing to recover from, for example."""


@dataclass(frozen=True)
class Metric:
    """One field of a summary that can be compared between runs.

    Args:
        name: name of the field, with its unit as suffix if it has one.
        unit: unit, empty for numbers without one.
        better: the direction of a ranking.
        label: what axes and captions call it, without the unit; with hyphens also the name of its chart.
        of: its value in a finished run; None where the run has none, NOT_APPLICABLE where the run cannot have one.
        headline: True if a study that names no metrics compares it.
        note: sentence that captions add, for example about what is left out.
        censored: True for the time (s) to an event that a run may not reach: None means "not by the end". Such a run
            is not left out of a mean; it counts with the mission's whole duration.
    """

    name: str
    unit: str
    better: Better
    label: str
    of: Callable[[Run], float | int | bool | Absent | None]
    headline: bool = False
    note: str = ""
    censored: bool = False


@dataclass(frozen=True)
class MetricRecord:
    """The declaration of a metric as results keep it, without its function.

    Args:
        name: field of the summary.
        unit: unit, empty without one.
        better: direction of a ranking; None if the results do not say it, as those of older versions do not.
        label: what axes and captions call it, without the unit.
        headline: True if it is compared where no metrics are named.
        note: sentence that captions add.
        censored: True for the time to an event that a run may not reach.
    """

    name: str
    unit: str
    better: Better | None
    label: str
    headline: bool = False
    note: str = ""
    censored: bool = False

    @classmethod
    def of(cls, metric: Metric) -> MetricRecord:
        """The record of a metric."""
        return cls(**{name: getattr(metric, name) for name in cls.__dataclass_fields__})

    def written(self) -> dict[str, Any]:
        """The declaration as JSON has it."""
        return {**vars(self), "better": self.better.value if self.better else None}

    @classmethod
    def read(cls, entry: Mapping[str, Any]) -> MetricRecord:
        """The declaration that JSON has.

        Raises:
            OutputError: a part of it is missing, or its direction is none.
        """
        try:
            better = Better(entry["better"])
            name, unit, label = (str(entry[key]) for key in ("name", "unit", "label"))
            headline, censored = bool(entry.get("headline")), bool(entry.get("censored"))
            return cls(name, unit, better, label, headline, str(entry.get("note", "")), censored)
        except (KeyError, TypeError, ValueError):
            allowed = ", ".join(better.value for better in Better)
            raise OutputError(
                f"not the declaration of a metric: {json.dumps(entry)}; "
                f"it needs name, unit, label, and better: {allowed}"
            ) from None


def _alike(one: str, other: str) -> bool:
    """True for labels that differ in case and signs alone: their charts would have one name."""
    return re.sub(r"[^a-z0-9]+", "", str(one).lower()) == re.sub(r"[^a-z0-9]+", "", str(other).lower())


def collected(source: str, metrics: Iterable[Metric]) -> dict[str, Metric]:
    """Metrics by name, in their order.

    Args:
        source: who declares them, for messages.
        metrics: those of every run, then those of the mission.

    Raises:
        ConfigurationError: a metric has no direction, its name is that of another field, or two have one name
            or one label.
    """
    found: dict[str, Metric] = {}
    faults: list[ConfigurationFault] = []
    directions = ", ".join(str(better) for better in Better)
    for metric in metrics:
        better = getattr(metric, "better", None)
        if not isinstance(better, Better):
            given = "" if better is None else repr(better)
            faults.append(ConfigurationFault(f"metric {metric.name}, better", given, f"allowed: {directions}"))
        if getattr(metric, "censored", False) and metric.unit != "s":
            allowed = "a censored metric is a time in s, since a run without it counts with its duration"
            faults.append(ConfigurationFault(f"metric {metric.name}, unit", repr(metric.unit), allowed))
        if metric.name in TAKEN:
            allowed = "a field that results have already; give the metric another name"
            faults.append(ConfigurationFault(f"metric {metric.name}", "", allowed))
        if metric.name in found:
            allowed = "declared twice; give one of the two metrics another name"
            faults.append(ConfigurationFault(f"metric {metric.name}", "", allowed))
        namesake = next((one for one in found.values() if _alike(one.label, metric.label)), None)
        if namesake is not None and namesake.name != metric.name:
            allowed = f"is also the label of {namesake.name}, and charts go by it; give one of the two another label"
            faults.append(ConfigurationFault(f"metric {metric.name}, label", repr(metric.label), allowed))
        found[metric.name] = metric
    if faults:
        raise ConfigurationError(source, faults)
    return found
