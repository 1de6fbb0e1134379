"""Reader of one run: in memory, in progress, or in a folder.

Tables are quantised to the step of their units, so a run gives the same values to metrics, figures, replay and queries
from every source.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from functools import cached_property, partial
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from missions.disk import MANIFEST
from missions.errors import ConfigurationError, OutputError
from missions.figure import RunResults
from missions.files import tables_of
from missions.metric import NOT_APPLICABLE, Absent, MeasuredRun, Metric
from missions.scenarios.parts import mission_of
from remoras.mission import Milestone, Mission
from remoras.plugins import answer
from remoras.recorder import TIME, Content
from worldmodel import Knowledge, suggestion

if TYPE_CHECKING:
    from missions.runs.knowledge_at import KnownAt, Memory
    from missions.runs.setup import Setup
    from remoras.fleet.final_exchange import Settled


class RunReader(RunResults, MeasuredRun, ABC):
    """Run whose figures and metrics are read from its summary, manifest, scenario and tables."""

    @abstractmethod
    def _read(self, name: str) -> pa.Table:
        """Return an existing table."""

    def has(self, name: str) -> bool:
        """True if the table exists; each mission and feature adds its own."""
        return name in self.tables

    def table(self, name: str) -> pa.Table:
        """Return an Arrow table; raise OutputError if it is missing or damaged."""
        if not self.has(name):
            raise OutputError(f"no table {name!r}; there are {', '.join(self.tables)}{suggestion(name, self.tables)}")
        return self._read(name)

    def rows(self, name: str) -> list[dict[str, Any]]:
        """Return the rows of a table by column; none if it does not exist."""
        rows: list[dict[str, Any]] = self.table(name).to_pylist() if self.has(name) else []
        return rows

    def units(self, name: str) -> dict[str, str]:
        """Return the units of a table's columns that have one."""
        return {field.name: field.metadata[b"unit"].decode() for field in self.table(name).schema if field.metadata}

    @cached_property  # 10 ms to parse, asked by each part of a figure
    def scenario_tables(self) -> dict[str, Any]:
        """Resolved scenario as TOML tables, readable by other versions; may raise OutputError."""
        try:
            return tables_of(self.manifest["scenario"], MANIFEST)
        except (TypeError, ConfigurationError) as error:
            raise OutputError(f"{self}: the scenario in its manifest is damaged: {error}") from None

    # Input of metrics ----------------------------------------------------------------------------

    @cached_property  # it keeps the rows that metrics share
    def recorder(self) -> KeptTables:
        """Tables as rows in time order."""
        return KeptTables(self)

    @cached_property  # reads the ontology
    def setup(self) -> Setup:
        """Setup before the mission."""
        from missions.runs.setup import resolved  # lazy: avoids an import cycle with the metrics of scenarios

        return resolved(self.scenario)

    @property
    def mission(self) -> Mission:
        return mission_of(self.scenario)

    @property
    def milestones(self) -> tuple[Milestone, ...]:
        return tuple(Milestone(**row) for row in self.summary["milestones"])

    @property
    def seed(self) -> int:
        return int(self.summary["seed"])

    @property
    def completed(self) -> bool:
        return bool(self.summary["completed"])

    @property
    def reason(self) -> str:
        return str(self.summary["reason"])

    @property
    def end_s(self) -> float:
        return float(self.summary["mission_time_s"])

    @property
    def ended_s(self) -> float:
        is_exact = self.summary.get("completed") or self.summary.get("is_underway") or not self.has("trajectories")
        # The mission time of a failed run is its time limit.
        last_s = [] if is_exact else self.table("trajectories")["time_s"][-1:].to_pylist()
        return float(last_s[0] if last_s else self.summary.get("mission_time_s") or 0.0)

    @property
    def goal_fraction(self) -> float:
        return float(self.summary["goal_fraction"])

    @property
    def reachable_fraction(self) -> float:
        return float(self.summary["reachable_fraction"])

    @property
    def distance_m(self) -> float:
        return float(self.summary["distance_m"])

    @property
    def n_false_beliefs(self) -> int:
        return int(self.summary["false_beliefs"])

    @property
    def wrong_belief_fraction(self) -> float | None:
        fraction = self.summary["wrong_belief_fraction"]
        return None if fraction is None else float(fraction)

    @property
    def settled(self) -> Settled | None:
        if "settling_s" not in self.summary:
            return None
        from remoras.fleet.final_exchange import Settled  # slow: loads the fleet

        return Settled(float(self.summary["settling_s"]), bool(self.summary["settled"]))

    # Knowledge of vehicles -----------------------------------------------------------------------

    @cached_property  # all blocks of the run
    def _memory(self) -> Memory:
        from missions.runs.knowledge_at import Memory  # slow: loads the simulation

        return Memory(self, self.setup)

    def known(self, vehicle: str, at_s: float) -> KnownAt:
        """Return a vehicle's knowledge at a time; raise OutputError for unknown ones."""
        return self._memory.known(vehicle, at_s)

    def knowledge(self, vehicle: str | None = None, at_s: float | None = None) -> dict[str, Knowledge]:
        """Return the knowledge of one vehicle, or of all if None, by name; ``at_s`` None is the end of the run.

        Raises OutputError for an unknown vehicle, time or table.
        """
        moment = self.ended_s + (self.summary.get("settling_s") or 0.0) if at_s is None else at_s
        names = [table.name for table in self.scenario.vehicle] if vehicle is None else [vehicle]
        known = (self.known(name, moment) for name in names)
        return {state.vehicle: Knowledge(state.model, state.receptions) for state in known}

    def query(
        self, sparql: str, vehicle: str | None = None, at_s: float | None = None, most_rows: int | None = None
    ) -> tuple[Sequence[str], list[tuple[Any, ...]]]:
        """Run a SPARQL query (SELECT or ASK) on vehicles' knowledge; return columns and rows.

        If ``vehicle`` is None, all are queried in turn, and the first column names the vehicle. ``at_s`` is the end of
        the run if None. Raises OutputError for an unknown vehicle, time or table, QueryError for an invalid query.
        """
        from worldmodel.rdf.sparql import query as ask  # slow: loads the graph library

        known = self.knowledge(vehicle, at_s)
        return ask(known if vehicle is None else known[vehicle], sparql, most_rows)


class KeptTables:
    """Tables of a run as tuples in time order; ``bits`` counts sent bits by purpose."""

    def __init__(self, reader: RunReader) -> None:
        self.bits = Counter({content: int(reader.summary[f"bits_{content.value}"]) for content in Content})
        self._reader = reader
        self._rows: dict[str, list[tuple[Any, ...]]] = {}  # several metrics read one table

    def rows(self, table: str) -> list[tuple[Any, ...]]:
        """Return the rows of a table in time order; none if it does not exist."""
        if table not in self._rows:
            self._rows[table] = _in_time_order(self._reader.table(table)) if self._reader.has(table) else []
        return self._rows[table]


def _in_time_order(table: pa.Table) -> list[tuple[Any, ...]]:
    names = table.column_names
    rows = list(zip(*(table[name].to_pylist() for name in names), strict=True))
    if TIME.name in names:  # trajectories are stored by vehicle
        rows.sort(key=itemgetter(names.index(TIME.name)))
    return rows


def value_of(metric: Metric, run: MeasuredRun, of: str) -> float | int | bool | Absent | None:
    """Return the value of a metric declared by ``of``; PluginError if it raises or gives no finite value or None."""
    where = f"metric {metric.name} of {of}" if of else f"metric {metric.name}"
    expected = "a finite number, a truth value, or None where a run has none"
    return answer(where, "its function", expected, _is_value, partial(metric.of, run))


def _is_value(value: Any) -> bool:
    return value in (None, NOT_APPLICABLE) or (isinstance(value, float | int) and math.isfinite(value))
