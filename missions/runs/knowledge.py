"""What the vehicles of a run knew at its end: kept as a table on request, and asked in SPARQL."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from missions.errors import OutputError
from missions.scenarios.parts import mission_class
from remoras.fleet import Fleet
from remoras.recorder import Column, Table
from worldmodel import core_ontology_paths, read_tbox
from worldmodel.fields import Grid
from worldmodel.snapshot import Row, models_from, rows_of
from worldmodel.sparql import query as ask

if TYPE_CHECKING:
    from missions.runs.results import MemoryResults, Results

_UNITS = {"time_s": "s"}
_KINDS = {int: "int", float: "float", str: "str"}
FACTS = Table(
    "facts", tuple(Column(name, _KINDS[kind], _UNITS.get(name, "")) for name, kind in Row.__annotations__.items())
)
"""World models of all vehicles, a row for each fact."""


def keep(fleet: Fleet) -> None:
    """Write the world models of a fleet into the table ``facts`` of its record."""
    fleet.recorder.declare(FACTS)
    models = {vehicle.name: vehicle.beliefs.model for vehicle in fleet.vehicles}
    fleet.recorder.rows(FACTS.name).extend(rows_of(models))


def query(results: Results | MemoryResults, sparql: str) -> tuple[Sequence[str], list[tuple[Any, ...]]]:
    """Ask the world models of a run.

    Args:
        results: of a run that kept its models.
        sparql: a SELECT query; the model of each vehicle is a named graph.

    Returns:
        Names of the columns, and the rows.

    Raises:
        OutputError: the run did not keep its models.
        QueryError: the query cannot be read.
    """
    if not results.has(FACTS.name):
        raise OutputError("the run did not keep what its vehicles knew: run it again with --keep-models")
    scenario = results.scenario
    mission = mission_class(scenario.scenario.mission).from_scenario(scenario)
    tbox = read_tbox(*core_ontology_paths(), *mission.vocabulary_used)
    clock = Grid(0.0, scenario.communication.time_resolution_s)  # tables keep fewer digits than world models
    rows = (
        Row(**{**row, "time_s": clock.value_at(clock.index_of(row["time_s"]))})
        for row in results.table(FACTS.name).to_pylist()
    )
    return ask(models_from(rows, tbox), sparql)
