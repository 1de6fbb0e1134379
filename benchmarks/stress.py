"""Cost of a trial of ``remoras stress``: with all invariants, with none, and a bare run of the same scenario.

Seeds draw schedules of faults. Each is run in turn with and without the invariants; so is the same seed without its
faults, beside a bare run with its summary. The ratios of a seed are taken from the least CPU of some tries, and the row
has the median over the seeds.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from functools import partial
from typing import Any

from benchmarks.measuring import least_s, row
from missions.runs.run import run
from missions.runs.summary import summary
from missions.scenarios import load
from stress.drawing import plan_of, schedule_of
from stress.invariants.seam import Invariant
from stress.schedule import Schedule
from stress.shipped import invariants_of
from stress.trial import run_trial

SCENARIO = "mapping-rendezvous"
SEEDS = range(1, 10)
TRIES = 3
GOAL = 1.30


def bare_run(schedule: Schedule) -> None:
    """The scenario of a schedule, run as ``remoras run`` does, and its figures."""
    summary(run(schedule.scenario(), schedule.stress.seed))


def trial(schedule: Schedule, invariants: Sequence[type[Invariant]]) -> None:
    """A trial of which all invariants hold, for after one that is broken it would end."""
    if (broken := run_trial(schedule, invariants).broken) is not None:
        raise RuntimeError(f"seed {schedule.stress.seed} breaks {broken.invariant}: {broken.text}")


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: each has the median of the ratios over the seeds, and of the times."""
    plan, invariants = plan_of(SCENARIO), invariants_of(load(SCENARIO))
    struck, calm = [], []
    for seed in SEEDS:
        schedule = schedule_of(plan, seed)
        without = schedule.with_faults(())
        struck.append(least_s(partial(trial, schedule, invariants), partial(trial, schedule, ()), repeats=TRIES))
        calm.append(least_s(partial(trial, without, invariants), partial(bare_run, without), repeats=TRIES))
    return [
        _row("trial under faults, all invariants", "no invariants", struck),
        _row("trial without faults, all invariants", "bare run", calm),
    ]


def _row(name: str, reference: str, pairs: Sequence[Sequence[float]]) -> dict[str, Any]:
    value_s, reference_s = (statistics.median(column) for column in zip(*pairs, strict=True))
    ratio = statistics.median(value_s / reference_s for value_s, reference_s in pairs)
    return row(name, value_s, "s CPU", reference, reference_s, ratio, f"<= {GOAL:g} x")
