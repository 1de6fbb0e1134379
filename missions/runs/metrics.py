"""Metrics that every run has, and those of a scenario: these and what its mission declares."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from missions.metric import Better, Metric, collected

if TYPE_CHECKING:
    from missions.runs.run import Run
    from missions.scenarios.scenario import Scenario

HIGHER, LOWER = Better.HIGHER, Better.LOWER


def _field(name: str) -> Callable[[Run], Any]:
    """The field of the summary with that name."""

    def of(run: Run) -> Any:
        from missions.runs.results import summary

        return summary(run)[name]

    return of


def _metric(name: str, unit: str, better: Better, label: str, headline: bool = False, note: str = "") -> Metric:
    return Metric(name, unit, better, label, _field(name), headline, note)


NEVER_RECEIVED = "What was never received is left out."

CORE_METRICS = (
    _metric("mission_time_s", "s", LOWER, "mission time", headline=True),
    _metric("completed", "", HIGHER, "success rate", headline=True),
    _metric("distance_m", "m", LOWER, "distance"),
    _metric("energy_j", "J", LOWER, "energy", headline=True),
    _metric("modem_energy_j", "J", LOWER, "modem energy"),
    _metric("n_packets", "", LOWER, "packets"),
    _metric("n_bytes", "B", LOWER, "bytes", headline=True),
    _metric("delivery_ratio", "", HIGHER, "delivery ratio"),
    _metric("mean_latency_s", "s", LOWER, "latency", note=NEVER_RECEIVED),
    _metric("p95_latency_s", "s", LOWER, "latency, 95th percentile", note=NEVER_RECEIVED),
    _metric("consistency_time_s", "s", LOWER, "consistency time", note="What never reached everybody is left out."),
    _metric("consistent_fraction", "", HIGHER, "consistent fraction"),
    _metric("false_beliefs", "", LOWER, "false beliefs"),
)
"""Metrics of every run, whatever its mission."""

MAPPING_METRICS = (
    _metric("coverage_fraction", "", HIGHER, "coverage", headline=True),
    _metric("mapping_time_s", "s", LOWER, "mapping time", note="Runs that never mapped 95 % are left out."),
    _metric("duplicate_fraction", "", LOWER, "duplicated work", headline=True),
    _metric("least_mapped_fraction", "", HIGHER, "least mapped fraction"),
)

METRICS = (*CORE_METRICS, *MAPPING_METRICS)
"""All metrics, until those of a scenario are asked of its mission."""


def metrics_of(scenario: Scenario) -> Mapping[str, Metric]:
    """Metrics of the runs of a scenario by name: those of every run, then those of its mission.

    Raises:
        ConfigurationError: a metric has no direction, or two have one name.
    """
    return collected(scenario.scenario.mission, METRICS)
