"""Arrangement of a sweep's metrics in panels and series, by the declaration of a metric only.

- Axis: the packet error rate. If it is constant, or an estimate of the acoustic channel: the numeric setting with the
  most values, else the unforeseen cases, else a textual setting of three values or more, such as the modem.
- Series: strategies, policies, or both, whichever vary.
- Panels: combinations of the remaining variables, without settings that are monotonic in the axis.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

from missions import words
from missions.comparison import Comparison, Rank
from missions.metric import Metric
from missions.sweeps.folder import is_bound
from missions.words import REPEAT
from visualisation import style
from visualisation.output import SWEEP_KINDS, DrawingError

RANKED = "mission_time_s"
RATE = "completed"  # metric that is a rate, with Wilson intervals
TRADE_OFF = ("n_bytes", RANKED)  # metrics of the trade-off: horizontal, vertical
MOST_IN_OVERVIEW = 9
PREFIXED = frozenset({"B", "bit", "J", "m", "W", "Wh"})  # units with SI prefixes for large values; seconds have none
PREFIXES = ((1e6, "M"), (1e3, "k"))


@dataclass(frozen=True)
class Measure:
    """Metric on an axis.

    ``scale`` converts to ``unit``, that of the axis; ``share``: means lie in 0..1; ``signed``: values may be negative.
    """

    metric: Metric
    unit: str
    scale: float
    share: bool
    signed: bool = False

    @property
    def name(self) -> str:
        """Name in captions."""
        return words.within(self.metric.label)

    @property
    def label(self) -> str:
        """Label of the axis."""
        return words.axis(self.metric.label, self.unit)

    @property
    def is_rate(self) -> bool:
        """True for the success rate, whose intervals are Wilson's."""
        return self.metric.name == RATE and not self.signed

    @staticmethod
    def is_off_scale(row: Comparison) -> bool:
        """True if fewer than half of the runs reached the event: then the mean is mostly the mission duration."""
        return row.n_reached is not None and 2 * row.n_reached < row.n

    def bounds(self, row: Comparison) -> tuple[float, float]:
        """Return the interval on the axis; minimum and maximum without one."""
        low = row.least if row.ci95_low is None else row.ci95_low
        high = row.largest if row.ci95_high is None else row.ci95_high
        return low * self.scale, high * self.scale


def measure(metric: Metric, rows: Sequence[Comparison]) -> Measure:
    """Return the metric on an axis scaled for these rows."""
    means = [row.mean for row in rows]
    largest = max(map(abs, means), default=0.0)
    prefix = next(((1.0 / size, sign) for size, sign in PREFIXES if largest >= size), (1.0, ""))
    scale, sign = prefix if metric.unit in PREFIXED else (1.0, "")
    share = metric.unit in ("", "1") and all(0.0 <= mean <= 1.0 for mean in means)
    return Measure(metric, sign + metric.unit, scale, share)


def of_differences(own: Measure, rows: Sequence[Comparison]) -> tuple[Measure, list[Comparison]]:
    """Return differences to the baseline as a measure, and the rows that have one, with it in place of means."""
    short = words.short_names(name for row in rows for name in (row.baseline, row.strategy, row.policy))
    to = f"\ndifference to {short[rows[0].baseline]}" if rows else ""
    metric = replace(own.metric, label=f"{own.metric.label},{to}")
    differences = [
        replace(
            row, mean=row.diff_to_baseline, least=row.diff_to_baseline, largest=row.diff_to_baseline,
            ci95_low=row.diff_ci95_low, ci95_high=row.diff_ci95_high,
            n=row.n_pairs, n_reached=row.n_pairs_reached,
        )
        for row in rows
        if row.diff_to_baseline is not None
    ]  # fmt: skip
    return replace(own, metric=metric, share=False, signed=True), differences


def figure_kind(metric: Metric) -> str:
    """Return the figure kind of a metric: its label with hyphens, such as ``dives-per-vehicle``."""
    return re.sub(r"[^a-z0-9]+", "-", metric.label.lower()).strip("-")


def by_kind(metrics: Sequence[Metric]) -> Mapping[str, Metric]:
    """Return metrics by figure kind; DrawingError if two share a kind, or one has that of another figure."""
    charts: dict[str, Metric] = {}
    for metric in metrics:
        kind = figure_kind(metric)
        if kind in SWEEP_KINDS or kind in charts:
            other = f"metric {charts[kind].name}" if kind in charts else f"figure {kind}"
            raise DrawingError(
                f"metric {metric.name}: its label {metric.label!r} is also that of the {other}; give it another label"
            )
        charts[kind] = metric
    return charts


PER, UNFORESEEN = "per", "unforeseen"
ACOUSTIC = "acoustic"  # channel with an estimated packet error rate, which no study sets
LEAST_CASES = 3  # minimum number of values of a textual setting on the axis
STRATEGIES = (
    "remoras", "fixed-partition", "central", "contract-net", "status-broadcast", "cbba", "rendezvous-sync",
)  # fmt: skip
POLICIES = ("ack", "m-ack", "mps-ack", "holdings", "adaptive")
"""Names with fixed look and legend position; a policy may end in ``-repeat``."""
WORDS = {
    UNFORESEEN: "unforeseen events",
    "fleet.size": "number of vehicles",
    "channel.p_bad_to_good": "probability per slot of leaving the bad state",
    "channel.p_good_to_bad": "probability per slot of entering the bad state",
    "communication.range_m": "range of the modems (m)",
    "communication.modem": "modem",
}
FAR_APART = 10.0  # minimum ratio of the last to the first axis value for even spacing

Row = TypeVar("Row", bound=Comparison | Rank)


class PanelSettings(NamedTuple):
    """Configuration without strategy, policy and axis value."""

    scenario: str
    channel: str
    settings: tuple[tuple[str, str], ...]
    unforeseen: str


class Series(NamedTuple):
    """One line of a figure."""

    strategy: str
    policy: str
    label: str


@dataclass(frozen=True)
class Arrangement:
    """Axis with dependent settings, series in legend order, panels with distinguishing titles."""

    axis: str
    follows: frozenset[str]
    series: tuple[Series, ...]
    titles: Mapping[PanelSettings, str]
    cases: tuple[str, ...] = ()

    def x(self, row: Comparison | Rank) -> float:
        """Return the axis value of a row; cases are numbered from 1."""
        if self.cases:
            return float(self.cases.index(_case(row, self.axis)) + 1)
        return row.per if self.axis == PER else float(row.settings[self.axis])

    @property
    def axis_label(self) -> str:
        """Label of the axis."""
        return "packet error rate" if self.axis == PER else WORDS.get(self.axis, self.axis)

    @property
    def tick_pt(self) -> float:
        """Font size of tick labels."""
        return style.TINY_PT if self.cases else style.SMALL_PT

    def tick_labels(self, xs: Collection[float], width_in: float) -> list[str]:
        """Return tick labels: numbers, or names of cases if they fit the width."""
        named = [self.cases[round(x) - 1] for x in xs] if self.cases else []
        fits = (
            len(named) * (max(style.width_in(name, self.tick_pt) for name in named) + 0.04) < width_in
            if named
            else False
        )
        return named if fits else [f"{x:g}" for x in xs]

    def is_spaced_evenly(self, rows: Iterable[Comparison | Rank]) -> bool:
        """True if a linear scale would crowd the values: they are drawn at equal distances."""
        xs = sorted({self.x(row) for row in rows})
        return len(xs) > 2 and xs[0] > 0.0 and xs[-1] > FAR_APART * xs[0]

    def of(self, combination: PanelSettings, rows: Iterable[Row]) -> list[Row]:
        """Return the rows of a combination."""
        return [row for row in rows if _combination(row, self.follows) == combination]

    def curves(self, rows: Iterable[Row]) -> dict[Series, list[Row]]:
        """Return the rows of each series that has some, sorted along the axis."""
        own: dict[tuple[str, str], list[Row]] = defaultdict(list)
        for row in rows:
            own[row.strategy, row.policy].append(row)
        return {series: sorted(own[series[:2]], key=self.x) for series in self.series if series[:2] in own}


def arranged(rows: Sequence[Comparison]) -> Arrangement:
    """Return the arrangement of a study, from the rows of all its configurations.

    Raises DrawingError if the configurations share no axis, as in a Latin hypercube of several keys.
    """
    axis = _axis(rows)
    cases = _cases(rows, axis)
    follows = frozenset({axis}) if cases else _following(rows, axis)
    combinations = list(dict.fromkeys(_combination(row, follows) for row in rows))
    places = {(_combination(row, follows), row.per if axis == PER else _case(row, axis)) for row in rows}
    if len(combinations) > 4 and len(places) <= len(combinations):
        raise DrawingError(
            f"{len(combinations)} combinations of settings, each with a single point on the axis {axis!r}: a figure "
            "needs an axis along which several points share the other settings; runs.parquet has all runs"
        )
    titles = dict(zip(combinations, _titles(combinations), strict=True))
    return Arrangement(axis, follows, _series(rows), titles, cases)


def _axis(rows: Sequence[Comparison]) -> str:
    if len({row.per for row in rows if row.channel != ACOUSTIC}) > 1:
        return PER
    n_values, n_words = {}, {}
    for key in sorted({key for row in rows for key in row.settings}):
        values = {row.settings.get(key, "") for row in rows}
        if len(values) > 1 and all(map(_is_number, values)):
            n_values[key] = len(values)
        elif len(values) >= LEAST_CASES and not any(map(_is_number, values)):
            n_words[key] = len(values)
    if not n_values and len({row.unforeseen for row in rows}) > 1:
        return UNFORESEEN
    counts = n_values or n_words
    return max(counts, key=lambda key: counts[key], default=PER)


def _cases(rows: Sequence[Comparison], axis: str) -> tuple[str, ...]:
    if axis == PER or (axis != UNFORESEEN and all(_is_number(row.settings.get(axis, "")) for row in rows)):
        return ()
    cases = dict.fromkeys(_case(row, axis) for row in rows)
    return tuple(cases if axis == UNFORESEEN else sorted(cases))


def _case(row: Comparison | Rank, axis: str) -> str:
    return row.unforeseen if axis == UNFORESEEN else row.settings.get(axis, "")


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _following(rows: Sequence[Comparison], axis: str) -> frozenset[str]:
    """Return the axis and the settings monotonic in it, with one value per axis value."""
    values: dict[str, dict[float, set[str]]] = defaultdict(lambda: defaultdict(set))
    for row in rows:
        if axis == PER or axis in row.settings:
            for key, value in row.settings.items():
                values[key][row.per if axis == PER else float(row.settings[axis])].add(value)
    follows = {axis}
    for key, by_place in values.items():
        in_order = [text for place in sorted(by_place) for text in by_place[place]]
        if 1 < len(in_order) == len(by_place) and all(map(_is_number, in_order)):
            numbers = [float(text) for text in in_order]
            if sorted(numbers) in (numbers, numbers[::-1]):
                follows.add(key)
    return frozenset(follows)


def _combination(row: Comparison | Rank, left_out: Collection[str]) -> PanelSettings:
    settings = tuple(pair for pair in row.settings.items() if pair[0] not in left_out)
    return PanelSettings(row.scenario, row.channel, settings, "" if UNFORESEEN in left_out else row.unforeseen)


def _series(rows: Sequence[Comparison]) -> tuple[Series, ...]:
    strategies = words.short_names(row.strategy for row in rows)
    policies = words.short_names(row.policy for row in rows)

    def label(strategy: str, policy: str) -> str:
        name = f"{strategies[strategy]} (bound)" if is_bound(strategy) else strategies[strategy]
        if len(policies) == 1:
            return name
        return policies[policy] if len(strategies) == 1 else f"{name}, {policies[policy]}"

    pairs = {(row.strategy, row.policy) for row in rows}
    ordered = sorted(pairs, key=lambda pair: (_place(pair[0], STRATEGIES), policy_place(pair[1])))
    return tuple(Series(strategy, policy, label(strategy, policy)) for strategy, policy in ordered)


def _place(name: str, known: Sequence[str]) -> tuple[int, str]:
    return (known.index(name) if name in known else len(known)), name


def policy_place(policy: str) -> tuple[int, str]:
    """Sort key of policies in legends: each policy, then its variant with repeats."""
    number, _ = _place(policy.removesuffix(REPEAT), POLICIES)
    return number, policy


def _titles(combinations: Sequence[PanelSettings]) -> list[str]:
    keys = dict.fromkeys(key for combination in combinations for key, _ in combination.settings)
    parts = [
        [
            combination.unforeseen,
            combination.scenario,
            combination.channel,
            *(dict(combination.settings).get(key, "") for key in keys),
        ]
        for combination in combinations
    ]
    last = {key: key.rpartition(".")[2] for key in keys}  # a whole key rarely fits above a panel
    short = {key: name if list(last.values()).count(name) == 1 else key for key, name in last.items()}
    names = ["", "", "", *(f"{WORDS.get(key, short[key])} = " for key in keys)]
    varied = [i for i in range(len(names)) if len({own[i] for own in parts}) > 1]
    unset = ", ".join(names[i].removesuffix(" = ") for i in varied) + " not set"
    return [", ".join(names[i] + own[i] for i in varied if own[i]) or (unset if varied else "") for own in parts]
