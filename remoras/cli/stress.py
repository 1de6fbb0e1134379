"""The command that lets random faults befall the fleet: stress."""

from __future__ import annotations

import itertools
import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from missions.errors import LONGEST_VALUE, cut
from remoras.cli.app import FAILED, Json, as_typed, command, fail, show_json
from remoras.cli.runs import Settings, StrategyName
from remoras.progress import Progress

UNITS_S = {"s": 1.0, "m": 60.0, "h": 3600.0}
DEFAULT_SEEDS = "1:20"
MOST_SEEDS = 10_000_000
ANSWERS_HOLD = "stress.invariants.answers:AnswersHold"


def seeds_of(text: str) -> range:
    """Seeds of ``1:1000``, both ends included, or of ``17``.

    >>> seeds_of("3:5"), seeds_of("17")
    (range(3, 6), range(17, 18))
    """
    found = re.fullmatch(r"(\d{1,15})(?::(\d{1,15}))?", text)
    low, high = (int(found[1]), int(found[2] or found[1])) if found else (1, 0)
    if low > high or high - low >= MOST_SEEDS:
        fail(f"--seeds {cut(text, LONGEST_VALUE)!r}: allowed are a seed, or the first and the last, such as 1:1000")
    return range(low, high + 1)


def time_of(text: str) -> float:
    """Seconds of ``90s``, ``10m`` or ``2h``.

    >>> time_of("10m"), time_of("90")
    (600.0, 90.0)
    """
    found = re.fullmatch(r"(\d{1,6}(?:\.\d{1,3})?)([smh]?)", text)
    if found is None or float(found[1]) <= 0.0:
        fail(f"--time {cut(text, LONGEST_VALUE)!r}: allowed are seconds, minutes or hours such as 90s, 10m or 2h")
    return float(found[1]) * UNITS_S[found[2] or "s"]


@command("stress", "remoras stress mapping-rendezvous --strategy cbba --seeds 1:200 --jobs 2 --out results/stress")
def stress(
    scenario: Annotated[str, typer.Argument(metavar="[SCENARIO]", help="Shipped scenario or TOML file.")] = "",
    strategy: StrategyName = None,
    seeds: Annotated[str | None, typer.Option(metavar="A:B", help="Seeds of schedules; 1:20 if left out.")] = None,
    limit: Annotated[
        str | None, typer.Option("--time", metavar="10m", help="Begin no further seed after this time.")
    ] = None,
    faults: Annotated[str, typer.Option(metavar="KIND,...", help="Kinds, or families, that may befall it.")] = "",
    invariants: Annotated[
        list[str] | None, typer.Option("--invariant", metavar="FILE.py:NAME", help="Add an invariant of your own.")
    ] = None,
    answers: Annotated[
        bool, typer.Option("--answers", help="Ask whoever says how long an answer holds every time, and compare.")
    ] = False,
    settings: Settings = None,
    drawn: Annotated[
        str, typer.Option("--settings", metavar="none|all|NAME,...", help="Settings that are drawn beside the faults.")
    ] = "all",
    replay: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Repeat the schedule of a file instead, byte for byte.")
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, max=1024, metavar="N", help="Processes on this machine.")] = os.cpu_count()
    or 1,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for report and schedules.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace what is already in --out.")] = False,
    as_json: Json = False,
) -> None:
    """Let random faults befall the fleet in random settings, and see what holds all the same; shrink what does not."""
    added = (*(invariants or ()), *((ANSWERS_HOLD,) if answers else ()))
    if replay is not None:
        _replay(replay, scenario, added, as_json)
        return
    if not scenario:
        fail("SCENARIO: missing; name a shipped scenario or a TOML file, or give --replay FILE")
    numbers: Iterable[int] = itertools.count(1) if seeds is None and limit else seeds_of(seeds or DEFAULT_SEEDS)
    limit_s = None if limit is None else time_of(limit)
    from missions.files import SCENARIO, file_of, shipped

    file_of(SCENARIO, scenario, shipped())  # a name that is mistyped is told before much is loaded
    from missions.runs.folder import check_output, new_content
    from missions.scenarios import load
    from missions.scenarios.named import importable
    from stress.campaign import campaign
    from stress.drawing import plan_of
    from stress.reporting import as_value, lines, write_report
    from stress.schedule import overrides
    from stress.shipped import invariants_of

    if out is not None:
        check_output(out, force)
    kinds = [part.strip() for part in faults.split(",") if part.strip()]
    strategy = importable(strategy) if strategy else ""
    invariants_of(load(scenario, overrides(strategy, settings or ())), added)  # before a long run
    plan = plan_of(scenario, strategy, settings or (), kinds, drawn)
    total = len(numbers) if isinstance(numbers, range) else 0
    with Progress(f"stress {scenario}", total, "schedules") as progress:
        report = campaign(plan, numbers, added, jobs, limit_s, lambda n: progress.of(n, max(total, n)))
    if out is not None:
        with new_content(out, last=None) as draft:
            write_report(report, draft)
    if as_json:
        show_json(as_value(report))
    else:
        print("\n".join(lines(report)))
        for name in report.shrunk if out is not None else ():
            assert out is not None
            shrunk = as_typed(out / f"shrunk-{name}.toml")
            print(f"repeat it with: remoras stress --replay {shrunk}", file=sys.stderr)
            seed = report.shrunk[name].schedule.stress.seed
            alone = f"remoras run {as_typed(out / f'shrunk-{name}.scenario.toml')} --seed {seed}"
            print(f"run its scenario with: {alone}", file=sys.stderr)
    if report.broken:
        raise typer.Exit(FAILED)


def _replay(file: Path, scenario: str, added: tuple[str, ...], as_json: bool) -> None:
    """Repeat the schedule of a file."""
    from missions.errors import ConfigurationError, ConfigurationFault
    from stress.campaign import judge
    from stress.reporting import replay_lines, replay_report
    from stress.schedule import read_schedule

    schedule = read_schedule(file)
    if scenario and scenario != schedule.stress.scenario:
        fault = ConfigurationFault("stress.scenario", f'"{schedule.stress.scenario}"', f"the command names {scenario}")
        raise ConfigurationError(str(file), [fault])
    outcome = judge(schedule, added)
    if as_json:
        show_json(replay_report(outcome))
    else:
        print("\n".join(replay_lines(outcome)))
    if outcome.broken is not None:
        raise typer.Exit(FAILED)
