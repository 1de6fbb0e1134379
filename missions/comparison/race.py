"""Race of strategies on a scenario: drop the beaten, until one is within a margin of the best or the runs are spent.

**Looks.** All strategies have the same seeds. A look after 8 repeats, and after each doubling, drops beaten strategies
(Maron and Moore 1994; Birattari et al. 2002). Look k tests at 5 % / 2^k: by Bonferroni all looks together err in at
most 5 % of races, wherever a race ends.

**Beaten**: significantly worse than the best strategy, in the metric or in success, by the step-down test of all pairs
(``missions.comparison.ranking``).

**Lead** of the best: its least lead over another strategy, as a share of the other's mean. To lead by more than q means
a value below 1 - q times the other's. For a given q all ordered pairs form one step-down family, since the data select
the leader. The interval holds all q that the family does not reject.
"""

from __future__ import annotations

import itertools
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from missions.comparison.ranking import (
    Column,
    Rank,
    column_ranks,
    columns_of,
    differences_of,
    family_of,
    rankable,
)
from missions.comparison.treatments import MISSION_TIME, SIGNIFICANT, SUCCESS, Treatment, treatments_of
from missions.document import Document
from missions.errors import OutputError
from missions.metric import Metric
from missions.statistics import FEW, Interval, step_down_p
from missions.sweeps.driver import ReportProgress, sweep
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import LEDGER, read_ledger
from missions.sweeps.study import Study, study_of

BISECTIONS = 13  # of the leads from -1 to 1: bounds to 0.03 %
Place = tuple[float, str]  # mean loss rate and strategy


@dataclass(frozen=True, kw_only=True)
class RaceLine:
    """Result at one mean loss rate.

    Args:
        winner: best strategy; None if no run completes and the metric is a time.
        certain: all others are beaten, or the winner is within the margin of the best.
        runner_up: strategy over which the winner leads least; None if all others complete significantly less often.
        lead: lead over it as a share of its mean; its 95 % interval is of the least lead, over whichever strategy.
        runs, cpu_s: number and CPU time (s) of the runs.
        undecided: strategies that are not significantly worse than the winner.
        ranks: of each strategy at its last look; tests of a look have its level.
    """

    per: float
    winner: str | None
    certain: bool
    runner_up: str | None
    lead: float | None
    lead_low: float
    lead_high: float
    runs: int
    cpu_s: float
    undecided: tuple[str, ...]
    ranks: tuple[Rank, ...]


def race_study(scenario: str, strategies: Sequence[str], per: Sequence[float], seed: int, repeats: int) -> Study:
    """Return the study of a race with at most ``repeats``; an empty ``per`` stands for the loss of the scenario.

    Raises OutputError for a single strategy, ConfigurationError if the scenario does not allow a loss or a strategy.
    """
    if len(strategies) < 2:
        raise OutputError(f"--strategy {', '.join(strategies)}: a race takes at least two strategies")
    design = {"name": "race", "scenario": scenario, "strategies": list(strategies), "repeats": repeats, "seed": seed}
    tables = {"study": {**design, "keep_tables": 0}, "grid": {"channel.per": list(per)} if per else {}}
    return study_of(Document.of_tables(tables, f"race of {scenario}"))


def lead_of(column: Column, leader: str, metric: Metric, level: float) -> tuple[str, float, Interval]:
    """Return the least lead of a strategy over another one: that one, the lead, its interval cut to -1..1."""
    sign, samples = metric.sign, {treatment.strategy: own for treatment, (own, _) in column.items()}
    means = {name: own.mean for name, own in samples.items()}
    leads = {name: sign * (1.0 - means[leader] / mean) if mean else 0.0 for name, mean in means.items()}
    runner_up = min(leads.keys() - {leader}, key=lambda name: (leads[name], name))
    least = round(leads[runner_up], 4)
    repeats = sorted({repeat for own in samples.values() if not own.constant for repeat in own.values})
    if not repeats:
        return runner_up, least, (least, least)
    rows = {name: own.row(repeats) for name, own in samples.items()}
    pairs = list(itertools.permutations(rows, 2))
    own = [number for number, pair in enumerate(pairs) if pair[0] == leader]

    def least_sign(lead: float) -> float:
        """Return 1 if the leader leads all others by more, -1 if one by less, 0 if neither is significant."""
        differences = [sign * differences_of((1.0 - sign * lead) * rows[other], rows[ours]) for ours, other in pairs]
        p, sums = np.array(step_down_p(np.array(differences).T)), np.sum(differences, axis=1)
        return float(np.min(np.where(p < level, np.sign(sums), 0.0)[own]))

    low = _last(lambda lead: least_sign(lead) > 0.0, -1.0, 1.0)
    return runner_up, least, (low, _last(lambda lead: least_sign(lead) < 0.0, 1.0, -1.0))


def _last(holds: Callable[[float], bool], inside: float, outside: float) -> float:
    """Return the last lead from ``inside`` towards ``outside`` at which a condition holds."""
    for _ in range(BISECTIONS):
        middle = (inside + outside) / 2.0
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return round(inside, 4)


def line_of(
    column: Column, metric: Metric, level: float, within: float, beaten: Sequence[Rank], costs: Sequence[float]
) -> RaceLine:
    """Return the result of a look at a column, with strategies beaten before and the CPU time (s) of each run."""
    ranks = column_ranks(column, family_of([column]), metric, level)
    best, *others = ranks = sorted(ranks, key=lambda rank: rank.rank)
    # Work of strategies that complete less often is not compared.
    equal = {rank.strategy for rank in ranks if not rank.unequal_success}
    runner_up, lead, (low, high) = None, None, (0.0, 1.0)
    if len(equal) > 1:
        field = {treatment: own for treatment, own in column.items() if treatment.strategy in equal}
        runner_up, lead, (low, high) = lead_of(field, best.strategy, metric, level)
    completes = best.success_rate > 0.0 or metric.name != MISSION_TIME
    undecided = tuple(rank.strategy for rank in others if rank.among_best)
    return RaceLine(
        per=best.per,
        winner=best.strategy if completes else None,
        certain=low >= -within or not undecided,
        runner_up=runner_up,
        lead=lead,
        lead_low=low,
        lead_high=high,
        runs=len(costs),
        cpu_s=round(sum(costs), 1),
        undecided=undecided,
        ranks=(*ranks, *beaten),
    )


class Race:
    """State of a race at several mean loss rates: repeats, strategies that still race, results of the last look."""

    def __init__(self, places: Iterable[Place], metric: Metric, within: float) -> None:
        self.repeats = dict.fromkeys(places, 0)
        self.lines: dict[float, RaceLine] = {}
        self._racing = set(self.repeats)
        self._metric, self._within, self._level = metric, within, SIGNIFICANT

    def advance(self, n_runs: int) -> bool:
        """Raise the repeats of the strategies that race, within a number of runs; False if the race is over."""
        if not self._racing:
            return False
        more = min(max(FEW, *(self.repeats[place] for place in self._racing)), n_runs // len(self._racing))
        if more > 0:
            self.repeats |= {place: self.repeats[place] + more for place in self._racing}
        return more > 0

    def look(self, columns: Iterable[Column], costs: Mapping[float, Sequence[float]]) -> None:
        """Drop beaten strategies at each loss; ``costs`` are the CPU times (s) of its runs."""
        self._level /= 2.0
        for column in columns:
            racing = {place: own for place, own in column.items() if (place.per, place.strategy) in self._racing}
            if racing:
                self._look(next(iter(column)).per, racing, costs)

    def _look(self, per: float, column: Column, costs: Mapping[float, Sequence[float]]) -> None:
        beaten = [rank for rank in self.lines[per].ranks if not rank.among_best] if per in self.lines else []
        line = line_of(column, self._metric, self._level, self._within, beaten, costs[per])
        self.lines[per] = line
        left = {rank.strategy for rank in line.ranks if rank.among_best and not line.certain}
        self._racing -= {place for place in self._racing if place[0] == per and place[1] not in left}


def race(
    study: Study,
    folder: Path,
    budget: int,
    within: float,
    metric_name: str = MISSION_TIME,
    jobs: int = 1,
    time_s: float | None = None,
    progress: ReportProgress | None = None,
) -> list[RaceLine]:
    """Race the strategies of a study of ``race_study``, a line per loss rate; the same call resumes in the folder.

    Args:
        budget: maximum runs over all loss rates; at least 8 per strategy and loss.
        within: share of the best mean by which a certain winner may be worse.
        time_s: limit (s) on the duration, kept as far as the first look and the speed of its runs permit.

    Raises OutputError for a budget too small, a metric that is unknown, without preferred direction or without value;
    else as ``sweep``.
    """
    metric = rankable(metric_name, study.metrics)
    places = [
        (part.scenario.channel.mean_per(part.scenario.deployment), part.scenario.strategy.name)
        for part in study.configurations
    ]
    if budget < FEW * len(places):
        needed = f"{FEW} of each strategy at each loss"
        raise OutputError(f"--budget {budget}: allowed: {FEW * len(places)} runs or more, {needed}")
    began_s, n_before = time.perf_counter(), len(read_ledger(folder / LEDGER))
    state, made = Race(places, metric, within), 0
    while state.advance(budget - made):
        sweep(study, folder, jobs, progress=progress, repeats_of=[state.repeats[place] for place in places])
        results = SweepResults.read(folder)
        # A resumed race has the runs of later looks already.
        costs: dict[float, list[float]] = defaultdict(list)
        for line in results.lines.values():
            per, strategy = line["summary"]["per"], line["summary"]["strategy"]
            if line["repeat"] < state.repeats[per, strategy]:
                costs[per].append(line["machine"]["cpu_s"] or 0.0)
        made = sum(map(len, costs.values()))
        treatments = {
            treatment: {repeat: run for repeat, run in runs.items() if repeat < state.repeats[_place(treatment)]}
            for treatment, runs in treatments_of(results).items()
        }
        columns = columns_of(treatments, metric, results.metrics[SUCCESS])
        if absent := set(places) - {_place(treatment) for column in columns for treatment in column}:
            raise OutputError(f"--metric {metric.name}: has no value in the runs of {min(absent)[1]}; name another one")
        state.look(columns, costs)
        if time_s is not None and (new := len(results.lines) - n_before):
            budget = min(budget, made + int(new * (time_s / (time.perf_counter() - began_s) - 1.0)))
    return [state.lines[per] for per in dict.fromkeys(per for per, _ in places)]


def _place(treatment: Treatment) -> Place:
    return treatment.per, treatment.strategy
