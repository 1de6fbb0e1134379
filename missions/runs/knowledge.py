"""Knowledge of the vehicles in a recorded run: RDF export and SPARQL queries."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.disk import drafted
from missions.errors import OutputError
from worldmodel import Knowledge
from worldmodel.rdf.sparql import query as ask
from worldmodel.rdf.writing import RdfFormat, canonical_items, written

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


def write_knowledge(
    results: RunReader,
    form: RdfFormat,
    out: Path,
    force: bool = False,
    vehicle: str | None = None,
    at_s: float | None = None,
    items: bool = False,
) -> dict[str, int]:
    """Write the vehicles' knowledge as RDF; return the number of facts by vehicle.

    Named graphs are the origins for one ``vehicle``, else the vehicles; formats without graphs get the union. ``at_s``
    is the end of the run if None. ``items`` selects the canonical graph of items, in N-Triples only. Raises OutputError
    for an unknown vehicle, time or table, a wrong format, or a file that exists or cannot be written.
    """
    if items and form is not RdfFormat.N_TRIPLES:
        raise OutputError(f"--items: the canonical graph of items is written as nt, and the format is {form.value}")
    if out.is_dir():
        raise OutputError(f"{out}: is a folder; name a file, such as {out / f'known.{form.value}'}")
    if out.exists() and not force:
        raise OutputError(f"{out}: exists; name another with --out or add --force")
    known = knowledge(results, vehicle, at_s)
    text = canonical_items(knowledge_of.model for knowledge_of in known.values()) if items else written(known, form)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with drafted(out) as draft:
            draft.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise OutputError(f"{out}: cannot be written: {error.strerror or error}") from None
    return {
        name: sum(len(block.facts) for block in knowledge_of.model.blocks()) for name, knowledge_of in known.items()
    }


def form_of(format: str, about: tuple[str | None, float | None, bool]) -> RdfFormat | None:
    """Return the RDF format of this name, or None; raise OutputError if ``about`` needs RDF."""
    if format in {*RdfFormat}:
        return RdfFormat(format)
    if about != (None, None, False):
        names = ", ".join(RdfFormat)
        raise OutputError(
            f"vehicle, at and items: apply to exported knowledge only, in the formats {names}, not {format}"
        )
    return None


def knowledge_path(folder: Path, form: RdfFormat, vehicle: str | None, items: bool) -> Path:
    """Return the default path of exported knowledge, in the folder of the run.

    >>> knowledge_path(Path("r"), RdfFormat.N_TRIPLES, "AUV01", True).as_posix()
    'r/items-AUV01.nt'
    """
    return folder / f"{'items' if items else 'knowledge'}{f'-{vehicle}' if vehicle else ''}.{form.value}"
