"""Scoring: what a strategy's runs come to.

The efficiency of a run is a time that nobody beats over the time that it took, ``T_bound / T``; a run that has not
completed counts the suite's limit for T. The score is the mean of the cells' means.

All n-th runs are one instance: one fleet and one seed, on the grounds of the suite or on one drawn ground. Cells share
what is drawn, so an instance gives one value, its mean over the cells, and n counts instances. Intervals are those of
paired differences (``missions.comparison.intervals.difference_interval``); of fewer than 8 instances there is none.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from missions.benchmark.suite import Cell
from missions.comparison.intervals import NoInterval, difference_interval
from missions.statistics import Interval

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
        """Its 95 % interval; None of few instances."""
        return _over_instances(self.by_instance.values())[1]

    @cached_property
    def by_instance(self) -> dict[int, float]:
        """Mean efficiency over the cells by instance, as far as all cells have it."""
        return _by_instance([{run.repeat: run.efficiency for run in runs} for runs in self.cells.values()])

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
            {run.repeat: run.efficiency - twin.efficiency for run, twin in zip(runs, self.cells[at], strict=True)}
            for cell, runs in self.cells.items()
            if cell.network == network and (at := cell._replace(network=other)) in self.cells
        ]
        return _over_instances(_by_instance(pairs).values())


def against(one: Scored, other: Scored) -> tuple[float, Interval | None]:
    """Score of a strategy minus that of another over the instances that both have, and its interval."""
    both = one.by_instance.keys() & other.by_instance.keys()
    return _over_instances([one.by_instance[at] - other.by_instance[at] for at in sorted(both)])


def _by_instance(cells: Sequence[Mapping[int, float]]) -> dict[int, float]:
    values: dict[int, list[float]] = defaultdict(list)
    for cell in cells:
        for repeat, value in cell.items():
            values[repeat].append(value)
    return {repeat: _mean(own) for repeat, own in values.items() if len(own) == len(cells)}


def _over_instances(values: Collection[float]) -> tuple[float, Interval | None]:
    interval = difference_interval(list(values))
    if isinstance(interval, NoInterval):
        return _mean(list(values)), None
    return _mean(list(values)), (round(interval[0], DIGITS), round(interval[1], DIGITS))


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def _mean_of(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return _mean(known) if known else None
