"""Commands that run one mission: run, live."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from remoras.cli import completion
from remoras.cli.app import FAILED, Json, as_typed, command, fail, note, show_json
from remoras.process import Progress

if TYPE_CHECKING:
    from missions.runs.results import MemoryResults
    from missions.scenarios import Scenario
    from remoras.api import Run as Finished

NUMBERS = (
    ("goal reached", "goal_fraction", 100.0, "%"),
    ("distance travelled", "distance_m", 0.001, "km"),
    ("energy", "energy_j", 0.001, "kJ"),
    ("packets delivered", "delivery_ratio", 100.0, "%"),
    ("mean latency", "mean_latency_s", 1.0, "s"),
    ("closest approach", "closest_approach_m", 1.0, "m"),
)
"""Printed metrics of a run after its end, most important first: label, key in summary, scale, unit."""
MOST_OUT = 6  # printed times of vehicles out of the mission

ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Shipped scenario or TOML file, changed by options.",
        autocompletion=completion.scenario,
    ),
]
StrategyName = Annotated[
    str | None, typer.Option(metavar="NAME", help="Organisational strategy.", autocompletion=completion.strategy_name)
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
        help="Measured network: a shipped name, TOML or CSV file; also sets the channel.",
        autocompletion=completion.network,
    ),
]
ErrorRate = Annotated[
    str | None, typer.Option(metavar="RATE", help="Packet error rate of bernoulli or matrix, 0 to below 1.")
]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of all random draws: 0, 1, 2, ...")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Override a key; see `explain`.", autocompletion=completion.setting
    ),
]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for all results; default: none.")]
Force = Annotated[bool, typer.Option("--force", help="Replace results that are already in --out.")]
Overrides = Sequence[tuple[str, str]]
"""Option as given, and KEY=VALUE."""


def strategies_option(use: str) -> Any:
    """Return the option ``--strategy`` of a command for several; its help begins with their use."""
    help = f"{use}: a shipped name, mine.py:MINE or package.module:object."
    return typer.Option("--strategy", metavar="NAME", help=help, autocompletion=completion.strategy)


def load(scenario: str, overrides: Overrides = ()) -> Scenario:
    """Load a scenario; report an unknown name before heavy imports."""
    from missions.files import SCENARIO, file_of, shipped

    file_of(SCENARIO, scenario, shipped())
    from missions.scenarios import load as load_scenario

    return load_scenario(scenario, overrides)


def set_keys(settings: Sequence[str] | None) -> list[tuple[str, str]]:
    """Return the overrides of ``--set``."""
    return [("--set", setting) for setting in settings or ()]


def overrides_of(
    strategy: str | None,
    policy: str | None,
    channel: str | None,
    network: str | None,
    per: str | None,
    settings: Sequence[str] | None,
) -> Overrides:
    """Return the overrides of the options of a run."""
    from missions.files import keys_of_options

    options = keys_of_options(strategy, policy, channel, network, per)
    return [*((f"--{option}", f"{key}={value}") for option, key, value in options), *set_keys(settings)]


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
    out: Out = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Run a mission scenario and print its summary; write all results with --out."""
    loaded = load(scenario, overrides_of(strategy, policy, channel, network, per, settings))
    from missions.disk import check_output
    from missions.runs.results import MemoryResults, write_results
    from missions.runs.run import run as run_scenario

    # Before the run, whose result would be lost otherwise.
    if out is not None:
        check_output(out, force)
    with Progress(f"run {loaded.scenario.name}", loaded.scenario.duration_s, "s of mission time") as progress:
        finished = run_scenario(loaded, seed, progress=progress.at)
    results = MemoryResults(finished)
    if out is not None:
        write_results(results, out, force)
    if as_json:
        show_json(results.summary)
    else:
        _print_summary(results.figures, list(_out(results)), results.ended_s)
        kept = f"results in {out}; see: remoras plot {as_typed(out)}, or why, replay, report" if out is not None else ""
        print(kept or "all metrics and milestones: add --json, or --out DIR")
    if not finished.completed:
        raise typer.Exit(FAILED)


def _out(results: MemoryResults) -> Iterator[str]:
    """Yield which vehicles were out of the mission, or went home on their last energy, in time order."""
    from missions.fault import EMPTY, Absence, absence, absences
    from remoras.recorder import NO_HEADWAY

    rows = [(row["time_s"], row["vehicle"], row["kind"], row["detail"]) for row in results.rows("faults")]
    changes = []
    for at_s, vehicle, is_away in absences(rows):
        kinds = [row[2] for row in rows if row[:2] == (at_s, vehicle) and absence(row[2]) is not None]
        of_kind = absence(kinds[0])
        if not is_away:
            changes.append((at_s, vehicle, "joined" if of_kind is Absence.BEFORE else "back"))
        elif of_kind is not Absence.BEFORE:
            lost = "out of energy" if EMPTY in kinds else "lost"
            changes.append((at_s, vehicle, "off" if of_kind is Absence.PAUSE else lost))
    rows_home = [row for row in results.rows("decisions") if row["chosen"] and "ReturningHome" in row["activities"]]
    homing = {row["vehicle"]: row["time_s"] for row in reversed(rows_home)}  # the first of each
    changes += [(at_s, vehicle, "turned home on its last energy") for vehicle, at_s in homing.items()]
    changes += [(at_s, vehicle, "made no headway") for at_s, vehicle, _, detail in rows if detail.endswith(NO_HEADWAY)]
    yield from (f"{vehicle} {what} at {at_s:.0f} s" for at_s, vehicle, what in sorted(changes))


def _print_summary(report: dict[str, Any], out: Sequence[str], end_s: float) -> None:
    print(f"{'completed':<20} {'yes' if report['completed'] else 'no'}")
    if report["reason"]:
        print(f"{'reason':<20} {report['reason']}")
    if out:
        more = f", and {len(out) - MOST_OUT} more" if len(out) > MOST_OUT else ""
        print(f"{'out':<20} {', '.join(out[:MOST_OUT])}{more}")
    print(f"{'mission time' if report['completed'] else 'ended at':<20} {end_s:.1f} s")
    for label, key, scale, unit in NUMBERS:
        value = report.get(key)
        print(f"{label:<20} {f'{value * scale:.1f} {unit}' if isinstance(value, float | int) else 'none'}")


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
    out: Out = None,
    force: Force = False,
    port: Annotated[int, typer.Option(min=0, max=65535)] = 0,
    no_browser: bool = False,
) -> None:
    """Watch a running mission in a local web page, with start, pause, step and speed.

    Options:
        port (PORT): Port of the page; 0 takes a free one.
        no_browser: Do not open a browser.
    """
    loaded = load(scenario, overrides_of(strategy, policy, channel, network, per, settings))
    import threading
    import webbrowser

    from missions.disk import check_output
    from missions.errors import MissionsError
    from remoras.cli.live import LiveRun, LiveServer
    from remoras.stepped import Stepping
    from visualisation.replay import live_text

    def keep(finished: Finished) -> str:
        if out is None:
            return "without --out, the results are not kept"
        try:
            return f"results in {finished.save(out, force)}"
        except MissionsError as error:
            return f"the results are not kept: {error}"

    if out is not None:
        check_output(out, force)
    table = loaded.scenario
    with Stepping(loaded, seed) as stepping:
        run = LiveRun(stepping, table.duration_s, keep)
        try:
            server = LiveServer(run, live_text(f"{table.name}, seed {seed} - live"), port)
        except OSError as error:
            fail(f"--port {port}: cannot be listened on: {error.strerror}; name another, or 0 for any that is free")
        threading.Thread(target=server.serve_forever, daemon=True).start()
        print(server.url, flush=True)
        note("Ctrl-C ends it")
        if not no_browser:
            webbrowser.open(server.url)
        with suppress(KeyboardInterrupt):  # the usual end
            run.serve()
    if not run.is_over and out is not None:
        note(f"the run has not ended; nothing is written to {out}")
