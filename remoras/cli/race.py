"""Command that finds the best strategy for a scenario: race."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from remoras.cli.app import FAILED, N_JOBS, Jobs, Json, aligned, command, fail, note, show
from remoras.cli.runs import ScenarioName, Seed, load, strategies_option
from remoras.cli.sweeps import making

if TYPE_CHECKING:
    from missions.comparison.race import RaceLine
    from missions.metric import Metric
    from missions.scenarios import Scenario

RUNS_PER_LOSS, MOST_PER_LOSS = 150, 2000  # default budget, without and with --time
TIME = re.compile(r"(\d+(?:\.\d+)?)([smh]?)")


@command("race", "remoras race mapping-rendezvous --strategy mine.py:MINE --per 0,0.4,0.8 --jobs 2")
def race(
    scenario: ScenarioName,
    strategies: Annotated[list[str] | None, strategies_option("Strategy to race with the shipped ones")] = None,
    only: bool = False,
    per: str | None = None,
    within: Annotated[float, typer.Option(min=0.0, max=1.0)] = 0.03,
    budget: Annotated[
        int | None, typer.Option(min=1, metavar="RUNS", help=f"Maximum runs; default: {RUNS_PER_LOSS} for each loss.")
    ] = None,
    time: str | None = None,
    metric: str = "mission_time_s",
    seed: Seed = 1,
    out: Path | None = None,
    jobs: Jobs = N_JOBS,
    as_json: Json = False,
) -> None:
    """Find the best strategy for a scenario: drop beaten ones until one is surely within 3 % of the best.

    Options:
        only: Race only the strategies named by --strategy.
        per (RATE,RATE): Packet error rates, each 0 to below 1; default: that of the scenario.
        within (SHARE): Stop at a winner that is surely within this share of the best.
        time (TIME): Maximum duration, as 90s, 2m or 1h, once each strategy has 8 runs; default: none.
        metric (METRIC): Field of the summary to rank by.
        out (DIR): Folder for the runs; the same folder resumes a race.
    """
    loaded = load(scenario)
    from missions.comparison.race import race as raced
    from missions.comparison.race import race_study
    from missions.comparison.ranking import rankable
    from missions.scenarios.parts import entrants
    from missions.statistics import FEW
    from remoras.strategies import bounds
    from remoras.strategies import strategies as known

    rates = list(dict.fromkeys(per.split(","))) if per is not None else []
    for rate in rates:
        load(scenario, [("--per", f"channel.per={rate}")])
    own = entrants(strategies or ())
    if ranked := sorted(bounds() & set(own)):
        fail(f"--strategy {ranked[0]}: an upper bound, which no strategy can reach; leave it out")
    others = () if only else [name for name in known() if name not in {*bounds(), *own}]
    limit_s = _seconds(time)
    runs = budget or (RUNS_PER_LOSS if limit_s is None else MOST_PER_LOSS) * max(1, len(rates))
    study = race_study(scenario, [*others, *own], [float(rate) for rate in rates], seed, runs)
    for line in _not_applied(loaded, [part.scenario for part in study.configurations]):
        note(line)
    ranked_by, first = rankable(metric, study.metrics), FEW * len(study.configurations)
    if runs >= first:  # the race refuses fewer
        note(f"at most {runs} runs; beaten strategies are dropped after the first {first}")
    with TemporaryDirectory() if out is None else nullcontext(str(out)) as folder:
        with making(f"race {scenario}", out) as progress:
            lines = raced(study, Path(folder), runs, within, metric, jobs, limit_s, progress)
        failed = list(_failures(Path(folder)))
    show([asdict(line) for line in lines], as_json, _race_lines(lines, ranked_by, within))
    if failed:
        for line in failed:
            note(line)
        raise typer.Exit(FAILED)


def _not_applied(own: Scenario, racing: Sequence[Scenario]) -> Iterator[str]:
    """Yield a line per parameter in the scenario's file that strategies lack."""
    for key in own.strategy.parameters:
        tables = (scenario.strategy for scenario in racing)
        if lacking := dict.fromkeys(table.name for table in tables if key not in table.parameters):
            yield f"strategy.parameters.{key} is not applied to {', '.join(lacking)}: no such parameter"


def _seconds(text: str | None) -> float | None:
    if text is None:
        return None
    if not (found := TIME.fullmatch(text)):
        fail(f"--time {text}: allowed: a duration as 90s, 2m or 1h")
    return float(found[1]) * {"": 1.0, "s": 1.0, "m": 60.0, "h": 3600.0}[found[2]]


def _failures(folder: Path) -> Iterator[str]:
    from missions.sweeps.folder import SweepResults

    failed: dict[str, list[str]] = {}
    for line in SweepResults.read(folder).lines.values():
        if line["error"]:
            failed.setdefault(line["summary"]["strategy"], []).append(line["error"].strip().splitlines()[-1])
    for name, errors in failed.items():
        yield f"{len(errors)} runs of {name} failed and count as not completed: {errors[0]}"


def _race_lines(lines: Sequence[RaceLine], metric: Metric, within: float) -> Iterator[str]:
    from missions.comparison.table import number

    yield f"Best by {metric.name}; all statements of a line hold with 95 % confidence."
    rows = [("per", "winner", "lead over the next [95 %]", "certainty", "not decided", "runs", "CPU s")]
    for line in lines:
        certain = (
            f"within {100.0 * within:g}" if line.certain else f"only within {100.0 * max(0.0, -line.lead_low):.1f}"
        )
        named = f"{line.per:g}", line.winner or "none: no run completes", _lead(line, metric)
        rows.append(
            (*named, f"{certain} % of the best", ", ".join(line.undecided) or "-", f"{line.runs}", f"{line.cpu_s:.0f}")
        )
    yield from aligned(rows, (5, 6))
    for line in lines:
        yield f"\nper {line.per:g}"
        ranks = [("strategy", "n", "completed", "mean", "p", "")]
        for own in line.ranks:
            p = "-" if own.p_to_best is None else f"{own.p_to_best:.2g}"
            counts = f"{own.n}", f"{100.0 * own.success_rate:.0f} %", number(own.mean), p
            ranks.append((own.strategy, *counts, "" if own.among_best else "beaten"))
        yield from aligned(ranks, (1, 2, 3))


def _lead(line: RaceLine, metric: Metric) -> str:
    """Return the lead, as in ``0.4 % shorter than remoras [-0.6 to +1.1]``."""
    from missions.metric import Better

    if line.lead is None or line.winner is None:
        return "-"
    lead, low, high = (f"{100.0 * value:+.1f}" for value in (line.lead, line.lead_low, line.lead_high))
    shorter, longer = ("shorter", "longer") if metric.unit == "s" else ("lower", "higher")
    word = shorter if (metric.better is Better.LOWER) is (line.lead >= 0.0) else longer
    return f"{lead[1:]} % {word} than {line.runner_up} [{low} to {high}]"
