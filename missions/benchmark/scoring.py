"""Scoring: what a strategy's runs come to.

The efficiency of a run is a time that nobody beats over the time that it took, ``T_bound / T``; a run that has not
completed counts the suite's limit for T. The score is the mean of the cells' means. Its 95 % interval is a bootstrap
stratified by cell: the runs of each cell are drawn anew, so it says what other seeds may give, not other cases.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from missions.benchmark.suite import Cell
from missions.statistics import CONFIDENCE, RESAMPLES, Interval, generator

DIGITS = 6
"""Of what cards say."""


@dataclass(frozen=True)
class CellRun:
    """How one run of a cell ended.

    Attributes:
        repeat, seed: of the run.
        bound_s: time that nobody beats in it.
        time_s: that it took; the limit if it has not completed.
        n_bytes, wrong_belief_fraction: bytes sent, and share of wrong beliefs of who does a job; None if it failed.
        failed: the strategy raised, or ended its process.
        silenced: decisions that took too long, whose vehicles were asked no more and sent nothing from then on.
    """

    repeat: int
    seed: int
    bound_s: float
    time_s: float
    completed: bool
    n_bytes: float | None
    wrong_belief_fraction: float | None
    failed: bool = False
    silenced: int = 0

    @property
    def efficiency(self) -> float:
        """Share 0..1 of the speed that nobody exceeds."""
        return self.bound_s / self.time_s


@dataclass(frozen=True)
class Scored:
    """A strategy with its runs.

    Attributes:
        name: of the strategy; reference: by which it was named.
        cells: runs of each cell, in the order of their repeats.
    """

    name: str
    reference: str
    cells: Mapping[Cell, Sequence[CellRun]]

    @property
    def runs(self) -> list[CellRun]:
        """All runs."""
        return [run for runs in self.cells.values() for run in runs]

    @cached_property
    def by_cell(self) -> dict[Cell, float]:
        """Mean efficiency of each cell."""
        return {cell: _mean([run.efficiency for run in runs]) for cell, runs in self.cells.items()}

    @property
    def score(self) -> float:
        """Mean of the cells' means."""
        return _mean(list(self.by_cell.values()))

    @cached_property
    def interval(self) -> Interval | None:
        """Its 95 % interval; None where a cell has a single run."""
        return bootstrap([[run.efficiency for run in runs] for runs in self.cells.values()])

    @property
    def worst(self) -> Cell:
        """The cell of the least mean efficiency."""
        return min(self.by_cell, key=lambda cell: (self.by_cell[cell], cell))

    @property
    def completed_share(self) -> float:
        """Share of the runs that completed."""
        return _mean([float(run.completed) for run in self.runs])

    @property
    def mean_bytes(self) -> float | None:
        """Mean of the bytes sent in a run."""
        return _mean_of([run.n_bytes for run in self.runs])

    @property
    def mean_wrong(self) -> float | None:
        """Mean share of wrong beliefs of who does a job."""
        return _mean_of([run.wrong_belief_fraction for run in self.runs])

    def difference(self, network: str, other: str) -> tuple[float, Interval | None]:
        """Efficiency with one network minus that with another, all else equal, and its interval; runs are paired."""
        pairs = [
            [run.efficiency - twin.efficiency for run, twin in zip(runs, self.cells[at], strict=True)]
            for cell, runs in self.cells.items()
            if cell.network == network and (at := cell._replace(network=other)) in self.cells
        ]
        return _mean([_mean(values) for values in pairs]), bootstrap(pairs)


def against(one: Scored, other: Scored) -> tuple[float, Interval | None]:
    """Score of a strategy minus that of another over the repeats that both have, and its interval; runs are paired."""
    pairs = []
    for cell, runs in one.cells.items():
        theirs = {run.repeat: run.efficiency for run in other.cells[cell]}
        pairs.append([run.efficiency - theirs[run.repeat] for run in runs if run.repeat in theirs])
    return _mean([_mean(values) for values in pairs]), bootstrap(pairs)


def bootstrap(strata: Sequence[Sequence[float]]) -> Interval | None:
    """Interval of the mean of the strata's means, by percentiles; None where a stratum has less than two values.

    A mean of n values drawn anew varies by sqrt((n - 1) / n) of what a mean of n does: so much more is taken.

    >>> bootstrap([[0.5, 0.5], [0.7, 0.7]])
    (0.6, 0.6)
    >>> bootstrap([[0.5]])
    """
    if not strata or min(map(len, strata)) < 2:
        return None
    draws = generator()
    means: npt.NDArray[np.float64] = np.zeros(RESAMPLES)
    for values in strata:
        n, mean = len(values), _mean(values)
        anew = np.array(values)[draws.integers(0, n, (RESAMPLES, n))].mean(axis=1)
        means += (mean + math.sqrt(n / (n - 1)) * (anew - mean)) / len(strata)
    tail = 100.0 * (1.0 - CONFIDENCE) / 2.0
    low, high = np.percentile(means, [tail, 100.0 - tail])
    return round(float(low), DIGITS), round(float(high), DIGITS)


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _mean_of(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return _mean(known) if known else None
