"""Runs of strategies in the cells of a suite, as sweeps, their bounds and scores (``docs/benchmark.md``).

An instance has one value, its mean over the cells, which share its draws.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import fmean
from typing import Any

from missions.benchmark.suite import Cell, Suite
from missions.errors import OutputError
from missions.lower_bound import Rounds, least_time_s
from missions.runs.assembly import actual
from missions.runs.setup import resolved
from missions.scenarios import Scenario
from missions.scenarios.parts import entrants, strategy_named
from missions.statistics import Interval, NoInterval, difference_interval
from missions.sweeps.driver import ReportProgress, sweep
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import FAILED
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import Study
from remoras.database import VehicleData
from remoras.decision_timeout import MOST_CPU_S
from remoras.plugins import named_object

LONGEST_RUN_S = 600.0  # wall-clock limit of a run (s); runs take a few seconds, so a longer one hangs
WATCHED = {"watch.cpu_s": MOST_CPU_S}
GetRounds = Callable[..., Rounds]


DIGITS = 6


@dataclass(frozen=True)
class CellRun:
    """Result of one run of a cell; ``time_s`` is the limit if not completed.

    A ``failed`` run raised an error or ended its process; ``n_bytes`` and ``wrong_belief_fraction`` are then None.
    ``silenced`` counts decisions over the time limit, whose vehicles send nothing afterwards.
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
        """Efficiency, 0 to 1."""
        return self.bound_s / self.time_s


@dataclass(frozen=True)
class Scored:
    """Strategy with its runs in order of repeats; ``reference`` is the name given by the user."""

    name: str
    reference: str
    cells: Mapping[Cell, Sequence[CellRun]]

    @property
    def runs(self) -> list[CellRun]:
        """All runs."""
        return [run for runs in self.cells.values() for run in runs]

    @property
    def by_cell(self) -> dict[Cell, float]:
        """Mean efficiency of each cell."""
        return {cell: fmean([run.efficiency for run in runs]) for cell, runs in self.cells.items()}

    @property
    def score(self) -> float:
        """Mean of the cell means."""
        return fmean(list(self.by_cell.values()))

    @property
    def interval(self) -> Interval | None:
        """95 % interval of the score; None for few instances."""
        return _over_instances(self.by_instance.values())[1]

    @property
    def by_instance(self) -> dict[int, float]:
        """Mean efficiency over the cells by instance, for instances in all cells."""
        return _by_instance([{run.repeat: run.efficiency for run in runs} for runs in self.cells.values()])

    @property
    def worst(self) -> Cell:
        """Cell with the lowest mean efficiency."""
        # Of equally bad cells the first by name, so that a card has one text.
        return min(self.by_cell, key=lambda cell: (self.by_cell[cell], cell))

    @property
    def completed_share(self) -> float:
        """Share of completed runs."""
        return fmean([float(run.completed) for run in self.runs])

    def difference(self, network: str, other: str) -> tuple[float, Interval | None]:
        """Return the paired difference in efficiency between two networks, with its interval."""
        pairs = [
            {run.repeat: run.efficiency - twin.efficiency for run, twin in zip(runs, self.cells[peer], strict=True)}
            for cell, runs in self.cells.items()
            if cell.network == network and (peer := cell._replace(network=other)) in self.cells
        ]
        return _over_instances(_by_instance(pairs).values())


def against(first: Scored, other: Scored) -> tuple[float, Interval | None]:
    """Return the difference in score over common instances, with its interval."""
    both = first.by_instance.keys() & other.by_instance.keys()
    return _over_instances([first.by_instance[instance] - other.by_instance[instance] for instance in sorted(both)])


def variance_share(strategies: Sequence[Scored]) -> float:
    """Return the share of the variance of efficiency within a cell and instance that the strategy explains, 0 to 1.

    Sum of squares of the strategies' means over that of all common runs, without the means of cells and instances
    (two-way analysis of variance).

    >>> runs = {name: [CellRun(n, n, eff, 1.0, True, None, None) for n, eff in enumerate(effs)]
    ...         for name, effs in {"a": (0.2, 0.5), "b": (0.6, 0.7)}.items()}
    >>> round(variance_share([Scored(name, name, {Cell("", "", ""): of_one}) for name, of_one in runs.items()]), 6)
    0.9
    """
    known = [{(cell, run.repeat): run.efficiency for cell, runs in s.cells.items() for run in runs} for s in strategies]
    common = sorted(set.intersection(*(set(of_one) for of_one in known)))
    means = {key: fmean([of_one[key] for of_one in known]) for key in common}
    deviations = [[of_one[key] - means[key] for key in common] for of_one in known]
    total = math.fsum(deviation * deviation for of_one in deviations for deviation in of_one)
    explained = len(common) * math.fsum(fmean(of_one) * fmean(of_one) for of_one in deviations)
    return explained / total if total > 0.0 else 0.0


def _by_instance(cells: Sequence[Mapping[int, float]]) -> dict[int, float]:
    values: dict[int, list[float]] = defaultdict(list)
    for cell in cells:
        for repeat, value in cell.items():
            values[repeat].append(value)
    return {repeat: fmean(own) for repeat, own in values.items() if len(own) == len(cells)}


def _over_instances(values: Collection[float]) -> tuple[float, Interval | None]:
    interval = difference_interval(list(values))
    if isinstance(interval, NoInterval):
        return fmean(list(values)), None
    return fmean(list(values)), (round(interval[0], DIGITS), round(interval[1], DIGITS))


@dataclass(frozen=True)
class Contest:
    """Strategies (shipped names or ``package.module:object``) on the first repeats of a suite."""

    suite: Suite
    strategies: tuple[str, ...]
    repeats: int
    study: Study = field(repr=False)

    @cached_property  # caches the bound of each ground, which is costly
    def _bounds(self) -> Bounds:
        return Bounds(named_object(self.suite.about.bound))

    @classmethod
    def of(cls, suite: Suite, strategies: Iterable[str], repeats: int | None = None) -> Contest:
        """Create a contest of strategies named by the user, without duplicates.

        Raises PluginError for an unavailable strategy, OutputError for more repeats than the suite has,
        ConfigurationError if a scenario does not allow a case.
        """
        chosen = entrants(strategies)
        most = suite.about.repeats
        n = most if repeats is None else repeats
        if n > most:
            raise OutputError(f"--repeats {n}: allowed: 1 to {most}, as {suite.about.name} has")
        return cls(suite, chosen, n, suite.study(chosen, n, WATCHED))

    def make(self, folder: Path, jobs: int, progress: ReportProgress | None = None) -> None:
        """Make the missing runs in a folder; see ``missions.sweeps.sweep``."""
        sweep(self.study, folder, jobs, progress=progress, timeout_s=LONGEST_RUN_S)

    def scored(self, folder: Path) -> list[Scored]:
        """Return the strategies with their runs; raises OutputError for missing runs."""
        lines, schedule = SweepResults.read(folder).lines, SweepPlan(self.study).schedule
        summaries = {key: line["summary"] for key, line in lines.items()}
        scored = []
        for place, reference in enumerate(self.strategies):
            cells: dict[Cell, list[CellRun]] = {}
            for index, cell in enumerate(self.suite.cells):
                cells[cell] = []
                number = self.suite.number(index, place)
                for repeat in range(self.repeats):
                    # A deterministic configuration has fewer runs, of which the last stands for all later repeats.
                    made = schedule.repeats(number, summaries)
                    key = schedule.key(number, min(repeat, made - 1))
                    if key not in lines:
                        raise OutputError(f"{folder}: runs of {reference} are missing; the same command resumes")
                    cells[cell].append(self.run_of(lines[key], repeat, number))
            scored.append(Scored(strategy_named(reference).name, reference, cells))
        return scored

    def run_of(self, line: Mapping[str, Any], repeat: int, number: int) -> CellRun:
        """Return the result of a run from its ledger line."""
        summary, failed = line["summary"], line["status"] == FAILED
        seed = self.suite.seed(repeat)
        bound_s = self._bounds.bound_s(self.study.configurations[number].scenario, seed)
        completed = not failed and bool(summary["completed"])
        return CellRun(
            repeat,
            seed,
            bound_s,
            float(summary["mission_time_s"]) if completed else self.suite.about.limit_s,
            completed,
            summary.get("n_bytes"),
            summary.get("wrong_belief_fraction"),
            failed,
            int(summary.get("n_silenced") or 0),
        )


class Bounds:
    """Cached lower bounds of runs; ``rounds`` returns the minimum paths and work of a scenario."""

    def __init__(self, rounds: GetRounds) -> None:
        self._rounds = rounds
        self._known: dict[tuple[Rounds, float], float] = {}

    def bound_s(self, scenario: Scenario, seed: int) -> float:
        """Return the lower bound of the mission time (s) with the ground and the true vehicle speeds of a seed."""
        scenario = scenario.for_seed(seed)
        setup = resolved(scenario)
        fleet = tuple(actual(setup, data, seed) for data in setup.database.values())
        latest_s = max(((fault.span_s or (0.0, math.inf))[1] for fault in scenario.fault), default=-1.0)
        # Networks and kinds of faults do not enter the bound, so cells share it.
        key = self._rounds(scenario, fleet, True), latest_s
        if key not in self._known:
            self._known[key] = round(self._least_s(scenario, fleet, latest_s), 4)
        return self._known[key]

    def _least_s(self, scenario: Scenario, fleet: Sequence[VehicleData], latest_s: float) -> float:
        # A vehicle lost at time t need not attend the rendezvous, but works until t at most. Every other vehicle can
        # attend in any time of at least t plus the way home, so a bound of that size without rendezvous proves the one
        # with it.
        meeting = self._rounds(scenario, fleet, True)
        least_s = least_time_s(meeting)
        if latest_s < 0.0:
            return least_s
        home_s = max(max(vehicle.home_m) / vehicle.transit_mps for vehicle in meeting.vehicles)
        alone_s = least_time_s(self._rounds(scenario, fleet, False))
        return least_s if alone_s >= latest_s + home_s else alone_s
