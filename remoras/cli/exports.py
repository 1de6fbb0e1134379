"""Command ``export``."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from remoras.cli import completion
from remoras.cli.app import Json, command, fail, show_json

if TYPE_CHECKING:
    from missions.runs.results import Results
    from worldmodel.rdf.writing import RdfFormat


class ExportFormat(StrEnum):
    """Formats of exports."""

    MCAP = "mcap"
    GEOJSON = "geojson"
    NETCDF = "netcdf"
    CSV = "csv"
    TURTLE = "ttl"
    TRIG = "trig"
    JSON_LD = "jsonld"
    N_TRIPLES = "nt"


FORMAT_HELP = (
    "mcap for Foxglove and ROS 2, geojson for QGIS and Neptus, netcdf with CF conventions, csv for anything; "
    "what vehicles knew as RDF: ttl, trig, jsonld, nt."
)
Vehicle = Annotated[
    str | None,
    typer.Option(
        metavar="NAME", help="Vehicle whose knowledge is read; default: all.", autocompletion=completion.vehicle
    ),
]
At = Annotated[float | None, typer.Option(metavar="SECONDS", help="Time of the knowledge; default: end of the run.")]


@command("export", "remoras export results/lossy --format mcap")
def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run.")],
    file_format: Annotated[ExportFormat, typer.Option("--format", metavar="FORMAT", help=FORMAT_HELP)],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File or folder to write; default: a name in DIR.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier export.")] = False,
    vehicle: Vehicle = None,
    at: At = None,
    items: Annotated[
        bool, typer.Option("--items", help="With nt: the canonical graph of items, equal for equal sets of items.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Export a run to another tool: Foxglove, ROS 2, QGIS, netCDF, CSV, RDF."""
    from missions.runs.knowledge import form_of
    from missions.runs.results import Results

    if (folder / "study.json").is_file():
        fail(f"{folder}: holds a sweep, and export takes the results of one run; make one with: remoras run --out DIR")
    results, about = Results.read(folder), (vehicle, at, items)
    if (form := form_of(file_format.value, about)) is None:
        path, counts, what = _voyage(results, file_format, out, force)
    else:
        path, counts, what = _knowledge(results, form, out, force, about)
    if as_json:
        show_json({"path": str(path), "format": file_format.value, "counts": counts})
        return
    print(path)
    for name, count in counts.items():
        print(f"  {count:>8}  {what}{name}")


def _voyage(
    results: Results, file_format: ExportFormat, out: Path | None, force: bool
) -> tuple[Path, dict[str, int], str]:
    """Write the course of a run; return path, counts per kind and their label."""
    from missions.errors import ConfigurationError
    from missions.scenarios.parts import mission_of
    from visualisation.exports import export as write
    from visualisation.exports import export_path

    path = out or export_path(results.folder, file_format.value)
    try:
        places = mission_of(results.scenario).places
    except ConfigurationError as error:
        print(f"remoras: places are left out: {error}", file=sys.stderr)
        places = ()
    made = write(results, file_format.value, path, force, places)
    return made.path, dict(made.counts), ""


def _knowledge(
    results: Results, form: RdfFormat, out: Path | None, force: bool, about: tuple[str | None, float | None, bool]
) -> tuple[Path, dict[str, int], str]:
    """Write the knowledge of vehicles; return path, fact counts per vehicle and their label."""
    from missions.runs.knowledge import knowledge_path
    from missions.runs.knowledge import write_knowledge as write

    vehicle, _, items = about
    path = out or knowledge_path(results.folder, form, vehicle, items)
    return path, write(results, form, path, force, *about), "facts known to "
