"""The command that hands a run to the tools of others: export."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from remoras.cli.app import Json, command, fail, show_json


class ExportFormat(StrEnum):
    """Formats of exports."""

    MCAP = "mcap"
    ROSBAG2 = "rosbag2"
    GEOJSON = "geojson"
    KML = "kml"
    NETCDF = "netcdf"
    CSV = "csv"
    ALOG = "alog"
    TRACE = "trace"


FORMAT_HELP = (
    "mcap for Foxglove, rosbag2 for ROS 2, geojson for QGIS and Neptus, kml for Google Earth, "
    "netcdf with CF conventions, csv for anything, alog for alogview of MOOS-IvP, "
    "trace for the channel trace of later runs."
)


@command("export", "remoras export results/lossy --format mcap")
def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run.")],
    file_format: Annotated[ExportFormat, typer.Option("--format", metavar="FORMAT", help=FORMAT_HELP)],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File or folder to write; in DIR if left out.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier export.")] = False,
    as_json: Json = False,
) -> None:
    """Write a run for another tool: Foxglove, ROS 2, QGIS, Google Earth, MOOS-IvP, or as netCDF, CSV or trace."""
    from missions.errors import ConfigurationError
    from missions.runs.results import Results
    from missions.scenarios.parts import mission_of
    from visualisation.exports import default_path
    from visualisation.exports import export as write

    if (folder / "study.json").is_file():
        fail(f"{folder}: holds a sweep, and export takes the results of one run; make one with: remoras run --out DIR")
    results = Results.read(folder)
    path = out or default_path(folder, file_format.value)
    try:
        places = mission_of(results.scenario).places
    except ConfigurationError as error:
        print(f"remoras: places are left out: {error}", file=sys.stderr)
        places = ()
    made = write(results, file_format.value, path, force, places)
    if as_json:
        show_json({"path": str(made.path), "format": file_format.value, "counts": dict(made.counts)})
        return
    print(made.path)
    for name, count in made.counts.items():
        print(f"  {count:>8}  {name}")
