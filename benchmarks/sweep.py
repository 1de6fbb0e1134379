"""Cost of a sweep over the runs it makes, its gain from a second process, and the size of its trajectories."""

from __future__ import annotations

import io
import itertools
import tempfile
import time
from pathlib import Path
from typing import Any

from missions.plan import Plan
from missions.run import run
from missions.step_tables import packed, writer
from missions.study import Study, load_study
from missions.sweep import sweep

REPEATS = 12
TRIES = 2
MEASURED_ROWS, STATED_ROWS = 1_000_000, 8_000_000

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
    tasks = list(Plan(of).missing({}))
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
    plan, buffer, n_rows = Plan(of), io.BytesIO(), 0
    with writer(buffer, "trajectories") as out:
        for number in itertools.count():
            task = plan.task(number % len(of.configurations), number // len(of.configurations))
            trajectories = run(task.scenario, task.seed).recorder.trajectories
            out.write_table(packed("trajectories", trajectories, task.key))
            n_rows += len(trajectories)
            if n_rows >= MEASURED_ROWS:
                break
    return n_rows, len(buffer.getvalue())


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some tries, the three measured in turn."""
    of = study()
    tries = [(bare_loop_s(of), sweep_s(of, 1), sweep_s(of, 2)) for _ in range(TRIES)]
    bare_s, one_s, two_s = (min(column) for column in zip(*tries, strict=True))
    n_rows, n_bytes = trajectory_bytes(of)
    size_mb = n_bytes / n_rows * STATED_ROWS / 1e6
    return [
        _row("sweep of 48 missions, 1 process", one_s, "s", "bare loop", bare_s, one_s / bare_s),
        _row("sweep of 48 missions, 2 processes", two_s, "s", "1 process", one_s, one_s / two_s),
        _row(f"8 M trajectory rows, from {n_rows / 1e6:.2f} M", size_mb, "MB", "limit", 60.0, size_mb / 60.0),
    ]


def _row(name: str, value: float, unit: str, reference: str, reference_value: float, ratio: float) -> dict[str, Any]:
    return {
        "name": name,
        "value": value,
        "unit": unit,
        "reference": reference,
        "reference_value": reference_value,
        "ratio": ratio,
    }
