"""Do intervals cover what they say, and is somebody told from the best no more often than said? Simulated studies.

    python -m benchmarks.intervals --studies 1000 --figure docs/images/coverage.png

Every row is a procedure of ``remoras compare`` on studies that are made up, of which the truth is known. Times have a
mean of 1; a share of the runs does not get there, and counts with the horizon of 4. The same seed gives the same rows.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

from missions.comparison.intervals import (
    Estimated,
    NoInterval,
    Timed,
    mean_interval,
    restricted_difference_interval,
    restricted_interval,
)
from missions.comparison.ranking import Contender, column_ranks
from missions.comparison.treatments import Treatment
from missions.metric import Better
from missions.statistics import Array

HORIZON = 4.0
SHAPES: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "normal": lambda draws, n: draws.normal(1.0, 0.15, n),
    "lognormal s = 1": lambda draws, n: draws.lognormal(-0.5, 1.0, n),
    "exponential": lambda draws, n: draws.exponential(1.0, n),
}
"""Times of runs that get there."""
SHORT = {"normal": "norm", "lognormal s = 1": "logn", "exponential": "exp"}
"""Shapes on the ticks of the figure."""
NS, SHARES = (5, 10, 30), (0.0, 0.05, 0.2)
KS, RATES = (4, 10), (1.0, 0.95, 0.8)


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
    """How often somebody of k equal strategies was told from the best."""

    shape: str
    k: int
    n: int
    success: float
    told: float


def coverage(what: str, shape: str, n: int, share: float, n_studies: int, seed: int = 1) -> Coverage:
    """Simulate one row.

    Args:
        what: ``mean`` of values without a horizon, ``restricted`` mean, or paired ``difference`` of those.
        shape: of the values, a key of ``SHAPES``.
        n: runs of a study.
        share: of runs that do not get there.
        n_studies: how many are made up.
        seed: of all draws.
    """
    draws = np.random.Generator(np.random.Philox([seed, n, round(1000 * share), len(shape), len(what)]))
    own = SHAPES[shape]
    bounded = float(np.minimum(own(draws, 400_000), HORIZON).mean())
    truth = {"mean": 1.0, "restricted": (1.0 - share) * bounded + share * HORIZON, "difference": 0.0}[what]
    found: list[Estimated] = []
    for _ in range(n_studies):
        if what == "mean":
            found.append(mean_interval(list(own(draws, n))))
        elif what == "restricted":
            found.append(restricted_interval(_timed(draws, own(draws, n), share)))
        else:
            luck = own(draws, n)  # of the losses that both meet
            sides = [_timed(draws, luck * draws.lognormal(-0.02, 0.2, n), share) for _ in range(2)]
            found.append(restricted_difference_interval(*sides))
    intervals = [interval for interval in found if not isinstance(interval, NoInterval)]
    if not intervals:
        return Coverage(what, shape, n, share, n_studies, 0, None, None)
    covered = sum(low <= truth <= high for low, high in intervals) / len(intervals)
    width = median(high - low for low, high in intervals)
    return Coverage(what, shape, n, share, n_studies, len(intervals), covered, width)


def _timed(draws: np.random.Generator, times: Array, share: float) -> Timed:
    times = np.where(draws.random(len(times)) < share, HORIZON, np.minimum(times, HORIZON))
    return Timed(list(times), list(times < HORIZON), HORIZON)


def error_rate(shape: str, k: int, n: int, success: float, n_studies: int, seed: int = 1) -> ErrorRate:
    """Simulate studies of k equal strategies of which somebody is told from the best, in success or in time.

    Args:
        shape: of the times of runs that complete.
        k: strategies.
        n: repeats, which share half of their luck.
        success: probability that a run completes.
        n_studies: how many are made up.
        seed: of all draws.
    """
    draws = np.random.Generator(np.random.Philox([seed, k, n, round(1000 * success), len(shape)]))
    names = [Treatment("s", f"strategy {number}", "ack", "bernoulli", 0.1, ()) for number in range(k)]
    told = 0
    for _ in range(n_studies):
        times = SHAPES[shape](draws, n)[:, None] * 0.5 + 0.5 * SHAPES[shape](draws, n * k).reshape(n, k)
        completed = draws.random((n, k)) < success
        times = np.where(completed, np.minimum(times, HORIZON), HORIZON)
        column = {
            name: Contender(dict(enumerate(times[:, at])), dict(enumerate(completed[:, at].astype(float))))
            for at, name in enumerate(names)
        }
        told += not all(rank.among_best for rank in column_ranks(column, "mission_time_s", Better.LOWER))
    return ErrorRate(shape, k, n, success, told / n_studies)


def coverages(n_studies: int) -> Iterator[Coverage]:
    """All rows of coverage."""
    for n in NS:
        for shape in SHAPES:
            yield coverage("mean", shape, n, 0.0, n_studies)
            for what in ("restricted", "difference"):
                for share in SHARES:
                    yield coverage(what, shape, n, share, n_studies)


def error_rates(n_studies: int) -> Iterator[ErrorRate]:
    """All rows of errors."""
    for k in KS:
        for n in NS:
            for success in RATES:
                for shape in ("normal", "lognormal s = 1"):
                    yield error_rate(shape, k, n, success, n_studies)


def draw(found: Sequence[Coverage], errors: Sequence[ErrorRate], path: Path) -> None:
    """Coverage above, errors below, each with what was promised."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 5.0), layout="constrained")
    above, below = figure.subplots(2, 1)
    shown = [row for row in found if row.covered is not None]
    looks = {"mean": ("o", "#0072B2"), "restricted": ("s", "#D55E00"), "difference": ("^", "#009E73")}
    for what, (marker, colour) in looks.items():
        rows = [(at, row) for at, row in enumerate(shown) if row.what == what]
        covered = [100.0 * (row.covered or 0.0) for _, row in rows]
        above.plot([at for at, _ in rows], covered, marker, color=colour, markersize=4, label=what)
    above.axhspan(93.0, 97.0, color="0.9", zorder=0)
    above.axhline(95.0, color="0.6", linewidth=0.8, zorder=0)
    above.set(ylim=(88.0, 101.0), ylabel="covered (%)")
    above.set_xticks(range(len(shown)), [f"{r.n}, {SHORT[r.shape]}, {100 * r.share:g} %" for r in shown], rotation=90)
    above.set_xlabel("runs, shape of their times, share that does not get there", fontsize=7)
    above.tick_params(labelsize=6)
    above.legend(fontsize=7, ncols=3, loc="lower right", title="95 % interval of", title_fontsize=7)
    for k, colour in zip(KS, ("#0072B2", "#D55E00"), strict=True):
        rows_k = [(at, row) for at, row in enumerate(errors) if row.k == k]
        told = [100.0 * row.told for _, row in rows_k]
        below.plot([at for at, _ in rows_k], told, "o", color=colour, markersize=4, label=f"{k} equal strategies")
    below.axhline(5.0, color="0.6", linewidth=0.8)
    below.set(ylim=(0.0, 15.0), ylabel="somebody told\nfrom the best (%)")
    ticks = [f"{error.n}, {SHORT[error.shape]}, {100 * error.success:g} %" for error in errors]
    below.set_xticks(range(len(errors)), ticks, rotation=90)
    below.set_xlabel("runs, shape of their times, success rate", fontsize=7)
    below.tick_params(labelsize=6)
    below.legend(fontsize=7)
    figure.savefig(path, dpi=160)


def main() -> None:
    """Print the rows as tables of Markdown, and draw them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=300, help="studies that are made up for each row")
    parser.add_argument("--figure", type=Path, help="file to draw the rows into")
    given = parser.parse_args()
    found = list(coverages(given.studies))
    print("| interval of | times | n | did not get there | has one | covers | median width |")
    print("|---|---|---|---|---|---|---|")
    for row in found:
        had = f"{100 * row.n_intervals / row.n_studies:.1f} %"
        said = ["n too small", ""] if row.covered is None else [f"{100 * row.covered:.1f} %", f"{row.width:.2f}"]
        print(f"| {row.what} | {row.shape} | {row.n} | {100 * row.share:g} % | {had} | {said[0]} | {said[1]} |")
    errors = list(error_rates(given.studies))
    print("\n| strategies | times | n | success | somebody told from the best |\n|---|---|---|---|---|")
    for error in errors:
        print(f"| {error.k} | {error.shape} | {error.n} | {100 * error.success:g} % | {100 * error.told:.1f} % |")
    if given.figure is not None:
        draw(found, errors, given.figure)


if __name__ == "__main__":
    main()
