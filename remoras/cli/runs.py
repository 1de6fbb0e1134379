"""The command line: the roof, the one place that may import everything.

Imports are made where they are needed, so that ``--help`` answers at once.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from remoras.cli.app import FAILED, Format, Json, app, command, fail, nearest, one_of, show_json
from remoras.cli.progress import Progress

if TYPE_CHECKING:
    from missions.runs.results import Results
    from visualisation import Drawn

# Listing ------------------------------------------------------------------------------------------


KINDS = ("scenarios", "strategies", "policies", "channels", "modems", "studies")


@command("list")
def list_(
    kind: Annotated[str, typer.Argument(help=f"One of {', '.join(KINDS)}; all but the studies if left out.")] = "",
    as_json: Json = False,
) -> None:
    """List what can be named: scenarios, strategies, policies, channels, modems; or studies.

    Of strategies alone it also lists source, messages and parameters.
    """
    if kind:
        one_of("kind", kind, KINDS)
    from remoras.cli.listings import DETAILS, LISTINGS

    found = {name: LISTINGS[name]() for name in ([kind] if kind else KINDS[:-1])}
    if as_json:
        rows = {
            name: [
                {"name": key, "description": text, **(DETAILS[name](key) if name in DETAILS else {})}
                for key, text in entries.items()
            ]
            for name, entries in found.items()
        }
        show_json(rows[kind] if kind else rows)
        return
    for name, entries in found.items():
        print(f"{name}:")
        width = max((len(key) for key in entries), default=0)
        for key, text in entries.items():
            print(f"  {key:<{width}}  {text}")
            for line in _detail_lines(DETAILS[name](key)) if kind in DETAILS else ():
                print(f"      {line}")


def _detail_lines(details: Mapping[str, Any]) -> Iterator[str]:
    yield f"source: {details['source']}"
    yield from (f"message {name}: {meaning}" for name, meaning in details["messages"].items())
    yield from (f"parameter {p['name']} = {p['default']}: {p['description']}" for p in details["parameters"])


# Running ------------------------------------------------------------------------------------------


def _overrides(
    strategy: str | None, policy: str | None, channel: str | None, per: str | None, settings: Sequence[str]
) -> list[tuple[str, str]]:
    """(option as the user gave it, KEY=VALUE)."""
    options = [
        ("--strategy", "strategy.name", strategy),
        ("--policy", "communication.policy", policy),
        ("--channel", "channel.name", channel),
        ("--per", "channel.per", per),
    ]
    given = [(option, f"{key}={value}") for option, key, value in options if value is not None]
    return given + [("--set", setting) for setting in settings]


@command("run")
def run(
    scenario: Annotated[str, typer.Argument(help="Shipped scenario or TOML file.")],
    strategy: Annotated[str | None, typer.Option(help="Organisational strategy.")] = None,
    policy: Annotated[str | None, typer.Option(help="Exchange policy.")] = None,
    channel: Annotated[str | None, typer.Option(help="Loss model of the channel.")] = None,
    per: Annotated[str | None, typer.Option(help="Packet error rate of bernoulli or matrix, 0 to below 1.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random draws.")] = 1,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a key; see `explain`.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for summary, manifest and tables.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results that are already in --out.")] = False,
    as_json: Json = False,
) -> None:
    """Run a mission scenario; print its summary, and write all of its results with --out."""
    from missions.runs import results
    from missions.runs.run import run as run_scenario
    from missions.scenarios import load

    loaded = load(scenario, _overrides(strategy, policy, channel, per, settings or []))
    if out is not None:
        results.check_output(out, force)
    with Progress(f"run {loaded.scenario.name}", loaded.scenario.duration_s, "s of mission time") as progress:
        finished = run_scenario(loaded, seed, progress=progress.at)
    if out is not None:
        results.write(finished, out, force)
    report = results.summary(finished)
    if as_json:
        show_json(report)
    else:
        _print_summary(report)
        if out is not None:
            print(f"results in {out}; draw them with: remoras plot {out}")
    if not finished.completed:
        raise typer.Exit(FAILED)


def _print_summary(report: dict[str, Any]) -> None:
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


@command("plot")
def plot(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run, or folder of a sweep.")],
    kinds: Annotated[
        list[str] | None, typer.Argument(metavar="[KIND]...", help="Figures to draw; all if left out.")
    ] = None,
    file_format: Annotated[Format, typer.Option("--format", help="File format.")] = Format.PNG,
    out: Annotated[Path | None, typer.Option(help="Folder for the figures; DIR if left out.")] = None,
    metric: Annotated[
        str | None, typer.Option(help="Field of the summary that a sweep's ranking is by; else mission_time_s.")
    ] = None,
) -> None:
    """Draw the figures of a run (trajectories, roles and more) or of a sweep (metrics over loss, ranking and more)."""
    if (folder / "study.json").is_file():
        _plot_sweep(folder, kinds or (), out or folder, file_format, metric)
        return
    if not (folder / "summary.json").is_file():
        fail(f"{folder}: no results of a run (summary.json is missing), nor of a sweep (study.json is missing)")
    if metric is not None:
        fail(f"--metric {metric}: is about the ranking of a sweep, and {folder} holds a single run")
    from missions.runs.results import Results

    _show_drawn(_draw_run(Results.read(folder), kinds or (), out or folder, file_format))


def _draw_run(results: Results, kinds: Sequence[str], out: Path, file_format: Format) -> Drawn:
    """Draw a run with what its mission declares."""
    from missions.scenarios.parts import mission_of
    from visualisation.runs import draw

    mission = mission_of(results.scenario)
    return draw(results, kinds, out, file_format.value, mission.figures, mission.places)


def _show_drawn(drawn: Drawn) -> None:
    for note in drawn.notes:
        print(f"remoras: {note}", file=sys.stderr)
    for path in drawn.files:
        print(path)


def _plot_sweep(folder: Path, kinds: Sequence[str], out: Path, file_format: Format, metric: str | None) -> None:
    from missions.runs.metrics import METRICS
    from missions.sweeps.runlog import SweepResults
    from visualisation.sweeps import draw
    from visualisation.sweeps.measures import RANKED

    if metric is not None and kinds and "ranking" not in kinds:
        fail(f"--metric {metric}: is what a ranking is by; name the figure ranking too")
    with Progress(f"plot {folder}", 1, "steps") as progress:
        drawn = draw(
            SweepResults.read(folder), kinds, out, METRICS, file_format.value, metric or RANKED, progress.of
        )
    _show_drawn(drawn)


# Scenarios ----------------------------------------------------------------------------------------


@command("validate")
def validate(
    file: Annotated[str, typer.Argument(metavar="FILE", help="Scenario or study: a file, or a shipped name.")],
    as_json: Json = False,
) -> None:
    """Check a scenario or study file whole; every fault is reported with its line."""
    from missions.runs.run import schedule_of
    from missions.runs.setup import assemble
    from missions.scenarios import load
    from missions.sweeps.study import is_study

    if is_study(file):
        _validate_study(file, as_json)
        return
    scenario = load(file)
    fleet = assemble(scenario, seed=0)
    founded = next(iter(fleet.vehicles)).social.organisation
    fleet.close()
    schedule = schedule_of(scenario)
    if as_json:
        founding = [{"vehicle": a.vehicle, "group": a.group, "role": a.role} for a in sorted(founded.assignments)]
        show_json(
            {
                "file": file,
                "kind": "scenario",
                "ok": True,
                "slot_s": schedule.slot_s,
                "frame_s": schedule.frame_s,
                "founding": founding,
            }
        )
        return
    print(
        f"{file}: scenario ok; {len(scenario.vehicle)} vehicles, {len(scenario.group)} groups, "
        f"{len(scenario.area)} areas, slot {schedule.slot_s:.3f} s, frame {schedule.frame_s:.2f} s"
    )
    for assignment in sorted(founded.assignments):
        print(f"  founding: {assignment.vehicle} plays {assignment.role} of {assignment.group}")


def _validate_study(file: str, as_json: bool) -> None:
    from missions.sweeps.study import load_study

    study = load_study(file)
    n_configurations, at_most = len(study.configurations), "at most " if study.file.stopping else ""
    if as_json:
        show_json(
            {"file": file, "kind": "study", "ok": True, "configurations": n_configurations, "planned": study.n_runs}
        )
        return
    runs = f"{at_most}{study.maximum} repeats = {at_most}{study.n_runs} runs"
    print(f"{file}: study ok; {n_configurations} configurations x {runs}")


@command("example")
def example(
    what: Annotated[str, typer.Argument(help="scenario, study or organisation.")] = "scenario",
) -> None:
    """Print a commented example to start from."""
    from missions.scenarios import shipped
    from missions.sweeps.study import example_study

    one_of("example", what, ["scenario", "study", "organisation"])
    if what == "study":
        print(example_study().rstrip())
        return
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    if what == "organisation":
        text = "[[group]]" + text.split("[[group]]", 1)[1].split("[[vehicle]]", 1)[0]
    print(text.rstrip())


def _explained(key: str, known: dict[str, tuple[str, str]]) -> dict[str, tuple[str, str]]:
    """What is known of a key, of all keys of a table, or of the table of free keys that it stands in."""
    return {
        name: (kind, meaning)
        for name, (kind, meaning) in known.items()
        if not key
        or f"{name}.".startswith(f"{key}.")
        or (kind.startswith("dict") and key.startswith(f"{name}.") and name != "mission")
    }


@command("explain")
def explain(
    key: Annotated[str, typer.Argument(help="A key such as communication.policy; a table for all its keys.")] = "",
) -> None:
    """Say what a key of a scenario or of a study means: type, range, default."""
    from missions.scenarios.explanations import explanations
    from missions.sweeps.study import study_explanations

    known = explanations() | study_explanations()
    found = _explained(key, known)
    if not found and key.count(".") > 1:  # an entry of a list by its name, as --set has it
        table, _, rest = key.split(".", 2)
        found = _explained(f"{table}.{rest}", known)
    if not found:
        fail(f"key {key!r} is in no scenario and no study{nearest(key, list(known))}; `remoras explain` lists all keys")
    for name, (kind, meaning) in found.items():
        print(f"{name}  ({kind})\n    {meaning}")


@command("doctor")
def doctor() -> None:
    """Check this installation: versions, ontology, a short run, a figure."""
    import platform
    import tempfile
    from importlib import metadata

    from missions.runs import results
    from missions.runs.run import run as run_scenario
    from missions.scenarios import load

    print(f"Python {platform.python_version()} on {platform.platform()}")
    for name in ("remoras", *results.LIBRARIES):
        print(f"  {name} {metadata.version(name)}")
    short = run_scenario(load("mapping-rendezvous", [("--set", "scenario.duration_s=60")]))
    print(f"a run of 60 s of mission time took {short.wall_s:.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        results.write(short, Path(folder) / "run")
        drawn = _draw_run(results.Results.read(Path(folder) / "run"), (), Path(folder), Format.PNG)
        print(f"drew {len(drawn.files)} files")
    print("ok")


def _not_available(name: str) -> None:
    @app.command(name, hidden=True, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
    def unavailable() -> None:
        fail(f"{name} is not available in this version")


for _name in ("replay", "live", "export"):
    _not_available(_name)
