"""The command line: the roof. It and ``cli_batch``, which is part of it, may import everything.

Imports are made where they are needed, so that ``--help`` answers at once.
"""

from __future__ import annotations

import functools
import json
import sys
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn, ParamSpec

import typer

from remoras import cli_batch
from remoras.progress import Progress

OK, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    help="Fleets of autonomous marine vehicles: organisation and knowledge over a lossy acoustic channel.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
Parameters = ParamSpec("Parameters")


def fail(message: str) -> NoReturn:
    """One clear message on the standard error, exit 2."""
    print(f"remoras: {message}", file=sys.stderr)
    raise typer.Exit(USAGE)


def nearest(name: str, known: Sequence[str]) -> str:
    found = get_close_matches(name, known, n=1)
    return f"; did you mean {found[0]!r}?" if found else ""


def one_of(what: str, name: str, known: Sequence[str]) -> None:
    """Fail unless ``name`` is one of ``known``."""
    if name not in known:
        fail(f"{what} {name!r}: allowed are {', '.join(known)}{nearest(name, known)}")


def command(name: str) -> Callable[[Callable[Parameters, None]], Callable[Parameters, None]]:
    """A command whose user errors become one message and whose interruption exits with 130."""

    def register(function: Callable[Parameters, None]) -> Callable[Parameters, None]:
        @functools.wraps(function)
        def reported(*args: Parameters.args, **kwargs: Parameters.kwargs) -> None:
            try:
                function(*args, **kwargs)
            except KeyboardInterrupt:
                print("remoras: interrupted", file=sys.stderr)
                raise typer.Exit(INTERRUPTED) from None
            except BrokenPipeError:
                sys.stderr.close()
                raise typer.Exit(OK) from None
            except Exception as error:
                if not _is_users_fault(error):
                    raise
                fail(str(error))

        app.command(name)(reported)
        return function

    return register


def _is_users_fault(error: Exception) -> bool:
    from exchange.errors import ExchangeError
    from missions.errors import MissionsError
    from remoras.errors import RemorasError
    from visualisation.errors import VisualisationError
    from worldmodel import WorldModelError

    return isinstance(error, ExchangeError | MissionsError | RemorasError | VisualisationError | WorldModelError)


def show_json(value: Any) -> None:
    print(json.dumps(value, indent=2, allow_nan=False))


Json = Annotated[bool, typer.Option("--json", help="Print one JSON value and nothing else.")]


# Listing ------------------------------------------------------------------------------------------


KINDS = ("scenarios", "strategies", "policies", "channels", "modems")


@command("list")
def list_(
    kind: Annotated[str, typer.Argument(help=f"One of {', '.join(KINDS)}; all of them if left out.")] = "",
    as_json: Json = False,
) -> None:
    """List what can be named: scenarios, strategies, policies, channels, modems."""
    if kind:
        one_of("kind", kind, KINDS)
    from missions.listings import LISTINGS

    found = {name: LISTINGS[name]() for name in LISTINGS if kind in ("", name)}
    if as_json:
        rows = {
            name: [{"name": key, "description": text} for key, text in entries.items()]
            for name, entries in found.items()
        }
        show_json(rows[kind] if kind else rows)
        return
    for name, entries in found.items():
        print(f"{name}:")
        width = max((len(key) for key in entries), default=0)
        for key, text in entries.items():
            print(f"  {key:<{width}}  {text}")


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
    per: Annotated[str | None, typer.Option(help="Packet error rate, 0 to below 1.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Root of all random draws.")] = 1,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a key; see `explain`.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for summary, manifest and tables.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace results that are already in --out.")] = False,
    as_json: Json = False,
) -> None:
    """Run a mission scenario; print its summary, and write all of its results with --out."""
    from missions import results
    from missions.run import run as run_scenario
    from missions.scenario import load

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


class Format(StrEnum):
    """Formats of figures."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


@command("plot")
def plot(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Results of a run.")],
    kinds: Annotated[
        list[str] | None, typer.Argument(metavar="[KIND]...", help="Figures to draw; all if left out.")
    ] = None,
    file_format: Annotated[Format, typer.Option("--format", help="File format.")] = Format.PNG,
    out: Annotated[Path | None, typer.Option(help="Folder for the figures; DIR if left out.")] = None,
) -> None:
    """Draw the figures of a run: trajectories, roles and more."""
    import visualisation
    from missions.results import Results

    for path in visualisation.draw(Results.read(folder), kinds or (), out or folder, file_format.value):
        print(path)


# The policy study ---------------------------------------------------------------------------------


def loss_rates(text: str) -> tuple[float, ...]:
    """Loss rates of ``0.1,0.5`` or ``0.05:0.8:0.05`` (first, last, step).

    >>> loss_rates("0.1:0.3:0.1"), loss_rates("0.5")
    ((0.1, 0.2, 0.3), (0.5,))
    """
    try:
        if ":" not in text:
            return tuple(float(part) for part in text.split(","))
        first, last, step = (float(part) for part in text.split(":"))
        if step <= 0.0 or last < first:
            raise ValueError
    except ValueError:
        fail(f"--per {text!r}: allowed are rates such as 0.1,0.5 or first:last:step such as 0.05:0.8:0.05")
    return tuple(round(first + number * step, 10) for number in range(int((last - first) / step + 1e-9) + 1))


@command("exchange-study")
def exchange_study(
    nodes: Annotated[int, typer.Option(help="Vehicles in the fleet, 2 to 64.")] = 5,
    per: Annotated[str, typer.Option(help="Loss rates: 0.1,0.5 or first:last:step.")] = "0.05:0.8:0.05",
    policies: Annotated[str, typer.Option(help="all, or names with commas between.")] = "all",
    trials: Annotated[int, typer.Option(help="Trials of each policy at each loss rate.")] = 2000,
    load: Annotated[str, typer.Option(help="single, batch or poisson:RATE (items per node and slot).")] = "single",
    items: Annotated[int, typer.Option(help="Items at every node, for load batch.")] = 1,
    item_bits: Annotated[int, typer.Option(help="Size of an item.")] = 60,
    capacity_bits: Annotated[
        int | None, typer.Option(help="Size of a packet, header charged; unlimited if left out.")
    ] = None,
    carrier_evidence: Annotated[bool, typer.Option(help="Take a node that sends an item as holding it.")] = False,
    seed: Annotated[int, typer.Option(help="Root of all random draws.")] = 1,
    jobs: Annotated[int, typer.Option(help="Cores to use; the numbers do not depend on it.")] = 1,
    out: Annotated[Path | None, typer.Option(help="Folder for figures, captions and their CSV.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace what is already in --out.")] = False,
    as_json: Json = False,
) -> None:
    """Study the exchange policies: time to delivery and to acknowledgement against packet loss."""
    from exchange.policies import POLICIES
    from exchange.study import ExchangeStudy, run, workload_named
    from missions.results import check_output

    study = ExchangeStudy(
        nodes=nodes,
        per=loss_rates(per),
        policies=tuple(POLICIES) if policies == "all" else tuple(policies.split(",")),
        trials=trials,
        load=workload_named(load, items),
        item_bits=item_bits,
        capacity_bits=capacity_bits,
        carrier_evidence=carrier_evidence,
        seed=seed,
    )
    if out is not None:
        check_output(out, force)
    with Progress("exchange study", 1.0, "of the trials") as progress:
        rows = run(
            study, jobs, lambda done, total: progress.at(done / total), lambda text: print(text, file=sys.stderr)
        )
    if as_json:
        show_json([row.as_json() for row in rows])
    else:
        _print_study(rows)


def _print_study(rows: Sequence[Any]) -> None:
    """A line for every policy and loss rate: mean slots with the half-width of the 95 % interval."""

    def shown(estimate: Any) -> str:
        if estimate is None:
            return f"{'-':>18}"
        if estimate.ci95_high is None:
            return f"{estimate.mean:>18.2f}"
        return f"{estimate.mean:>10.2f} +- {estimate.ci95_high - estimate.mean:<5.2f}"

    print(f"{'per':>5} {'policy':<16} {'delivered':>17} {'source acked':>18} {'senders acked':>18}  slots; censored")
    for row in rows:
        estimates = (row.delivered_slots, row.source_acked_slots, row.senders_acked_slots)
        print(f"{row.per:>5g} {row.policy:<16}", *map(shown, estimates), f"{row.censored_senders:>14}")


# Scenarios ----------------------------------------------------------------------------------------


@command("validate")
def validate(
    file: Annotated[str, typer.Argument(metavar="FILE", help="Scenario file, or a shipped name.")],
) -> None:
    """Check a scenario file whole; every fault is reported with its line."""
    from missions.run import assemble, schedule_of
    from missions.scenario import load

    scenario = load(file)
    fleet = assemble(scenario, seed=0)
    founded = next(iter(fleet.vehicles)).social.organisation
    fleet.close()
    schedule = schedule_of(scenario)
    print(
        f"{file}: ok; {len(scenario.vehicle)} vehicles, {len(scenario.group)} groups, {len(scenario.area)} areas, "
        f"slot {schedule.slot_s:.3f} s, frame {schedule.frame_s:.2f} s"
    )
    for assignment in sorted(founded.assignments):
        print(f"  founding: {assignment.vehicle} plays {assignment.role} of {assignment.group}")


@command("example")
def example(
    what: Annotated[str, typer.Argument(help="scenario or organisation.")] = "scenario",
) -> None:
    """Print a commented example to start from."""
    from missions.scenario import shipped

    one_of("example", what, ["scenario", "organisation"])
    text = shipped()["mapping-rendezvous"].read_text(encoding="utf-8")
    if what == "organisation":
        text = "[[group]]" + text.split("[[group]]", 1)[1].split("[[vehicle]]", 1)[0]
    print(text.rstrip())


@command("explain")
def explain(
    key: Annotated[str, typer.Argument(help="A key such as communication.policy; a table for all its keys.")] = "",
) -> None:
    """Say what a key of a scenario means: type, range, default."""
    from missions.scenario import explanations

    known = explanations()
    found = {name: text for name, text in known.items() if not key or name == key or name.startswith(f"{key}.")}
    if not found:
        fail(f"key {key!r} is in no scenario{nearest(key, list(known))}; `remoras explain` lists all keys")
    for name, (kind, meaning) in found.items():
        print(f"{name}  ({kind})\n    {meaning}")


@command("doctor")
def doctor() -> None:
    """Check this installation: versions, ontology, a short run, a figure."""
    import platform
    import tempfile
    from importlib import metadata

    import visualisation
    from missions import results
    from missions.run import run as run_scenario
    from missions.scenario import load

    print(f"Python {platform.python_version()} on {platform.platform()}")
    for name in ("remoras", *results.LIBRARIES):
        print(f"  {name} {metadata.version(name)}")
    short = run_scenario(load("mapping-rendezvous", [("--set", "scenario.duration_s=60")]))
    print(f"a run of 60 s of mission time took {short.wall_s:.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        results.write(short, Path(folder) / "run")
        drawn = visualisation.draw(results.Results.read(Path(folder) / "run"), (), Path(folder), "png")
        print(f"drew {len(drawn)} files")
    print("ok")


def _not_available(name: str) -> None:
    @app.command(name, hidden=True, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
    def unavailable() -> None:
        fail(f"{name} is not available in this version")


for _name, _function in cli_batch.COMMANDS.items():
    command(_name)(_function)
for _name in ("replay", "live", "export"):
    _not_available(_name)


def main() -> None:
    """Entry point of the ``remoras`` command."""
    app()
