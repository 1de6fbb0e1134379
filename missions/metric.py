"""Metric: value that characterises a run, declared with the function that computes it.

Summaries, study metrics, rankings, axes and captions follow from it. New metrics apply to existing results.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

from missions.errors import ConfigurationError, ConfigurationFault, OutputError, takes

if TYPE_CHECKING:
    from collections import Counter

    from missions.scenarios.scenario import Scenario
    from remoras.database import AUVDatabase
    from remoras.fleet.final_exchange import Settled
    from remoras.mission import Milestone, Mission
    from remoras.organisation.needs import Subjects
    from remoras.recorder import Content
    from remoras.social.agreement import Agreement
    from remoras.strategy import Strategy
    from worldmodel import TBox


TAKEN = frozenset({
    "scenario", "strategy", "policy", "channel", "per", "seed", "n_vehicles", "reason", "milestones", "drawn", "run_id",
    "key", "repeat", "unforeseen", "status", "error", "replay", "wall_s", "cpu_s", "host", "worker", "finished_at",
})  # fmt: skip
"""Fields of summaries and columns of the table of runs that are not metrics."""


class Better(Enum):
    """Whether higher or lower values of a metric are better.

    >>> Better("lower") is Better.LOWER
    True
    """

    HIGHER = "higher"
    LOWER = "lower"
    NEITHER = "neither"


class Absent(Enum):
    """Value of a metric without meaning in a run; the summary omits its field."""

    NOT_APPLICABLE = "not applicable"


NOT_APPLICABLE = Absent.NOT_APPLICABLE
"""The metric does not apply to this run."""


class MeasuredTables(Protocol):
    """Tables of a finished run."""

    @property
    def bits(self) -> Counter[Content]:
        """Bits sent by the fleet, by content."""

    def rows(self, table: str) -> Sequence[tuple[Any, ...]]:
        """Rows as tuples in column and time order, then vehicle order; empty for a missing table."""


class AgreedBefore(Protocol):
    """Configuration before the mission."""

    @property
    def strategy(self) -> Strategy:
        """Organisational strategy with parameters."""

    @property
    def database(self) -> AUVDatabase:
        """Vehicles as known to the fleet."""

    @property
    def agreement(self) -> Agreement:
        """Groups, roles and their initial holders."""

    @property
    def tbox(self) -> TBox:
        """Ontology."""

    @property
    def subjects(self) -> Subjects | None:
        """Recipients of facts if needs follow from groups; None if all vehicles need the same."""


class MeasuredRun(Protocol):
    """Data of a finished run for metrics, in memory, in its folder or in a sweep."""

    @property
    def scenario(self) -> Scenario:
        """The whole input."""

    @property
    def mission(self) -> Mission:
        """Mission; ``mission.world(run.seed)`` is the world of its sensors."""

    @property
    def seed(self) -> int:
        """Root of all draws."""

    @property
    def recorder(self) -> MeasuredTables:
        """Tables: ``run.recorder.rows("trajectories")``."""

    @property
    def milestones(self) -> Sequence[Milestone]:
        """Milestones in time order."""

    @property
    def completed(self) -> bool:
        """True if the mission completed."""

    @property
    def reason(self) -> str:
        """Reason of failure; empty if completed."""

    @property
    def end_s(self) -> float:
        """Mission time (s); the whole duration if not completed."""

    @property
    def ended_s(self) -> float:
        """Time (s) at which the run ended, even if early without success."""

    @property
    def goal_fraction(self) -> float:
        """Share of the goal truly achieved, 0..1."""

    @property
    def reachable_fraction(self) -> float:
        """Share achieved or achievable by the vehicles remaining at the end, 0..1."""

    @property
    def distance_m(self) -> float:
        """Distance travelled by the fleet (m)."""

    @property
    def n_false_beliefs(self) -> int:
        """Number of false beliefs that a peer stores a block."""

    @property
    def wrong_belief_fraction(self) -> float | None:
        """Share of wrong beliefs about the executor of a job, 0..1; None without beliefs."""

    @property
    def settled(self) -> Settled | None:
        """Result of the exchange after the mission; None without one."""

    @property
    def setup(self) -> AgreedBefore:
        """Configuration before the mission."""


@dataclass(frozen=True)
class Metric:
    """A field of the summary that can be compared between runs.

    Args:
        name: of the field, with its unit as suffix.
        label: for axes and captions, without the unit; hyphenated also the name of its chart.
        of: value in a finished run; None if the run has none, NOT_APPLICABLE if it cannot.
        headline: True if studies compare it by default.
        note: additional sentence of captions.
        censored: True for the time (s) to an event; a run without it counts with the mission's duration.

    >>> Metric("n_looks", "", Better.LOWER, "looks", lambda run: len(run.recorder.rows("looks"))).label
    'looks'
    """

    name: str
    unit: str
    better: Better
    label: str
    of: Callable[[MeasuredRun], float | int | bool | Absent | None]
    headline: bool = False
    note: str = ""
    censored: bool = False

    @property
    def sign(self) -> float:
        """Factor by which lower values are better: -1 if higher ones are, else 1."""
        return -1.0 if self.better is Better.HIGHER else 1.0

    def written(self) -> dict[str, Any]:
        """Return the declaration, without its function, for JSON."""
        return {name: value for name, value in vars(self).items() if name != "of"} | {"better": self.better.value}

    @classmethod
    def read(cls, entry: Mapping[str, Any]) -> Metric:
        """Read a declaration from JSON; raise OutputError if incomplete or without valid direction."""
        try:
            better = Better(entry["better"])
            name, unit, label = (str(entry[key]) for key in ("name", "unit", "label"))
            headline, censored = bool(entry.get("headline")), bool(entry.get("censored"))
            return cls(name, unit, better, label, _not_stored, headline, str(entry.get("note", "")), censored)
        except (KeyError, TypeError, ValueError):
            allowed = ", ".join(better.value for better in Better)
            raise OutputError(
                f"not the declaration of a metric: {json.dumps(entry)}; "
                f"it needs name, unit, label, and better: {allowed}"
            ) from None


def _not_stored(run: MeasuredRun) -> None:
    raise NotImplementedError("a stored declaration has no function")


NAME = re.compile(r"[^\s:/]+")
"""Names of metrics: keys, columns and parts of file names."""


def faults_of_metric(declared: Any) -> Iterator[str]:
    """Yield the faults of a declared metric, in words."""
    if not isinstance(declared, Metric):
        actual = f"the class {declared.__name__}" if isinstance(declared, type) else f"a {type(declared).__name__}"
        yield f"it is {actual}; expected a remoras.Metric, such as Metric(name, unit, better, label, of)"
        return
    if not isinstance(declared.name, str) or not NAME.fullmatch(declared.name):
        yield f"name = {declared.name!r}: allowed: a word without : and /, as closest_m"
    if not isinstance(declared.unit, str):
        yield f"unit = {declared.unit!r}: allowed: a text, empty for a number without one"
    if not isinstance(declared.better, Better):
        text = "" if declared.better is None else f" = {declared.better!r}"
        yield f"better{text}: allowed: {', '.join(str(better) for better in Better)}"
    if not isinstance(declared.label, str) or not declared.label.strip():
        yield f"label = {declared.label!r}: allowed: a text, which axes and captions show"
    if not isinstance(declared.note, str):
        yield f"note = {declared.note!r}: allowed: a text, which captions add"
    if not callable(declared.of):
        yield f"of = {declared.of!r}: allowed: a function of a finished run"
    elif not takes(declared.of, 1):
        yield "of: cannot be called as of(run); allowed: a function of a finished run"
    if declared.censored and declared.unit != "s":
        allowed = "a censored metric is a time in s, since a run without it counts with its duration"
        yield f"unit = {declared.unit!r}: {allowed}"


def _alike(label: str, other: str) -> bool:
    return re.sub(r"[^a-z0-9]+", "", str(label).lower()) == re.sub(r"[^a-z0-9]+", "", str(other).lower())


def collected(source: str, metrics: Iterable[Metric]) -> dict[str, Metric]:
    """Return metrics by name; ConfigurationError for a fault, a taken name, or a repeated name or label."""
    by_name: dict[str, Metric] = {}
    faults: list[ConfigurationFault] = []
    for metric in metrics:
        faults += [ConfigurationFault(f"metric {metric.name}", "", fault) for fault in faults_of_metric(metric)]
        if metric.name in TAKEN:
            allowed = "a field that results have already; give the metric another name"
            faults.append(ConfigurationFault(f"metric {metric.name}", "", allowed))
        if metric.name in by_name:
            allowed = "declared twice; give one of the two metrics another name"
            faults.append(ConfigurationFault(f"metric {metric.name}", "", allowed))
        # Charts take their file name from the label, without case and punctuation.
        namesake = next((other for other in by_name.values() if _alike(other.label, metric.label)), None)
        if namesake is not None and namesake.name != metric.name:
            allowed = f"is also the label of {namesake.name}, and charts go by it; give one of the two another label"
            faults.append(ConfigurationFault(f"metric {metric.name}, label", repr(metric.label), allowed))
        by_name[metric.name] = metric
    if faults:
        raise ConfigurationError(source, faults)
    return by_name
