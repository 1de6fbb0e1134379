"""Figures of a sweep that draw one metric, by the name that a user types."""

from __future__ import annotations

from typing import NamedTuple


class Measure(NamedTuple):
    """A metric and how it is drawn.

    Args:
        metric: field of the summary.
        name: what captions call it.
        label: what axes call it, with its unit.
        scale: factor from the field's unit to that of the axis.
        share: whether it lies between 0 and 1.
        whiskers: intervals as lines; for what is equal in so many series that bands would pile up. Those of a rate of 1
            are left out: nearly all of them would be of one length, and hide the lines.
        note: what captions say of it.
    """

    metric: str
    name: str
    label: str
    scale: float = 1.0
    share: bool = False
    whiskers: bool = False
    note: str = ""


MEASURES = {
    "mission-time": Measure("mission_time_s", "mission time", "mission time / s"),
    "success-rate": Measure("completed", "success rate", "success rate", share=True, whiskers=True),
    "coverage": Measure("coverage_fraction", "coverage", "coverage", share=True),
    "duplicated-work": Measure("duplicate_fraction", "duplicated work", "duplicated work", share=True),
    "bytes": Measure("n_bytes", "bytes sent", "bytes sent / kB", 1e-3),
    "energy": Measure("energy_j", "energy of the fleet", "energy / kJ", 1e-3),
    "latency": Measure(
        "mean_latency_s", "mean latency of knowledge", "latency / s", note="What was never received is left out."
    ),
    "consistency-time": Measure(
        "consistency_time_s",
        "mean time to consistency",
        "time to consistency / s",
        note="What never reached everybody is left out.",
    ),
}
TRADE_OFF = (MEASURES["bytes"], MEASURES["mission-time"])
"""Across, and up."""
OVERVIEW = ("mission-time", "success-rate", "coverage", "duplicated-work", "bytes", "latency")
COMPARISON_KINDS = (*MEASURES, "trade-off", "ranking", "overview")
"""Kinds of figures of a sweep."""
