"""Cost of a sweep over the runs it makes, its gain from a second process, the size of its trajectories, and the cost
of a run of the shipped comparison of strategies."""

from __future__ import annotations

import io
import itertools
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa

from benchmarks.measuring import row
from missions.files import shipped_studies
from missions.runs.run import run
from missions.runs.tables import arrow_table, write_runs
from missions.sweeps.driver import sweep
from missions.sweeps.plan import SweepPlan
from missions.sweeps.study import Study, load_study
from missions.sweeps.worker import run_task
from remoras.recorder import TRAJECTORIES

REPEATS = 12
TRIES = 2
MEASURED_ROWS, STATED_ROWS = 1_000_000, 8_000_000

COMPARISON = "strategies-under-loss"
RUNS_PER_STRATEGY = 3
RUN_LIMIT_S = 0.5

STUDY = f"""
[study]
name = "benchmark"
scenario = "mapping-rendezvous"
policies = ["ack", "mps-ack"]
repeats = {REPEATS}

[[channel]]
name = "bernoulli"
per = [0.2, 0.4]
"""


def study() -> Study:
    """48 runs of the whole mission."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(STUDY, encoding="utf-8")
        return load_study(str(path))


def bare_loop_s(of: Study) -> float:
    """Wall seconds of the runs of a study, one after another, with nothing kept."""
    tasks = list(SweepPlan(of).missing({}))
    began = time.perf_counter()
    for task in tasks:
        run(task.scenario, task.seed)
    return time.perf_counter() - began


def sweep_s(of: Study, jobs: int) -> float:
    """Wall seconds of the sweep, from its start to its last table."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        sweep(of, Path(folder) / "out", jobs)
        return time.perf_counter() - began


def trajectory_bytes(of: Study) -> tuple[int, int]:
    """(rows, bytes) of the trajectories of at least a million rows, as the sweep keeps them: different runs all."""
    plan, buffer, n_rows = SweepPlan(of), io.BytesIO(), 0

    def runs() -> Iterator[pa.Table]:
        nonlocal n_rows
        for number in itertools.count():
            task = plan.task(number % len(of.configurations), number // len(of.configurations))
            table = arrow_table(TRAJECTORIES, run(task.scenario, task.seed).recorder.trajectories, task.key)
            n_rows += table.num_rows
            yield table
            if n_rows >= MEASURED_ROWS:
                return

    write_runs(buffer, arrow_table(TRAJECTORIES, [], "key").schema, runs())
    return n_rows, len(buffer.getvalue())


def mean_run_s(of: Study) -> float:
    """Mean CPU seconds of a run, over configurations of every strategy that are evenly spaced in the study.

    The last repeats are measured: like nearly all of the study they keep no tables.
    """
    plan, by_strategy = SweepPlan(of), dict[str, list[int]]()
    for number, configuration in enumerate(of.configurations):
        by_strategy.setdefault(configuration.scenario.strategy.name, []).append(number)
    total_s = 0.0
    for numbers in by_strategy.values():
        n_runs = min(RUNS_PER_STRATEGY, len(numbers))
        tasks = [plan.task(numbers[(2 * k + 1) * len(numbers) // (2 * n_runs)], of.maximum - 1) for k in range(n_runs)]
        began = time.process_time()
        for task in tasks:
            run_task(task)
        total_s += (time.process_time() - began) / n_runs * len(numbers)
    return total_s / len(of.configurations)


def comparison_rows() -> list[dict[str, Any]]:
    """Cost of a run of the comparison; nothing where this version does not ship it."""
    if COMPARISON not in shipped_studies():
        return []
    value_s = mean_run_s(load_study(COMPARISON))
    name = f"run of {COMPARISON}, mean"
    return [row(name, value_s, "s CPU", "limit", RUN_LIMIT_S)]


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some tries, the three measured in turn."""
    of = study()
    tries = [(bare_loop_s(of), sweep_s(of, 1), sweep_s(of, 2)) for _ in range(TRIES)]
    bare_s, one_s, two_s = (min(column) for column in zip(*tries, strict=True))
    n_rows, n_bytes = trajectory_bytes(of)
    size_mb = n_bytes / n_rows * STATED_ROWS / 1e6
    return [
        row("sweep of 48 missions, 1 process", one_s, "s", "bare loop", bare_s),
        row("sweep of 48 missions, 2 processes", two_s, "s", "1 process", one_s, one_s / two_s),
        row(f"8 M trajectory rows, from {n_rows / 1e6:.2f} M", size_mb, "MB", "limit", 60.0),
        *comparison_rows(),
    ]
