"""Commands about single runs: run, live, plot, query."""

from __future__ import annotations

import functools
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from remoras.cli import completion
from remoras.cli.app import FAILED, Format, Json, as_typed, command, fail, give_up, show_json
from remoras.cli.exports import At, Vehicle
from remoras.cli.tables import on_terminal, show_table
from remoras.progress import Progress

if TYPE_CHECKING:
    from missions.runs.results import Results
    from remoras.face import Run as Finished
    from visualisation.output import Drawn


ScenarioName = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="Shipped scenario or TOML file.", autocompletion=completion.scenario)
]
StrategyName = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Organisational strategy.", autocompletion=completion.strategy_name),
]
PolicyName = Annotated[
    str | None, typer.Option(metavar="NAME", help="Exchange policy.", autocompletion=completion.policy)
]
ChannelName = Annotated[
    str | None, typer.Option(metavar="NAME", help="Loss model of the channel.", autocompletion=completion.channel)
]
NetworkName = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Network whose losses were measured, or a TOML or CSV file of one; sets the channel, too.",
        autocompletion=completion.network,
    ),
]
ErrorRate = Annotated[
    str | None, typer.Option(metavar="RATE", help="Packet error rate of bernoulli or matrix, 0 to below 1.")
]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Root of all random draws: 0, 1, 2, ...")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Override a key; see `explain`.", autocompletion=completion.setting
    ),
]


def overrides_of(
    strategy: str | None,
    policy: str | None,
    channel: str | None,
    network: str | None,
    per: str | None,
    settings: Sequence[str],
) -> list[tuple[str, str]]:
    """(option as the user gave it, KEY=VALUE) of the options of a run."""
    options = [
        ("--strategy", "strategy.name", strategy),
        ("--policy", "communication.policy", policy),
        ("--channel", "channel.name", channel),
        ("--network", "channel.name", None if network is None else "network"),
        ("--network", "channel.network", network),
        ("--per", "channel.per", per),
    ]
    given = [(option, f"{key}={value}") for option, key, value in options if value is not None]
    return given + [("--set", setting) for setting in settings]


@command("run", "remoras run mapping-rendezvous --per 0.6 --seed 3 --out results/lossy")
def run(
    scenario: ScenarioName,
    strategy: StrategyName = None,
    policy: PolicyName = None,
    channel: ChannelName = None,
    network: NetworkName = None,
    per: ErrorRate = None,
    seed: Seed = 1,
    settings: Settings = None,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for summary, manifest and tables.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results that are already in --out.")] = False,
    as_json: Json = False,
) -> None:
    """Run a mission scenario; print its summary, and write all of its results with --out."""
    from missions.files import SCENARIO, file_of, shipped

    file_of(SCENARIO, scenario, shipped())  # a name that is mistyped is told before much is loaded
    with saying_what_is_written(out):
        from missions.runs.folder import check_output
        from missions.runs.results import MemoryResults, write_results
        from missions.runs.run import run as run_scenario
        from missions.scenarios import load

        loaded = load(scenario, overrides_of(strategy, policy, channel, network, per, settings or []))
        if out is not None:
            check_output(out, force)
        with Progress(f"run {loaded.scenario.name}", loaded.scenario.duration_s, "s of mission time") as progress:
            finished = run_scenario(loaded, seed, progress=progress.at)
        results = MemoryResults(finished)
        if out is not None:
            write_results(results, out, force)
    report = results.summary if as_json else results.figures
    if as_json:
        show_json(report)
    else:
        _print_summary(report)
        if out is not None:
            print(f"results in {out}; draw them with: remoras plot {as_typed(out)}")
    _warn_of_conflicts(report, loaded.guidance.separation_m)
    if not finished.completed:
        raise typer.Exit(FAILED)


@contextmanager
def saying_what_is_written(out: Path | None) -> Iterator[None]:
    """Note on an interruption whether the folder of results has been written by then."""
    before = _written_at(out)
    try:
        yield
    except KeyboardInterrupt as error:
        if out is not None:
            error.add_note(f"nothing was written to {out}" if _written_at(out) == before else f"results are in {out}")
        raise


def _written_at(folder: Path | None) -> tuple[int, int] | None:
    """What changes when results are written to a folder; None if it has none."""
    from missions.runs.folder import MANIFEST

    try:
        found = (folder / MANIFEST).stat() if folder is not None else None
    except OSError:
        return None
    return (found.st_ino, found.st_mtime_ns) if found is not None else None


def _warn_of_conflicts(report: dict[str, Any], separation_m: float) -> None:
    """Say on standard error that vehicles came too near to each other."""
    if n_pairs := report["conflicts"]:
        pairs = "1 pair of vehicles" if n_pairs == 1 else f"{n_pairs} pairs of vehicles"
        print(
            f"remoras: {pairs} came nearer than guidance.separation_m = {separation_m:g} m, down to "
            f"{report['closest_approach_m']:.3g} m; the table faults says who and when",
            file=sys.stderr,
        )


def _print_summary(report: dict[str, Any]) -> None:
    if on_terminal():
        figures = [(key, _figure(value)) for key, value in report.items() if key != "milestones" and value != ""]
        show_table(("figure", "value"), figures)
        milestones = [
            (f"{milestone['time_s']:.1f} s", milestone["name"], milestone["vehicle"] or milestone["group"])
            for milestone in report["milestones"]
        ]
        show_table(("time", "milestone", "who"), milestones, numbers=("time",))
        return
    for key, value in report.items():
        if key != "milestones" and value != "":
            print(
                f"{key:<20} {value:.4g}"
                if isinstance(value, float) and key != "mission_time_s"
                else f"{key:<20} {value}"
            )
    print("milestones:")
    for milestone in report["milestones"]:
        who = milestone["vehicle"] or milestone["group"]
        print(f"  {milestone['time_s']:>9.1f} s  {milestone['name']} {who}".rstrip())


def _figure(value: Any) -> str:
    """A figure of the summary for people."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "-" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)


@command("live", "remoras live mapping-rendezvous --per 0.6")
def live(
    scenario: ScenarioName,
    strategy: StrategyName = None,
    policy: PolicyName = None,
    channel: ChannelName = None,
    network: NetworkName = None,
    per: ErrorRate = None,
    seed: Seed = 1,
    settings: Settings = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the results when it has finished.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results that are already in --out.")] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="PORT", help="Port of the page; 0 is any that is free.")
    ] = 0,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open a browser.")] = False,
) -> None:
    """Watch a mission while it runs, with start, pause, step and speed, in a page that only this machine can open."""
    import threading
    import webbrowser

    from missions.errors import MissionsError
    from missions.files import SCENARIO, file_of, shipped

    file_of(SCENARIO, scenario, shipped())  # a name that is mistyped is told before much is loaded
    from missions.runs.folder import check_output
    from missions.runs.setup import resolved
    from missions.runs.underway import Underway
    from missions.scenarios import load
    from remoras.cli.live import LiveRun, LiveServer
    from remoras.stepped import Stepping
    from visualisation.replay import live_text

    def keep(finished: Finished) -> str:
        if out is None:
            return "no folder was named with --out, so the results are not kept"
        try:
            return f"results in {finished.save(out, force)}"
        except MissionsError as error:
            return f"the results are not kept: {error}"

    setup = resolved(load(scenario, overrides_of(strategy, policy, channel, network, per, settings or [])))
    if out is not None:
        check_output(out, force)
    about = setup.scenario.scenario
    with Stepping(Underway(setup, seed)) as stepping:
        run = LiveRun(stepping, about.duration_s, keep)
        try:
            server = LiveServer(run, live_text(f"{about.name}, seed {seed} - live"), port)
        except OSError as error:
            fail(f"--port {port}: cannot be listened on: {error.strerror}; name another, or 0 for any that is free")
        threading.Thread(target=server.serve_forever, daemon=True).start()
        print(server.url, flush=True)
        print("remoras: Ctrl-C ends it", file=sys.stderr)
        if not no_browser:
            webbrowser.open(server.url)
        with suppress(KeyboardInterrupt):  # the usual end
            run.serve()
    if not run.is_over and out is not None:
        print(f"remoras: the run was not over; nothing is written to {out}", file=sys.stderr)


@command("plot", "remoras plot results/lossy trajectories roles --format pdf")
def plot(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run, or folder of a sweep.")],
    kinds: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="KIND",
            help="Figures to draw, or your own, mine.py:MINE; all if left out.",
            autocompletion=completion.kind,
        ),
    ] = None,
    file_format: Annotated[
        Format,
        typer.Option(
            "--format",
            metavar="png|svg|pdf|gif",
            help="File format; gif has the trajectories of a run as an animation.",
        ),
    ] = Format.PNG,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for the figures; that of the results if left out.")
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(metavar="INCHES", help="Width of the figures: 3.5 a column, 7.2 a page of a paper."),
    ] = None,
    metric: Annotated[
        str | None,
        typer.Option(
            metavar="METRIC",
            help="Field of the summary of a sweep's ranking and differences; else mission_time_s.",
            autocompletion=completion.metric,
        ),
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="When the figure organisation shows who plays what; else when most do."),
    ] = None,
    viewer: Annotated[
        str, typer.Option(metavar="VEHICLE", help="In whose view the figure organisation is; else as each sees itself.")
    ] = "",
    draw_all: Annotated[
        bool, typer.Option("--all", help="Every figure of a sweep; else the eight that say most of what it varies.")
    ] = False,
) -> None:
    """Draw the figures of a run (trajectories, roles and more) or of a sweep (metrics over loss, ranking and more)."""
    with _glyphs_noted():
        _plot(folder, kinds or (), out or folder, file_format, metric, width, at, viewer, draw_all)


@contextmanager
def _glyphs_noted() -> Iterator[None]:
    """Say in one line that names have characters that the font of figures lacks; other warnings go their way."""
    with warnings.catch_warnings(record=True) as caught:
        yield
    others = [warning for warning in caught if "missing from font" not in str(warning.message)]
    if len(others) < len(caught):
        text = "the font of figures lacks some characters of the names; they are drawn as boxes"
        print(f"remoras: {text}", file=sys.stderr)
    for other in others:
        warnings.showwarning(other.message, other.category, other.filename, other.lineno)


def _plot(
    folder: Path,
    kinds: Sequence[str],
    out: Path,
    file_format: Format,
    metric: str | None,
    width: float | None,
    at_s: float | None,
    viewer: str,
    draw_all: bool,
) -> None:
    """Draw what a folder holds, a run or a sweep."""
    if (folder / "study.json").is_file():
        if at_s is not None or viewer:
            fail(f"--at and --viewer: are about the organisation of a single run, and {folder} holds a sweep")
        _plot_sweep(folder, kinds, out, file_format, metric, width, draw_all)
        return
    if draw_all:
        fail(f"--all: is about the figures of a sweep, and {folder} holds a single run, of which all are drawn")
    if not (folder / "summary.json").is_file():
        fail(f"{folder}: no results of a run (summary.json is missing), nor of a sweep (study.json is missing)")
    if metric is not None:
        fail(f"--metric {metric}: is about the ranking of a sweep, and {folder} holds a single run")
    from missions.runs.results import Results

    results = Results.read(folder)
    _show_drawn(draw_run(results, kinds, out, file_format, width, at_s, viewer))


def draw_run(
    results: Results,
    kinds: Sequence[str],
    out: Path,
    file_format: Format,
    width_in: float | None = None,
    at_s: float | None = None,
    viewer: str = "",
) -> Drawn:
    """Draw a run with what its mission declares, and figures of a user's own."""
    from missions.scenarios.named import with_figures
    from missions.scenarios.parts import mission_of
    from visualisation.output import FACTORIAL_KINDS, KINDS, SWEEP_KINDS
    from visualisation.runs import ViewAt, draw_run_figures

    mission, moment = mission_of(results.scenario), ViewAt(at_s, viewer)
    asked, figures = with_figures(kinds, mission.figures, (*KINDS, *SWEEP_KINDS, *FACTORIAL_KINDS))
    return draw_run_figures(results, asked, out, file_format.value, figures, mission.places, width_in, moment)


def _show_drawn(drawn: Drawn) -> None:
    for note in drawn.notes:
        print(f"remoras: {note}", file=sys.stderr)
    for path in drawn.files:
        print(path)


def _plot_sweep(
    folder: Path,
    kinds: Sequence[str],
    out: Path,
    file_format: Format,
    metric: str | None,
    width_in: float | None,
    draw_all: bool,
) -> None:
    from missions.sweeps.folder import SweepResults
    from visualisation.sweeps import draw_sweep_figures
    from visualisation.sweeps.arrangement import RANKED

    if metric is not None and kinds and not {"ranking", "differences"} & {*kinds}:
        fail(f"--metric {metric}: is about a ranking and differences; name the figure ranking or differences too")
    results = SweepResults.read(folder)
    results, (ranked,) = results.naming([metric or RANKED])
    results, kinds = results.naming(kinds, "KIND")
    with Progress(f"plot {folder}", 1, "steps") as progress:
        drawn = draw_sweep_figures(results, kinds, out, file_format.value, ranked, progress.of, width_in, draw_all)
    _show_drawn(drawn)


@command("query", "remoras query results/lossy 'SELECT ?group WHERE { ?group rm:gatheredAt ?point }'")
def query(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run.")],
    sparql: Annotated[str, typer.Argument(metavar="SPARQL", help="A SELECT or ASK query, or a file FILE.rq.")],
    vehicle: Vehicle = None,
    at: At = None,
    engine: Annotated[
        str, typer.Option(metavar="rdflib|oxigraph", help="What answers; oxigraph is fast where much is known.")
    ] = "rdflib",
    limit: Annotated[int, typer.Option(min=1, metavar="N", help="Most rows that are shown.")] = 100_000,
    timeout_s: Annotated[
        float, typer.Option(min=0.001, metavar="SECONDS", help="Longest time that it may take.")
    ] = 60.0,
    as_json: Json = False,
) -> None:
    """Ask what one vehicle knew, or each in turn, at the end of a run or at another time."""
    from missions.files import text_of
    from missions.runs.knowledge import query as ask
    from missions.runs.results import Results
    from worldmodel.rdf.deadline import time_limit

    if (folder / "study.json").is_file():
        fail(f"{folder}: holds a sweep, and query takes the results of one run; make one with: remoras run --out DIR")
    results = Results.read(folder)
    text = text_of(Path(sparql)) if sparql.endswith(".rq") else sparql
    with time_limit(timeout_s, functools.partial(give_up, as_json=as_json)):
        columns, rows = ask(results, text, vehicle, at, engine, limit + 1)
    if len(rows) > limit:
        del rows[limit:]
        print(f"remoras: only the first {limit} rows are shown; --limit N shows more", file=sys.stderr)
    if as_json:
        show_json([dict(zip(columns, row, strict=True)) for row in rows])
        return
    shown = [list(columns), *(["" if value is None else str(value) for value in row] for row in rows)]
    if on_terminal():
        show_table(shown[0], shown[1:])
        print(f"{len(rows)} rows", file=sys.stderr)
        return
    widths = [max(len(row[number]) for row in shown) for number in range(len(columns))]
    for row in shown:
        print("  ".join(f"{value:<{width}}" for value, width in zip(row, widths, strict=True)).rstrip())
    print(f"{len(rows)} rows", file=sys.stderr)
