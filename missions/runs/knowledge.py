"""Knowledge of the vehicles in a recorded run, and SPARQL queries on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from worldmodel import Knowledge
from worldmodel.rdf.sparql import query as ask

if TYPE_CHECKING:
    from missions.runs.reader import RunReader


def knowledge(results: RunReader, vehicle: str | None = None, at_s: float | None = None) -> dict[str, Knowledge]:
    """Return the knowledge of one vehicle, or of all if None, by name.

    at_s: None for the end of the run. Raises OutputError for an unknown vehicle, time or table.
    """
    summary = results.summary
    moment = summary["mission_time_s"] + (summary.get("settling_s") or 0.0) if at_s is None else at_s
    vehicles = [vehicle_table.name for vehicle_table in results.scenario.vehicle] if vehicle is None else [vehicle]
    known = (results.known(name, moment) for name in vehicles)
    return {state.vehicle: Knowledge(state.model, state.receptions) for state in known}


def query(
    results: RunReader,
    sparql: str,
    vehicle: str | None = None,
    at_s: float | None = None,
    most_rows: int | None = None,
) -> tuple[Sequence[str], list[tuple[Any, ...]]]:
    """Run a SPARQL query (SELECT or ASK) on vehicles' knowledge; return columns and rows.

    If ``vehicle`` is None, all are queried in turn, and the first column names the vehicle. ``at_s`` is the end of the
    run if None. Raises OutputError for an unknown vehicle, time or table, QueryError for an invalid query.
    """
    known = knowledge(results, vehicle, at_s)
    return ask(known if vehicle is None else known[vehicle], sparql, most_rows)
