"""Estimate coverage of intervals and false positives of comparisons in simulated studies.

    python -m benchmarks.intervals --studies 1000

Each row applies a procedure of ``remoras compare`` to simulated studies with known truth. Times have a mean of 1; a
share of the runs is censored at the horizon of 4. Results are deterministic.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from statistics import median
from typing import NamedTuple

import numpy as np

from missions.comparison.race import Race
from missions.comparison.ranking import Contender, family_of
from missions.comparison.treatments import SIGNIFICANT, Measured, Treatment
from missions.runs.metrics import CORE_METRICS
from missions.statistics import (
    Array,
    Estimated,
    NoInterval,
    Timed,
    difference_interval,
    mean_interval,
    restricted_difference_interval,
    restricted_interval,
)

HORIZON = 4.0
SHAPES: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "normal": lambda draws, n: draws.normal(1.0, 0.15, n),
    "lognormal s = 1": lambda draws, n: draws.lognormal(-0.5, 1.0, n),
    "exponential": lambda draws, n: draws.exponential(1.0, n),
    "one in ten slow": lambda draws, n: (draws.normal(1.0, 0.03, n) + 0.6 * (draws.random(n) < 0.1)) / 1.06,
}
"""Times of runs that get there; the last as 2000 s, and 3200 s for one run in ten."""
NS, SHARES = (5, 8, 10, 20, 30), (0.0, 0.05, 0.2)
NS_OF_TESTS = (5, 8, 10, 20)
EQUAL = 7
"""Equal strategies of a study."""
CASES = {"all equal": (), "two far behind": (0.4, 1.2)}
"""How far other strategies are behind."""


class Coverage(NamedTuple):
    """How often intervals of one kind held: of ``n_studies`` those that had one are ``n_intervals``."""

    what: str
    shape: str
    n: int
    share: float
    n_studies: int
    n_intervals: int
    covered: float | None
    width: float | None


class ErrorRate(NamedTuple):
    """How often two of seven equal strategies were told apart."""

    shape: str
    case: str
    n: int
    success: float
    told: float


def coverage(what: str, shape: str, n: int, share: float, n_studies: int, seed: int = 1) -> Coverage:
    """Simulate one row.

    Args:
        what: ``mean`` of values without a horizon, paired ``shift`` of those, ``restricted`` mean, or paired
            ``difference`` of those.
        shape: of the values, a key of ``SHAPES``.
        n: runs of a study.
        share: of runs that do not get there.
        n_studies: how many are made up.
        seed: of all draws.
    """
    draws = np.random.Generator(np.random.Philox([seed, n, round(1000 * share), len(shape), len(what)]))
    own = SHAPES[shape]
    bounded = float(np.minimum(own(draws, 400_000), HORIZON).mean())
    truth = {"mean": 1.0, "restricted": (1.0 - share) * bounded + share * HORIZON, "difference": 0.0, "shift": 0.0}[
        what
    ]
    estimates: list[Estimated] = []
    for _ in range(n_studies):
        if what == "mean":
            estimates.append(mean_interval(list(own(draws, n))))
        elif what == "shift":
            estimates.append(difference_interval(list(own(draws, n) - own(draws, n))))
        elif what == "restricted":
            estimates.append(restricted_interval(_timed(draws, own(draws, n), share)))
        else:
            luck = own(draws, n)  # of the losses that both meet
            sides = [_timed(draws, luck * draws.lognormal(-0.02, 0.2, n), share) for _ in range(2)]
            estimates.append(restricted_difference_interval(*sides))
    intervals = [interval for interval in estimates if not isinstance(interval, NoInterval)]
    if not intervals:
        return Coverage(what, shape, n, share, n_studies, 0, None, None)
    covered = sum(low <= truth <= high for low, high in intervals) / len(intervals)
    width = median(high - low for low, high in intervals)
    return Coverage(what, shape, n, share, n_studies, len(intervals), covered, width)


def _timed(draws: np.random.Generator, times: Array, share: float) -> Timed:
    times = np.where(draws.random(len(times)) < share, HORIZON, np.minimum(times, HORIZON))
    return Timed(list(times), list(times < HORIZON), HORIZON)


def _drawn(
    draws: np.random.Generator, shape: str, size: tuple[int, int], behind: Sequence[float], success: float
) -> tuple[Array, Array]:
    """Times and completion by repeat and strategy, the last strategies behind; repeats share half of their luck."""
    n, k = size
    if shape == "unequal spreads":
        spreads = np.array([0.01, 0.01, 0.03, 0.03, 0.1, 0.1, 0.1, *([0.03] * len(behind))])[:k]
        times = 1.0 + spreads * draws.normal(size=(n, k)) + draws.normal(0.0, 0.03, (n, 1))
    else:
        times = SHAPES[shape](draws, n)[:, None] * 0.5 + 0.5 * SHAPES[shape](draws, n * k).reshape(n, k)
    times[:, k - len(behind) :] += behind
    completed = draws.random((n, k)) < success
    return np.where(completed, np.minimum(times, HORIZON), HORIZON), completed.astype(float)


def _names(k: int) -> list[Treatment]:
    return [Treatment("s", f"strategy {number}", "ack", "bernoulli", 0.1, ()) for number in range(k)]


def _column(times: Array, completed: Array, repeats: Sequence[int]) -> dict[Treatment, Contender]:
    return {
        name: Contender(Measured(dict(enumerate(times[:n, at]))), Measured(dict(enumerate(completed[:n, at]))))
        for at, (name, n) in enumerate(zip(_names(len(repeats)), repeats, strict=True))
    }


def error_rate(shape: str, case: str, n: int, success: float, n_studies: int, seed: int = 1) -> ErrorRate:
    """Simulate studies of seven equal strategies, and count those in which two are told apart, in success or in time.

    Args:
        shape: of the times of runs that complete; ``unequal spreads``: normal, with spreads of 1, 3 and 10 %.
        case: a key of ``CASES``.
        n: repeats, which share half of their luck.
        success: probability that a run completes.
        n_studies: how many are made up.
        seed: of all draws.
    """
    k = EQUAL + len(CASES[case])
    draws = np.random.Generator(np.random.Philox([seed, k, n, round(1000 * success), len(shape)]))
    told = 0
    for _ in range(n_studies):
        times, completed = _drawn(draws, shape, (n, k), CASES[case], success)
        family = family_of([_column(times, completed, [n] * k)])
        pairs = [frozenset(pair) for pair in combinations(_names(k)[:EQUAL], 2)]
        told += min(of[pair] for of in (family.of_metric, family.of_success) for pair in pairs) < SIGNIFICANT
    return ErrorRate(shape, case, n, success, told / n_studies)


def race_error(shape: str, equal: int, behind: Sequence[float], budget: int, n_studies: int, seed: int = 1) -> float:
    """Share of simulated races with a wrong statement.

    A statement is wrong if an equal best strategy is beaten, if a certain winner is more than 3 % behind, or if the
    interval of the lead misses it.

    Args:
        shape: of the times, as for ``error_rate``.
        equal: number of the best strategies.
        behind: how far the others are behind.
        budget: most runs of a race.
        n_studies: how many races are made up.
        seed: of all draws.
    """
    k, wrong = equal + len(behind), 0
    draws = np.random.Generator(np.random.Philox([seed, k, budget, len(shape)]))
    names, truth = [name.strategy for name in _names(k)], [1.0] * equal + [1.0 + far for far in behind]
    for _ in range(n_studies):
        times, completed = _drawn(draws, shape, (budget // 2, k), behind, 1.0)
        race, made = Race([(0.1, name) for name in names], CORE_METRICS[0], 0.03), 0
        while race.advance(budget - made):
            made = sum(race.repeats.values())
            race.look([_column(times, completed, list(race.repeats.values()))], {0.1: []})
        line = race.lines[0.1]
        left = {rank.strategy for rank in line.ranks if rank.among_best}
        winner = truth[names.index(str(line.winner))]
        lead = min(1.0 - winner / time for name, time in zip(names, truth, strict=True) if name != line.winner)
        wrong += (
            not left >= set(names[:equal])
            or (line.certain and winner > 1.03)
            or not line.lead_low - 0.001 <= lead <= line.lead_high + 0.001
        )
    return wrong / n_studies


def coverages(n_studies: int) -> Iterator[Coverage]:
    """All rows of coverage."""
    for n in NS:
        for shape in SHAPES:
            yield coverage("mean", shape, n, 0.0, n_studies)
            yield coverage("shift", shape, n, 0.0, n_studies)
            for what in ("restricted", "difference"):
                for share in SHARES:
                    yield coverage(what, shape, n, share, n_studies)


def error_rates(n_studies: int) -> Iterator[ErrorRate]:
    """All rows of errors."""
    for case in CASES:
        for n in NS_OF_TESTS:
            for shape in ("normal", "unequal spreads", "one in ten slow", "lognormal s = 1"):
                yield error_rate(shape, case, n, 1.0, n_studies)
            yield error_rate("normal", case, n, 0.8, n_studies)


def main() -> None:
    """Print the rows as tables of Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=300, help="studies that are made up for each row")
    given = parser.parse_args()
    table = list(coverages(given.studies))
    print("| interval of | times | n | did not get there | has one | covers | median width |")
    print("|---|---|---|---|---|---|---|")
    for row in table:
        had = f"{100 * row.n_intervals / row.n_studies:.1f} %"
        said = ["n too small", ""] if row.covered is None else [f"{100 * row.covered:.1f} %", f"{row.width:.2f}"]
        print(f"| {row.what} | {row.shape} | {row.n} | {100 * row.share:g} % | {had} | {said[0]} | {said[1]} |")
    errors = list(error_rates(given.studies))
    print("\n| others | times | n | success | two of seven equal told apart |\n|---|---|---|---|---|")
    for error in errors:
        print(f"| {error.case} | {error.shape} | {error.n} | {100 * error.success:g} % | {100 * error.told:.1f} % |")
    print("\n| others | times | races | with a wrong statement |\n|---|---|---|---|")
    for shape in ("normal", "one in ten slow"):
        n_races = max(1, given.studies // 4)
        wrong = 100.0 * race_error(shape, EQUAL, CASES["two far behind"], 200, n_races)
        print(f"| two far behind | {shape} | {n_races} | {wrong:.1f} % |")


if __name__ == "__main__":
    main()
