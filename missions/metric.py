"""Metric: a figure that says how a run went, declared once beside the function that computes it.

The summary of a run, the metrics that a study may name, the direction of a ranking, axes and captions follow from the
declaration. What its function may read is a ``MeasuredRun``: a run that has just ended and one that was written answer
alike, so a metric can be had of results that exist.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from missions.errors import ConfigurationError, ConfigurationFault, OutputError, takes

if TYPE_CHECKING:
    from collections import Counter

    from missions.scenarios.scenario import Scenario
    from remoras.contents import Content
    from remoras.database import AUVDatabase
    from remoras.mission import Milestone, Mission
    from remoras.settling import Settled
    from remoras.social.agreement import Agreement
    from remoras.social.needs import Subjects
    from remoras.strategy import Strategy
    from worldmodel import TBox


TAKEN = frozenset({
    "scenario", "strategy", "policy", "channel", "per", "seed", "n_vehicles", "reason", "milestones", "drawn", "run_id",
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


class MeasuredTables(Protocol):
    """The tables of a run that has ended."""

    @property
    def bits(self) -> Counter[Content]:
        """Bits sent by the whole fleet, by what they are for."""

    def rows(self, table: str) -> Sequence[tuple[Any, ...]]:
        """Rows of a table as tuples, in the order of its columns and in time order; none of a table that is not there.

        Rows of one time stand in the order of the vehicles in the scenario. Units are those of the table's columns.
        """


class AgreedBefore(Protocol):
    """What was settled before the mission began."""

    @property
    def strategy(self) -> Strategy:
        """The organisational strategy, with its parameters."""

    @property
    def database(self) -> AUVDatabase:
        """Vehicles as the fleet knows them."""

    @property
    def agreement(self) -> Agreement:
        """Groups, roles and who founds them."""

    @property
    def tbox(self) -> TBox:
        """The ontology: what could be said."""

    @property
    def subjects(self) -> Subjects | None:
        """What vehicles are told of where needs follow from groups; None where all need the same."""


class MeasuredRun(Protocol):
    """What a metric may read of a run that has ended, be it in memory, in its folder or among the tables of a sweep."""

    @property
    def scenario(self) -> Scenario:
        """The whole input."""

    @property
    def mission(self) -> Mission:
        """The mission of the scenario; ``mission.world(run.seed)`` is what its sensors perceived."""

    @property
    def seed(self) -> int:
        """Root of all draws."""

    @property
    def recorder(self) -> MeasuredTables:
        """The tables: ``run.recorder.rows("trajectories")``."""

    @property
    def milestones(self) -> Sequence[Milestone]:
        """What happened when, in time order."""

    @property
    def completed(self) -> bool:
        """True if the mission is complete."""

    @property
    def reason(self) -> str:
        """Why it is not complete; empty if it is."""

    @property
    def end_s(self) -> float:
        """Mission time (s); the whole duration where the mission is not complete."""

    @property
    def goal_fraction(self) -> float:
        """Share of the mission's whole goal that was reached on the ground, 0..1."""

    @property
    def reachable_fraction(self) -> float:
        """Share that was reached, or was within reach of the vehicles left at the end, 0..1."""

    @property
    def distance_m(self) -> float:
        """Distance travelled by the whole fleet (m)."""

    @property
    def n_false_beliefs(self) -> int:
        """How often a vehicle came to believe that a peer held what that peer lacked."""

    @property
    def wrong_belief_fraction(self) -> float | None:
        """Share of the beliefs of who does a job that were wrong, 0..1; None if there were none."""

    @property
    def settled(self) -> Settled | None:
        """How the exchange after the mission ended; None where there was none."""

    @property
    def setup(self) -> AgreedBefore:
        """What was settled before the mission began."""


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
    of: Callable[[MeasuredRun], float | int | bool | Absent | None]
    headline: bool = False
    note: str = ""
    censored: bool = False


@dataclass(frozen=True)
class MetricRecord:
    """The declaration of a metric as results keep it, without its function.

    Args:
        name: field of the summary.
        unit: unit, empty without one.
        better: direction of a ranking.
        label: what axes and captions call it, without the unit.
        headline: True if it is compared where no metrics are named.
        note: sentence that captions add.
        censored: True for the time to an event that a run may not reach.
    """

    name: str
    unit: str
    better: Better
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
        return {**vars(self), "better": self.better.value}

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


WHOLE = "it"
"""What faults call a declaration as a whole."""


class PartFault(NamedTuple):
    """What is wrong with a part of a declaration: which part, what was given, what is allowed."""

    part: str
    given: str
    allowed: str

    @property
    def text(self) -> str:
        """The fault in words."""
        if self.part == WHOLE:
            return f"{self.part} {self.allowed}"
        return f"{self.part} = {self.given}: {self.allowed}" if self.given else f"{self.part}: {self.allowed}"


NAME = re.compile(r"[^\s:/]+")
"""Names of metrics: they are keys, columns of tables and parts of names of files."""


def faults_of_metric(found: Any) -> Iterator[PartFault]:
    """What is wrong with a metric as it is declared, before it is asked of any run.

    Args:
        found: what should be a ``Metric``.
    """
    if not isinstance(found, Metric):
        what = f"the class {found.__name__}" if isinstance(found, type) else f"a {type(found).__name__}"
        yield PartFault(
            WHOLE, "", f"is {what}; expected a remoras.Metric, such as Metric(name, unit, better, label, of)"
        )
        return
    if not isinstance(found.name, str) or not NAME.fullmatch(found.name):
        yield PartFault("name", repr(found.name), "allowed: a word without : and /, as closest_m")
    if not isinstance(found.unit, str):
        yield PartFault("unit", repr(found.unit), "allowed: a text, empty for a number without one")
    if not isinstance(found.better, Better):
        given = "" if found.better is None else repr(found.better)
        yield PartFault("better", given, f"allowed: {', '.join(str(better) for better in Better)}")
    if not isinstance(found.label, str) or not found.label.strip():
        yield PartFault("label", repr(found.label), "allowed: a text, which axes and captions show")
    if not isinstance(found.note, str):
        yield PartFault("note", repr(found.note), "allowed: a text, which captions add")
    if not callable(found.of):
        yield PartFault("of", repr(found.of), "allowed: a function of a finished run")
    elif not takes(found.of, 1):
        yield PartFault("of", "", "cannot be called as of(run); allowed: a function of a finished run")
    if found.censored and found.unit != "s":
        allowed = "a censored metric is a time in s, since a run without it counts with its duration"
        yield PartFault("unit", repr(found.unit), allowed)


def _alike(one: str, other: str) -> bool:
    """True for labels that differ in case and signs alone: their charts would have one name."""
    return re.sub(r"[^a-z0-9]+", "", str(one).lower()) == re.sub(r"[^a-z0-9]+", "", str(other).lower())


def collected(source: str, metrics: Iterable[Metric]) -> dict[str, Metric]:
    """Metrics by name, in their order.

    Args:
        source: who declares them, for messages.
        metrics: those of every run, then those of the mission.

    Raises:
        ConfigurationError: a part of a metric is none, its name is that of another field, or two have one name
            or one label.
    """
    found: dict[str, Metric] = {}
    faults: list[ConfigurationFault] = []
    for metric in metrics:
        wrong = faults_of_metric(metric)
        faults += [
            ConfigurationFault(f"metric {metric.name}, {fault.part}", fault.given, fault.allowed) for fault in wrong
        ]
        if metric.name in TAKEN:
            allowed = "a field that results have already; give the metric another name"
            faults.append(ConfigurationFault(f"metric {metric.name}", "", allowed))
        if metric.name in found:
            allowed = "declared twice; give one of the two metrics another name"
            faults.append(ConfigurationFault(f"metric {metric.name}", "", allowed))
        namesake = next((other for other in found.values() if _alike(other.label, metric.label)), None)
        if namesake is not None and namesake.name != metric.name:
            allowed = f"is also the label of {namesake.name}, and charts go by it; give one of the two another label"
            faults.append(ConfigurationFault(f"metric {metric.name}, label", repr(metric.label), allowed))
        found[metric.name] = metric
    if faults:
        raise ConfigurationError(source, faults)
    return found
