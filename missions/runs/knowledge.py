"""What the vehicles of a recorded run knew: written as RDF, and asked in SPARQL."""

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
    """What vehicles knew, by their names.

    Args:
        results: of the run.
        vehicle: the one to ask; all if None.
        at_s: a time of the run; its end if None.

    Raises:
        OutputError: there is no such vehicle, time or table.
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
    """Ask what vehicles knew.

    Args:
        results: of the run.
        sparql: a SELECT or ASK query.
        vehicle: the one to ask; if None, all are asked in turn, and the first column says which a row is from.
        at_s: a time of the run; its end if None.
        most_rows: at which it stops; None for all.

    Returns:
        Names of the columns, and the rows.

    Raises:
        OutputError: there is no such vehicle, time or table.
        QueryError: the query cannot be read.
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
    """Write what vehicles knew as RDF.

    Args:
        results: of the run.
        form: format of the file.
        out: the file; its folder is made if it is not there.
        force: replace a file that is there.
        vehicle: the one whose knowledge is written, each origin's as a named graph where the format has them; if None,
            what all vehicles knew, each vehicle's as a named graph where the format has them, else their union.
        at_s: a time of the run; its end if None.
        items: write the canonical graph of items, for which N-Triples is the format.

    Returns:
        The number of facts that each vehicle knew, by its name.

    Raises:
        OutputError: there is no such vehicle, time or table, the format is not that of the canonical graph, or the
            file is there or cannot be written.
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
    """The format of RDF of that name, None if it is none; then nothing may be asked that knowledge alone has.

    Args:
        format: its name.
        about: vehicle, time and items as ``write_knowledge`` has them.

    Raises:
        OutputError: something is asked that a file of this format does not have.
    """
    if format in {*RdfFormat}:
        return RdfFormat(format)
    if about != (None, None, False):
        names = ", ".join(RdfFormat)
        raise OutputError(f"vehicle, at and items: are about what vehicles knew; formats: {names}; not {format}")
    return None


def knowledge_path(folder: Path, form: RdfFormat, vehicle: str | None, items: bool) -> Path:
    """Where knowledge is written if nothing else is said: into the folder of the run.

    >>> knowledge_path(Path("r"), RdfFormat.N_TRIPLES, "AUV01", True).as_posix()
    'r/items-AUV01.nt'
    """
    return folder / f"{'items' if items else 'knowledge'}{f'-{vehicle}' if vehicle else ''}.{form.value}"
