"""Search parameters of strategies by successive halving (Jamieson, Talwalkar 2016).

All strategies get the same number of runs, the same cases and seeds that no shipped study uses. Round 1: a Latin
hypercube over the ranges of all parameters, and the defaults. Round 2: the best few on fresh seeds. Round 3: the best
against the defaults, on fresh seeds. The criterion is the mean mission time; a run without end counts with its whole
duration. The winner should replace the defaults if the 95 % interval of the paired difference is below zero.

A run with the same ``--out`` resumes an interrupted search.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from missions.comparison.treatments import MISSION_TIME, Measured, paired_with, treatments_of, values_of
from missions.files import toml_value
from missions.statistics import FEW, NoInterval
from missions.sweeps.driver import sweep
from missions.sweeps.folder import SweepResults
from missions.sweeps.study import load_study, points
from missions.sweeps.study_file import StudyFile
from remoras.strategies import Parameter, parameters, strategies
from remoras.strategy import Strategy

Value = bool | int | float | str
Range = tuple[float, float]

RANGES: Mapping[str, Range] = {
    "queue": (1, 6),
    "margin": (0.0, 0.3),
    "join_s": (0.0, 300.0),
    "acknowledge_rounds": (100, 1000),
    "bidding_rounds": (2, 6),
    "accept_rounds": (20, 120),
    "initiative_rounds": (3, 30),
    "looks_ahead": (False, True),
    "bundle": (1, 8),
    "settle_rounds": (0, 5),
    "repeat_rounds": (2, 15),
    "discount_s": (600.0, 10_000.0),
    "plans_for_all": (False, True),
    "period_rounds": (1, 8),
    "doubt_rounds": (10, 100),
    "jobs_per_leg": (1, 5),
    "meeting_radius_m": (20.0, 60.0),
    "fixed-partition.margin": (0.0, 0.5),
}
"""What is searched, by parameter, or by strategy and parameter where one name means different things."""

PREFIX = "strategy.parameters."
CASES = """
[study]
name = "tuning"
scenario = ["mapping-patches", "mapping-corridor"]
sampling = "list"
metrics = ["mission_time_s", "completed"]
keep_tables = 0
repeats = {repeats}
seed = {seed}

[[channel]]
name = "bernoulli"
per = [0.4, 0.8]

[[unforeseen]]
name = "speeds within 20 %"
[unforeseen.set]
"uncertainty.speed_spread" = 0.2

[[unforeseen]]
name = "one vehicle lost"
  [[unforeseen.fault]]
  vehicle = "any"
  kind = "lost"
  at_s = [300.0, 1500.0]
"""
"""The cases in which every point is judged, as a study without its points."""


@dataclass(frozen=True)
class Round:
    """A round of the search.

    Args:
        name: of its folder.
        seed: master seed of its runs, which no other round has.
        repeats: runs of each point in each case.
        cases: a study without its points.
    """

    name: str
    seed: int
    repeats: int
    cases: str = CASES


ROUNDS = (Round("first", 4001, 1), Round("second", 4002, 1), Round("last", 4003, FEW))
"""All points, the best ``KEPT`` of them, the best one beside the defaults in as many seeds as an interval takes."""
KEPT = 3
HYPERCUBE_SEED = 4000


@dataclass(frozen=True)
class Point:
    """A strategy with a value for each of its parameters, in the order in which it declares them."""

    strategy: str
    values: tuple[tuple[str, Value], ...]

    def __str__(self) -> str:
        shown = ((name, f"{value:.3g}" if isinstance(value, float) else str(value)) for name, value in self.values)
        return ", ".join(f"{name} {value}" for name, value in shown)

    @property
    def key(self) -> tuple[str, tuple[tuple[str, str], ...]]:
        """How the results of a sweep name it."""
        return self.strategy, tuple(sorted((PREFIX + name, str(value)) for name, value in self.values))


Times = Mapping[Point, Mapping[int, float]]
"""Mean time over the cases (s), by point and repeat."""
Evaluate = Callable[[Sequence[Point], Round], Times]


@dataclass(frozen=True)
class Verdict:
    """What the search found for a strategy.

    Args:
        default: its parameters as they are.
        found: the best point; the defaults themselves if none seemed better.
        default_s: mean time of the defaults in the last round they were in (s).
        found_s: the same of the best point.
        interval_s: 95 % interval of the paired difference; None if there is nothing to compare.
        n_pairs: seeds of the difference.
    """

    default: Point
    found: Point
    default_s: float
    found_s: float
    interval_s: tuple[float, float] | None = None
    n_pairs: int = 0

    @property
    def is_better(self) -> bool:
        """True if the best point should replace the defaults."""
        return self.interval_s is not None and self.interval_s[1] < 0.0

    def row(self) -> dict[str, Any]:
        """The verdict as JSON has it."""
        return {
            "strategy": self.default.strategy,
            "default": dict(self.default.values),
            "found": dict(self.found.values),
            "default_s": self.default_s,
            "found_s": self.found_s,
            "difference_s": self.found_s - self.default_s,
            "ci95_s": self.interval_s,
            "n_pairs": self.n_pairs,
            "is_better": self.is_better,
        }


def tuned(strategy: Strategy) -> tuple[Parameter, ...]:
    """The parameters of a strategy that are searched: those with a range; factors without one say what it is."""
    return tuple(key for key in parameters(strategy) if {key.name, f"{strategy.name}.{key.name}"} & RANGES.keys())


def tunable() -> dict[str, Strategy]:
    """The shipped strategies that have parameters to search, by name."""
    return {name: strategy for name, strategy in strategies().items() if tuned(strategy)}


def range_of(strategy: str, parameter: str) -> Range:
    """Lowest and highest value of a parameter that the search tries."""
    return RANGES.get(f"{strategy}.{parameter}") or RANGES[parameter]


def points_of(strategy: Strategy, n_points: int) -> list[Point]:
    """The defaults, and a Latin hypercube over the ranges of all parameters.

    Args:
        strategy: with parameters.
        n_points: of both together, 3 at least.
    """
    declared = tuned(strategy)
    file = StudyFile.model_validate(
        {
            "study": {"name": "points", "scenario": "any", "repeats": 1, "seed": HYPERCUBE_SEED, "sampling": "latin"}
            | {"samples": n_points - 1},
            "latin": {parameter.name: range_of(strategy.name, parameter.name) for parameter in declared},
        }
    )
    drawn = [
        tuple((one.name, type(one.default)(setting.value)) for one, setting in zip(declared, point, strict=True))
        for point in points(file)
    ]
    default = tuple((parameter.name, parameter.default) for parameter in declared)
    return [Point(strategy.name, values) for values in (default, *drawn)]


def search(chosen: Sequence[Strategy], n_points: int, evaluate: Evaluate) -> list[Verdict]:
    """Search the parameters of strategies; of points with equal means the earlier counts, the defaults first.

    Args:
        chosen: strategies with parameters.
        n_points: points of each in the first round.
        evaluate: makes the runs of a round.

    Returns:
        A verdict for each, in their order.
    """
    first, second, last = ROUNDS
    tried = {strategy.name: points_of(strategy, n_points) for strategy in chosen}
    times = evaluate([point for of_one in tried.values() for point in of_one], first)
    kept = {name: sorted(of_one, key=lambda point: _mean_s(times, point))[:KEPT] for name, of_one in tried.items()}
    times = evaluate([point for of_one in kept.values() for point in of_one], second)
    best = {name: min(of_one, key=lambda point: _mean_s(times, point)) for name, of_one in kept.items()}
    rivals = {name: point for name, point in best.items() if point != tried[name][0]}
    compared = evaluate([pair for name, point in rivals.items() for pair in (tried[name][0], point)], last)
    return [_verdict(tried[name][0], point, compared if name in rivals else times) for name, point in best.items()]


def _mean_s(times: Times, point: Point) -> float:
    return statistics.fmean(times[point].values())


def _verdict(default: Point, found: Point, times: Times) -> Verdict:
    means_s = _mean_s(times, default), _mean_s(times, found)
    if found == default:
        return Verdict(default, found, *means_s)
    paired = paired_with(Measured(times[found]), Measured(times[default]))
    interval = paired.interval if paired else NoInterval.TOO_FEW
    return Verdict(default, found, *means_s, None if isinstance(interval, NoInterval) else interval, len(times[found]))


def study_text(tried: Sequence[Point], of: Round) -> str:
    """The study of a round, as TOML."""
    text = of.cases.format(repeats=of.repeats, seed=of.seed)
    for point in tried:
        settings = [("strategy.name", point.strategy), *((PREFIX + name, value) for name, value in point.values)]
        text += "\n[[point]]\n" + "".join(f'"{key}" = {toml_value(value)}\n' for key, value in settings)
    return text


def swept(tried: Sequence[Point], of: Round, folder: Path, jobs: int) -> Times:
    """Make the runs of a round that its folder does not have yet.

    Args:
        tried: points, perhaps none.
        of: the round.
        folder: of the whole search.
        jobs: processes.

    Returns:
        Mean times; a run that failed counts with its whole duration, too.
    """
    if not tried:
        return {}
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{of.name}.toml"
    path.write_text(study_text(tried, of), encoding="utf-8")
    status = sweep(load_study(str(path)), folder / of.name, jobs)
    print(f"{of.name} round: {status}", file=sys.stderr, flush=True)
    results = SweepResults.read(folder / of.name)
    metric = results.metrics[MISSION_TIME]
    times: dict[Point, dict[int, list[float]]] = {}
    by_key = {point.key: point for point in tried}
    for treatment, runs in treatments_of(results).items():
        settings = tuple(pair for pair in treatment.settings if pair[0].startswith(PREFIX))
        of_point = times.setdefault(by_key[treatment.strategy, settings], {})
        for repeat, time_s in values_of(runs, metric).items():
            if repeat < of.repeats:
                of_point.setdefault(repeat, []).append(time_s)
    return {
        point: {repeat: statistics.fmean(times_s) for repeat, times_s in by_repeat.items()}
        for point, by_repeat in times.items()
    }


def table(verdicts: Sequence[Verdict]) -> str:
    """The verdicts as a table of Markdown."""
    lines = ["| strategy | default | best found | s | s | difference, s |", "|---|---|---|---|---|---|"]
    for verdict in verdicts:
        found, difference = "the defaults", ""
        if verdict.interval_s is not None:
            found = str(verdict.found)
            low, high = verdict.interval_s
            difference = f"{verdict.found_s - verdict.default_s:.0f} ({low:.0f} to {high:.0f})"
        lines.append(
            f"| `{verdict.default.strategy}` | {verdict.default} | {found} | {verdict.default_s:.0f} "
            f"| {verdict.found_s:.0f} "
            f"| {difference}{', better' if verdict.is_better else ''} |"
        )
    return "\n".join(lines)


def main(given: Sequence[str] | None = None) -> int:
    """Search the parameters of the named strategies, of all without a name, and print what was found."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.tuning", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    known = tunable()
    parser.add_argument("strategy", nargs="*", help=f"of {', '.join(known)}")
    parser.add_argument("--out", type=Path, required=True, help="folder of its runs")
    parser.add_argument("--points", type=int, default=12, help="points of each strategy in the first round, 12")
    parser.add_argument("--jobs", type=int, default=1, help="processes, 1")
    parser.add_argument("--json", action="store_true", help="print one JSON value and nothing else")
    arguments = parser.parse_args(given)
    unknown = sorted(set(arguments.strategy) - set(known))
    if unknown:
        parser.error(f"unknown strategy {', '.join(unknown)}: allowed are {', '.join(known)}")
    if arguments.points < 3:
        parser.error(f"--points {arguments.points}: 3 at least, the defaults and two others")
    if arguments.jobs < 1:
        parser.error(f"--jobs {arguments.jobs}: 1 at least")
    chosen = [known[name] for name in dict.fromkeys(arguments.strategy or known)]

    def evaluate(tried: Sequence[Point], of: Round) -> Times:
        return swept(tried, of, arguments.out, arguments.jobs)

    verdicts = search(chosen, arguments.points, evaluate)
    print(json.dumps([verdict.row() for verdict in verdicts], indent=2) if arguments.json else table(verdicts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
