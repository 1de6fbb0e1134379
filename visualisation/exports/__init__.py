"""Export formats by name. Libraries load on use; output is written under a draft name, then renamed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from missions.disk import check_folder, drafted
from missions.figure import Place
from visualisation.exports.voyage import ALL, Selection, Voyage
from visualisation.output import ExportError, unknown

if TYPE_CHECKING:
    from missions.runs.results import MemoryResults, Results

__all__ = ["FORMATS", "Exported", "Selection", "export", "export_path"]
Counts = Mapping[str, int]  # number of messages, rows or features by topic, table or kind


Writer = Callable[[Voyage, Path], Counts]
"""Function ``write`` of a format module: write a run to a path that does not exist yet, return the counts.

It raises ExportError if the format cannot represent the run, OSError if output failed.
"""


class FormatOfExport(NamedTuple):
    """Export format; ``ending`` is empty for a folder, ``of_knowledge`` marks RDF of vehicles' knowledge, not runs."""

    ending: str
    libraries: tuple[str, ...] = ()
    needs_datum: bool = False
    of_knowledge: bool = False


FORMATS: Mapping[str, FormatOfExport] = {
    "mcap": FormatOfExport(".mcap", ("mcap", "rosbags")),
    "geojson": FormatOfExport(".geojson", needs_datum=True),
    "netcdf": FormatOfExport(".nc", ("netCDF4",), needs_datum=True),
    "csv": FormatOfExport(""),
    **{name: FormatOfExport(f".{name}", of_knowledge=True) for name in ("ttl", "trig", "jsonld", "nt")},
}
"""All formats, each with a module of its name; those of knowledge share the module ``rdf``."""
STEM = "run"  # default output name without suffix


class Exported(NamedTuple):
    """File or folder written, and its counts."""

    path: Path
    counts: Counts


def export(
    results: Results | MemoryResults,
    format: str,
    out: Path,
    force: bool = False,
    places: Sequence[Place] = (),
    selection: Selection = ALL,
) -> Exported:
    """Write a run in another format; ``selection`` applies to RDF formats only.

    Raises ExportError for an unknown format, a missing library or datum, or an ``out`` (file or folder) that exists
    without ``force`` or is not writable; OutputError for a damaged table, or no such vehicle or time.
    """
    chosen = of_name(format)
    voyage = Voyage(results, tuple(places), format, selection)
    if selection != ALL and not chosen.of_knowledge:
        names = ", ".join(name for name, other in FORMATS.items() if other.of_knowledge)
        raise ExportError(f"vehicle and at: apply to exported knowledge only, in {names}, not {format}")
    _check_libraries(format, chosen)
    if chosen.needs_datum and voyage.datum is None:
        raise ExportError(
            f"{format}: has latitudes and longitudes only, and the scenario of this run does not say where its x = 0, "
            "y = 0 is; run it again with world.origin_deg, such as --set world.origin_deg=[43.35,3.75], "
            "or take mcap or csv, which have metres"
        )
    _check_place(out, format, force)
    write: Writer = import_module(f"visualisation.exports.{'rdf' if chosen.of_knowledge else format}").write
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with drafted(out) as draft:
            return Exported(out, write(voyage, draft))
    except OSError as error:
        raise ExportError(f"{out}: cannot be written: {error.strerror or error}") from None


def of_name(format: str) -> FormatOfExport:
    """Return the format of a name, or raise ExportError."""
    if format not in FORMATS:
        raise unknown("format", format, FORMATS, ExportError)
    return FORMATS[format]


def export_path(folder: Path, format: str, selection: Selection = ALL) -> Path:
    """Return the default path in a run's folder, such as ``run.mcap``, ``run-csv`` or ``knowledge-AUV01.nt``."""
    chosen, stem = of_name(format), STEM
    if chosen.of_knowledge:
        stem = "knowledge" + (f"-{selection.vehicle}" if selection.vehicle else "")
    return folder / (f"{stem}{chosen.ending}" if chosen.ending else f"{stem}-{format}")


def _check_libraries(name: str, chosen: FormatOfExport) -> None:
    missing = [library for library in chosen.libraries if find_spec(library) is None]
    if missing:
        raise ExportError(
            f"{name}: needs {' and '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed; "
            f"install with: python -m pip install {' '.join(missing)}"
        )


def _check_place(out: Path, format: str, force: bool) -> None:
    ending = FORMATS[format].ending
    if not ending:
        check_folder(out)
    if not out.exists():
        return
    if ending and out.is_dir():
        raise ExportError(f"{out}: is a folder; name a file, such as {out / (STEM + ending)}")
    if out.is_dir():
        inside = list(out.iterdir())
        # Replacing an export deletes the folder, which therefore must hold nothing else.
        strange = [path.name for path in inside if path.suffix != f".{format}"]
        if strange:
            raise ExportError(f"{out}: holds other files, such as {strange[0]}; name another folder")
        if not inside:
            return
    if not force:
        raise ExportError(f"{out}: exists; name another with --out or add --force")
