"""A run as metrics of a user's own read it: the same of one that has just ended, of its folder, of tables of a sweep.

What they read is what results keep: numbers of the summary, and rows of tables to the step of their units. So a metric
gives the same number wherever the run is.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Protocol

import pyarrow as pa

from missions.figure import RunResults
from missions.metric import NOT_APPLICABLE, Absent, MeasuredRun, Metric
from missions.scenarios.parts import mission_of
from missions.scenarios.scenario import Scenario
from remoras.contents import Content
from remoras.errors import PluginError
from remoras.mission import Milestone, Mission
from remoras.recorder import KEY, TIME

if TYPE_CHECKING:
    from missions.runs.setup import Setup
    from remoras.settling import Settled

TableOf = Callable[[str], pa.Table | None]
"""The Arrow table of a name; None if there is none."""


class ScenarioResults(RunResults, Protocol):
    """Results of a run that know their scenario."""

    @property
    def scenario(self) -> Scenario:
        """The whole input of the run."""


class KeptTables:
    """Rows of the tables of a run as its results keep them.

    Attributes:
        bits: sent by the whole fleet, by what they are for.

    Args:
        table_of: where they are.
        summary: of the run.
    """

    def __init__(self, table_of: TableOf, summary: Mapping[str, Any]) -> None:
        self.bits = Counter({content: int(summary.get(f"bits_{content.value}") or 0) for content in Content})
        self._table_of = table_of
        self._rows: dict[str, list[tuple[Any, ...]]] = {}

    def rows(self, table: str) -> list[tuple[Any, ...]]:
        """Rows of a table in time order; none of a table that is not there."""
        if table not in self._rows:
            kept = self._table_of(table)
            self._rows[table] = [] if kept is None else _rows(kept)
        return self._rows[table]


def _rows(table: pa.Table) -> list[tuple[Any, ...]]:
    if KEY in table.column_names:
        table = table.drop_columns([KEY])
    rows = list(zip(*(column.to_pylist() for column in table.columns), strict=True))
    if TIME.name in table.column_names:  # trajectories are kept vehicle by vehicle
        rows.sort(key=itemgetter(table.column_names.index(TIME.name)))
    return rows


@dataclass(frozen=True)
class KeptRun:
    """``missions.metric.MeasuredRun`` of what results keep.

    Args:
        summary: fields of the summary that every run has.
        table_of: where its tables are.
        scenario_of: gives its scenario; asked only if a metric asks.
    """

    summary: Mapping[str, Any]
    table_of: TableOf
    scenario_of: Callable[[], Scenario]

    @classmethod
    def of(cls, results: ScenarioResults) -> KeptRun:
        """The run of its results, in memory or in a folder."""
        table_of: TableOf = lambda name: results.table(name) if results.has(name) else None  # noqa: E731
        return cls(results.summary, table_of, lambda: results.scenario)

    @cached_property
    def scenario(self) -> Scenario:
        """The whole input."""
        return self.scenario_of()

    @cached_property
    def mission(self) -> Mission:
        """The mission of the scenario."""
        return mission_of(self.scenario)

    @cached_property
    def setup(self) -> Setup:
        """What was settled before the mission began."""
        from missions.runs.setup import resolved  # which asks for the metrics of a scenario, and few metrics for it

        return resolved(self.scenario)

    @cached_property
    def recorder(self) -> KeptTables:
        """Its tables."""
        return KeptTables(self.table_of, self.summary)

    @cached_property
    def milestones(self) -> tuple[Milestone, ...]:
        """What happened when, in time order."""
        listed = self.summary["milestones"]
        return tuple(
            Milestone(milestone["time_s"], milestone["name"], milestone["vehicle"], milestone["group"])
            for milestone in listed
        )

    @property
    def seed(self) -> int:
        """Root of all draws."""
        return int(self.summary["seed"])

    @property
    def completed(self) -> bool:
        """True if the mission is complete."""
        return bool(self.summary["completed"])

    @property
    def reason(self) -> str:
        """Why it is not complete; empty if it is."""
        return str(self.summary["reason"])

    @property
    def end_s(self) -> float:
        """Mission time (s)."""
        return float(self.summary["mission_time_s"])

    @property
    def goal_fraction(self) -> float:
        """Share of the mission's whole goal that was reached, 0..1."""
        return float(self.summary["goal_fraction"])

    @property
    def reachable_fraction(self) -> float:
        """Share that was reached, or was within reach at the end, 0..1; older results have what was reached."""
        return float(self.summary.get("reachable_fraction", self.summary["goal_fraction"]))

    @property
    def distance_m(self) -> float:
        """Distance travelled by the whole fleet (m)."""
        return float(self.summary["distance_m"])

    @property
    def n_false_beliefs(self) -> int:
        """How often a vehicle came to believe that a peer held what that peer lacked."""
        return int(self.summary["false_beliefs"])

    @property
    def wrong_belief_fraction(self) -> float | None:
        """Share of the beliefs of who does a job that were wrong, 0..1; None if there were none."""
        fraction = self.summary.get("wrong_belief_fraction")
        return None if fraction is None else float(fraction)

    @property
    def settled(self) -> Settled | None:
        """How the exchange after the mission ended; None where there was none."""
        if "settling_s" not in self.summary:
            return None
        from remoras.settling import Settled  # which loads the fleet; who reads tables need not

        return Settled(float(self.summary["settling_s"]), bool(self.summary["settled"]))


def value_of(metric: Metric, run: MeasuredRun, of: str) -> float | int | bool | Absent | None:
    """The value of a metric in a run.

    Args:
        metric: a shipped one, one of a mission, or a user's own.
        run: that has ended.
        of: who declares the metric, for messages.

    Raises:
        PluginError: it raises, or gives something else than a finite number, a truth value or None.
    """
    where = f"metric {metric.name} of {of}" if of else f"metric {metric.name}"
    try:
        value = metric.of(run)
    except Exception as error:  # it may be somebody else's function
        raise PluginError(f"{where}: raised {type(error).__name__}: {error}") from error
    if value is not None and value is not NOT_APPLICABLE and not isinstance(value, float | int):
        raise PluginError(f"{where}: expected a number, a truth value or None; it gave {type(value).__name__}")
    if isinstance(value, float) and not math.isfinite(value):
        raise PluginError(f"{where}: expected a finite number, or None where a run has none; it gave {value}")
    return value
