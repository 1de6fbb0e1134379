"""Commands about results of runs: plot, why, query, export, replay, verify."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from remoras.cli import completion
from remoras.cli.app import (
    FAILED,
    FigureFormat,
    Json,
    aligned,
    command,
    fail,
    figure_format,
    note,
    show,
    show_files,
    show_json,
)
from remoras.process import Progress

if TYPE_CHECKING:
    from missions.figure import Place
    from missions.runs.results import Results
    from visualisation.output import Drawn


@command("plot", "remoras plot results/lossy trajectories roles --format pdf")
def plot(
    folder: Path,
    kinds: Annotated[list[str] | None, typer.Argument(autocompletion=completion.kind)] = None,
    file_format: FigureFormat = None,
    out: Path | None = None,
    width: float | None = None,
    metric: str | None = None,
    at: float | None = None,
    viewer: str = "",
    panel: str = "",
    draw_all: Annotated[bool, typer.Option("--all")] = False,
) -> None:
    """Draw figures of a run (trajectories, roles and more) or of a sweep (ranking and more).

    Args:
        folder (DIR): Results of a run, or folder of a sweep.
        kinds (KIND): Figures to draw: shipped names, or your own, mine.py:MINE; default: all.

    Options:
        out (DIR): Folder for the figures; default: that of the results.
        width (INCHES): Width of the figures: 3.5 for one column of a paper, 7.2 for two.
        metric (METRIC): Sweep: summary field of the ranking and the differences; default: mission_time_s.
        at (SECONDS): Time of the roles in the figure organisation; default: when most are held.
        viewer (VEHICLE): Vehicle whose view the figure organisation shows; default: each vehicle's own roles.
        panel (LETTER): The only panel to draw of the figure trajectories, such as a.
        draw_all: Sweep: draw all figures; default: the eight most relevant to its factors.
    """
    from missions.disk import check_folder, holds_sweep

    form = figure_format(file_format, out or folder)
    # Before the figures are drawn.
    if out is not None:
        check_folder(out)
    if holds_sweep(folder):
        if at is not None or viewer or panel:
            fail(f"--at, --viewer and --panel: apply to figures of a single run, and {folder} holds a sweep")
        from missions.sweeps.folder import SweepResults
        from visualisation.sweeps import draw_sweep_figures
        from visualisation.sweeps.arrangement import RANKED

        if metric is not None and kinds and not {"ranking", "differences"} & {*kinds}:
            fail(f"--metric {metric}: applies to the figures ranking and differences only; name one of them too")
        swept, (ranked,) = SweepResults.read(folder).naming([metric or RANKED])
        swept, named = swept.naming(kinds or (), "KIND")
        with Progress(f"plot {folder}", 1, "steps") as progress:
            drawn = draw_sweep_figures(swept, named, out or folder, form, ranked, progress.at, width, draw_all)
        _show_drawn(drawn)
        return
    if draw_all:
        fail(f"--all: applies to the figures of a sweep, and {folder} holds a single run, of which all are drawn")
    if metric is not None:
        fail(f"--metric {metric}: applies to the ranking of a sweep, and {folder} holds a single run")
    from missions.runs.results import Results

    results = Results.read(folder)
    _show_drawn(draw_run(results, kinds or (), out or folder, form, width, at, viewer, panel))


def draw_run(
    results: Results,
    kinds: Sequence[str],
    out: Path,
    file_format: str,
    width_in: float | None = None,
    at_s: float | None = None,
    viewer: str = "",
    panel: str = "",
) -> Drawn:
    """Draw a run with figures of its mission and of the user."""
    from missions.scenarios.parts import with_figures
    from visualisation.output import FACTORIAL_KINDS, KINDS, SWEEP_KINDS
    from visualisation.runs import draw_run_figures

    mission = results.mission
    asked, figures = with_figures(kinds, mission.figures, (*KINDS, *SWEEP_KINDS, *FACTORIAL_KINDS))
    return draw_run_figures(results, asked, out, file_format, figures, mission.places, width_in, at_s, viewer, panel)


def _show_drawn(drawn: Drawn) -> None:
    for text in drawn.notes:
        note(f"note: {text}")
    show_files(drawn.files, as_json=False)


Vehicle = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Vehicle whose knowledge is used; default: all vehicles."),
]
At = Annotated[float | None, typer.Option(metavar="SECONDS", help="Time of the knowledge; default: end of the run.")]


@command("query", "remoras query results/lossy 'SELECT ?group WHERE { ?group rm:gatheredAt ?point }'")
def query(
    folder: Path,
    sparql: str,
    vehicle: Vehicle = None,
    at: At = None,
    limit: Annotated[int, typer.Option(min=1)] = 100_000,
    as_json: Json = False,
) -> None:
    """Query the knowledge of one vehicle, or of each, at the end of a run or at another time.

    Args:
        folder (DIR): Results of a run.
        sparql (SPARQL): A SELECT or ASK query, or a file FILE.rq.

    Options:
        limit (N): Maximum number of rows shown.
    """
    from missions.files import text_of
    from missions.runs.results import Results

    results = Results.read(folder)
    text = text_of(Path(sparql)) if sparql.endswith(".rq") else sparql
    # One more row shows whether the limit omits any.
    columns, rows = results.query(text, vehicle, at, limit + 1)
    if len(rows) > limit:
        del rows[limit:]
        note(f"only the first {limit} rows are shown; --limit N shows more")
    if as_json:
        show_json([dict(zip(columns, row, strict=True)) for row in rows])
        return
    shown = [list(columns), *(["" if value is None else str(value) for value in row] for row in rows)]
    print(*aligned(shown), sep="\n")
    print(f"{len(rows)} rows", file=sys.stderr)


ExportFormat = Literal["mcap", "geojson", "netcdf", "csv", "ttl", "trig", "jsonld", "nt"]


@command("export", "remoras export results/lossy --format mcap")
def export(
    folder: Path,
    file_format: Annotated[ExportFormat, typer.Option("--format")],
    out: Path | None = None,
    force: bool = False,
    vehicle: Vehicle = None,
    at: At = None,
    as_json: Json = False,
) -> None:
    """Export a run to another tool: Foxglove, ROS 2, QGIS, netCDF, CSV, RDF.

    Args:
        folder (DIR): Results of a run.

    Options:
        file_format (FORMAT): mcap for Foxglove and ROS 2, geojson for QGIS and Neptus, netcdf with CF conventions, csv
            for anything; what vehicles knew as RDF: ttl, trig, jsonld, nt.
        out (FILE): File or folder to write; default: a name by format in DIR.
        force: Replace an earlier export.
    """
    from missions.runs.results import Results
    from visualisation.exports import FORMATS, Selection, export_path
    from visualisation.exports import export as write

    results, selection = Results.read(folder), Selection(vehicle, at)
    path, of_knowledge = out or export_path(folder, file_format, selection), FORMATS[file_format].of_knowledge
    places = () if of_knowledge else _places_or_none(results)
    _, counts = write(results, file_format, path, force, places, selection)
    label = "facts known to " if of_knowledge else ""
    lines = [str(path), *(f"  {count:>8}  {label}{name}" for name, count in counts.items())]
    show({"path": str(path), "format": file_format, "counts": dict(counts)}, as_json, lines)


def _places_or_none(run: Results) -> Sequence[Place]:
    from missions.errors import ConfigurationError

    try:
        return run.mission.places
    except ConfigurationError as error:
        note(f"places are not exported: {error}")
        return ()


@command("replay", "remoras replay results/lossy --out mission.html")
def replay(
    folder: Path,
    other: Path | None = None,
    out: Path | None = None,
    force: bool = False,
) -> None:
    """Write a self-contained HTML replay of a run; it needs no network.

    Args:
        folder (DIR): Results of a run.
        other ([DIR2]): Results of another run in the same world, shown beside the first.

    Options:
        out (FILE): HTML file; default: DIR/replay.html.
        force: Replace an existing file.
    """
    from missions.disk import REPLAY
    from missions.runs.results import Results
    from remoras.api import replay_data
    from visualisation.replay import check_page_output, missing, page_text, title_of, write_page

    target = out if out is not None else folder / REPLAY
    folders = [folder] if other is None else [folder, other]
    runs = [Results.read(path) for path in folders]
    check_page_output(target, force)
    for second in runs[1:]:
        _check_pair(runs[0], second)
    write_page(target, page_text(title_of([run.summary for run in runs]), list(map(replay_data, runs))))
    for run in runs:
        if lacking := missing(run):
            tables = "; ".join(lacking)
            note(f"{run.folder}: tables are missing; not shown: {tables}")
    print(target)


def _check_pair(first: Results, second: Results) -> None:
    ours, theirs = first.scenario, second.scenario
    mission = ours.scenario.mission == theirs.scenario.mission
    for part, same in (
        ("mission", mission),
        ("world", mission and (ours.world, first.mission.places) == (theirs.world, second.mission.places)),
        ("vehicles", [vehicle.name for vehicle in ours.vehicle] == [vehicle.name for vehicle in theirs.vehicle]),
    ):
        if not same:
            fail(
                f"{second.folder}: {part} differ from {first.folder}; two runs are shown side by side if vehicles "
                "of the same names did the same mission in the same world"
            )


@command("why", "remoras why results/lossy AUV00 1906 --not Mapping")
def why(
    folder: Path,
    vehicle: str,
    at: float,
    instead: Annotated[str, typer.Option("--not")] = "",
    as_json: Json = False,
) -> None:
    """Explain what a vehicle did at a time: motives, signals, plan and assignments behind it.

    Args:
        folder (DIR): Results of a run.
        vehicle (VEHICLE): Vehicle whose action is explained.
        at (TIME): Time in seconds of the mission.

    Options:
        instead (ROLE|ACTIVITY): Explain also why it did not perform this role or activity.
    """
    from missions.runs.results import Results
    from missions.why import why as explained

    answer = explained(Results.read(folder), vehicle, at, instead)
    lines = [line._asdict() for line in answer.lines]
    show({"vehicle": vehicle, "at_s": at, "lines": lines}, as_json, [line.text for line in answer.lines])


@command("verify", "remoras verify results/run", names_code=False)
def verify(
    folder: Path,
    as_json: Json = False,
) -> None:
    """Check that results follow from their tables and scenario, by an independent checker.

    Args:
        folder (DIR): Results folder of a run or a sweep.
    """
    from missions.verification import NoResults
    from missions.verification import verify as verified

    try:
        report = verified(folder)
    except NoResults as error:
        fail(str(error))
    n_checked, n_others = sum(report.checked.values()), len(report.not_checked)
    n_right = n_checked - sum(report.n_findings.values())
    lines = [
        *report.lines,
        f"{folder}: {n_right} of {n_checked} checked values follow; {n_others} kinds unchecked",
        *(f"  not checked: {check}: {why}" for check, why in sorted(report.not_checked.items())),
    ]
    show(report.as_json, as_json, lines)
    if report.findings:
        raise typer.Exit(FAILED)
