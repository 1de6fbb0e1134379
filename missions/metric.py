"""Metric: a figure that says how a run went, declared once beside the function that computes it.

The summary of a run, the metrics that a study may name, the direction of a ranking, axes and captions follow from the
declaration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from missions.errors import ConfigurationError, ConfigurationFault

if TYPE_CHECKING:
    from missions.runs.run import Run


class Better(Enum):
    """Which of two values of a metric is the better one."""

    HIGHER = "higher"
    LOWER = "lower"
    NEITHER = "neither"


@dataclass(frozen=True)
class Metric:
    """One field of a summary that can be compared between runs.

    Args:
        name: name of the field, with its unit as suffix if it has one.
        unit: unit, empty for numbers without one.
        better: the direction of a ranking.
        label: what axes and captions call it, without the unit; with hyphens also the name of its chart.
        of: its value in a finished run; None where the run has none.
        headline: True if a study that names no metrics compares it.
        note: sentence that captions add, for example about what is left out.
    """

    name: str
    unit: str
    better: Better
    label: str
    of: Callable[[Run], float | int | bool | None]
    headline: bool = False
    note: str = ""


def collected(source: str, metrics: Iterable[Metric]) -> dict[str, Metric]:
    """Metrics by name, in their order.

    Args:
        source: who declares them, for messages.
        metrics: those of every run, then those of the mission.

    Raises:
        ConfigurationError: a metric has no direction, or two have one name.
    """
    found: dict[str, Metric] = {}
    faults: list[ConfigurationFault] = []
    directions = ", ".join(str(better) for better in Better)
    for metric in metrics:
        better = getattr(metric, "better", None)
        if not isinstance(better, Better):
            given = "" if better is None else repr(better)
            faults.append(ConfigurationFault(f"metric {metric.name}, better", given, f"allowed: {directions}"))
        if metric.name in found:
            allowed = "declared twice; give one of the two metrics another name"
            faults.append(ConfigurationFault(f"metric {metric.name}", "", allowed))
        found[metric.name] = metric
    if faults:
        raise ConfigurationError(source, faults)
    return found
