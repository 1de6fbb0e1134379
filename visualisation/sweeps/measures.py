"""Metrics as figures of a sweep draw them: the name of the chart, the scale of the axis, the words.

Everything about a metric comes from its declaration, so a metric that a mission brings has charts, a place in the
overview and a ranking without a line in this package.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from missions.comparison.rows import Comparison
from missions.metric import MetricRecord
from visualisation import words
from visualisation.errors import DrawingError
from visualisation.kinds import SWEEP_KINDS

RANKED = "mission_time_s"
"""Metric that a ranking is by if none is named."""
RATE = "completed"
"""Metric that is a rate, with Wilson's intervals."""
TRADE_OFF = ("n_bytes", RANKED)
"""Metrics of the trade-off: across, and up."""
MOST_IN_OVERVIEW = 9
PREFIXED = frozenset({"B", "bit", "J", "m", "W", "Wh"})
"""Units that take a prefix where values are large; seconds stay seconds."""
PREFIXES = ((1e6, "M"), (1e3, "k"))


@dataclass(frozen=True)
class Measure:
    """A metric on an axis.

    Args:
        metric: its declaration.
        unit: of the axis.
        scale: factor from the metric's unit to that of the axis.
        share: whether all means lie between 0 and 1.
        signed: whether its zero is a value like others, as that of a difference is.
    """

    metric: MetricRecord
    unit: str
    scale: float
    share: bool
    signed: bool = False

    @property
    def name(self) -> str:
        """What captions call it."""
        return words.within(self.metric.label)

    @property
    def label(self) -> str:
        """Text of the axis."""
        return words.axis(self.metric.label, self.unit)

    @property
    def whiskers(self) -> bool:
        """True if intervals are lines instead of bands.

        A success rate is equal in so many series that bands would pile up.
        """
        return self.metric.name == RATE and not self.signed

    def bounds(self, row: Comparison) -> tuple[float, float]:
        """Ends of the interval on the scale of the axis; the mean where there is none.

        Where all runs got there, it is the interval of the mean of runs that do.
        """
        all_reached = row.n_reached == row.n
        ends = (row.reached_ci95_low, row.reached_ci95_high) if all_reached else (row.ci95_low, row.ci95_high)
        low, high = (row.mean if bound is None else bound for bound in ends)
        return low * self.scale, high * self.scale


def measure(metric: MetricRecord, rows: Sequence[Comparison]) -> Measure:
    """The metric on an axis that shows these rows."""
    means = [row.mean for row in rows]
    largest = max(map(abs, means), default=0.0)
    prefix = next(((1.0 / size, sign) for size, sign in PREFIXES if largest >= size), (1.0, ""))
    scale, sign = prefix if metric.unit in PREFIXED else (1.0, "")
    share = metric.unit in ("", "1") and all(0.0 <= mean <= 1.0 for mean in means)
    return Measure(metric, sign + metric.unit, scale, share)


def of_differences(own: Measure, rows: Sequence[Comparison]) -> tuple[Measure, list[Comparison]]:
    """The differences to the baseline as a measure of their own, and rows that have them in place of the means.

    Args:
        own: the metric on its axis.
        rows: of the metric; those without a difference are left out.
    """
    metric = replace(own.metric, label=f"{own.metric.label}, difference")
    found = [
        replace(
            row, mean=row.diff_to_baseline, ci95_low=row.diff_ci95_low, ci95_high=row.diff_ci95_high,
            n=row.n_pairs, n_reached=row.n_pairs_reached,
            reached_ci95_low=row.diff_reached_ci95_low, reached_ci95_high=row.diff_reached_ci95_high,
        )
        for row in rows
        if row.diff_to_baseline is not None
    ]  # fmt: skip
    return replace(own, metric=metric, share=False, signed=True), found


def figure_kind(metric: MetricRecord) -> str:
    """The kind of figure that draws one metric: its label with hyphens.

    >>> from missions.metric import Better
    >>> figure_kind(MetricRecord("n_dives", "", Better.LOWER, "Dives per vehicle"))
    'dives-per-vehicle'
    """
    return re.sub(r"[^a-z0-9]+", "-", metric.label.lower()).strip("-")


def by_kind(metrics: Sequence[MetricRecord]) -> Mapping[str, MetricRecord]:
    """Metrics by the kinds of figures that draw them.

    Raises:
        DrawingError: two share a kind, or one has that of another figure.
    """
    found: dict[str, MetricRecord] = {}
    for metric in metrics:
        kind = figure_kind(metric)
        if kind in SWEEP_KINDS or kind in found:
            other = f"metric {found[kind].name}" if kind in found else f"figure {kind}"
            raise DrawingError(
                f"metric {metric.name}: its label {metric.label!r} is also that of the {other}; give it another label"
            )
        found[kind] = metric
    return found
