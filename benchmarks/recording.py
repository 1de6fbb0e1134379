"""Cost of the record of a run: share of its CPU, in the run and in writing the folder; size of the folder of a run, and
of the tables that a sweep keeps of one."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.measuring import row, run_cpu_s, setup_of
from missions.runs.results import write_results
from missions.runs.run import run
from missions.runs.tables import encoded, merge_tables, write_part
from missions.scenarios import load
from remoras.collecting import rare_collections
from remoras.executive.layer import ExecutiveLayer
from remoras.fleet import Fleet
from remoras.radio import Radio
from remoras.recorder import Recorder, Rows
from remoras.run_log import RunLog

REPEATS = 7
PER, SEED = 0.6, 3
SAMPLE = 6
"""Runs of which a sweep keeps tables."""
SHARE, SIZE_BYTES, SAMPLED_BYTES = 0.10, 2 * 190_274, 61_000
"""Limits: of the CPU of the run; twice the folder of the same run before items and decisions were recorded; and what a
sweep keeps of each of six runs, which took 30,235 bytes before that and takes 60,614."""

WRITERS: tuple[tuple[type, tuple[str, ...]], ...] = (
    (RunLog, ("fault", "peers", "roles", "rulings", "plans", "drives", "weighs")),
    (Radio, ("_record_facts", "_record_item", "_record_fault")),
    (Fleet, ("_record",)),
)
"""Methods that do nothing but record."""


class _Nothing(Rows):
    """Rows that nobody keeps."""

    def __init__(self) -> None:
        super().__init__()
        self.append = self.extend = lambda given: None


@contextmanager
def no_record() -> Iterator[None]:
    """Let runs meanwhile record nothing."""
    kept: list[tuple[type, str, Any]] = []

    def put(owner: type, name: str, value: Any) -> None:
        kept.append((owner, name, getattr(owner, name)))
        setattr(owner, name, value)

    made: Callable[..., None] = Recorder.__init__

    def forgetful(self: Recorder, *given: Any) -> None:
        made(self, *given)
        for name in self.tables:
            self._rows[name] = _Nothing()
            if hasattr(self, name):
                setattr(self, name, self._rows[name])

    put(Recorder, "__init__", forgetful)
    put(Radio, "signals_of", lambda self, sent: ([], [], []))
    put(ExecutiveLayer, "candidates", lambda self, now_s: [])
    for owner, names in WRITERS:
        for name in names:
            put(owner, name, lambda self, *given: None)
    try:
        yield
    finally:
        for owner, name, value in reversed(kept):
            setattr(owner, name, value)


@rare_collections()
def written() -> tuple[float, int]:
    """(CPU seconds that writing the folder takes, its bytes)."""
    finished = run(load("mapping-rendezvous", [("--per", f"channel.per={PER}")]), SEED)
    times_s, size_bytes = [], 0
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made) / "run"
            began = time.process_time()
            write_results(finished, folder)
            times_s.append(time.process_time() - began)
            size_bytes = sum(path.stat().st_size for path in folder.iterdir())
    return min(times_s), size_bytes


def sampled_bytes() -> float:
    """Bytes of the tables that a sweep keeps of a run, mean over its sample."""
    with tempfile.TemporaryDirectory() as made:
        parts, tables = Path(made) / "parts", Path(made) / "tables"
        for seed in range(1, SAMPLE + 1):
            finished = run(load("mapping-rendezvous", [("--per", f"channel.per={PER}")]), seed)
            write_part(parts, f"{seed:016x}", encoded(finished.recorder, f"{seed:016x}"))
        merge_tables(parts, tables, {path.name for path in parts.iterdir()})
        return sum(path.stat().st_size for path in tables.iterdir()) / SAMPLE


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, with and without a record in turn."""
    setup = setup_of("mapping-rendezvous", f"channel.per={PER}")
    with_s, without_s = [], []
    for _ in range(REPEATS):
        with_s.append(run_cpu_s(setup, SEED)[0])
        with no_record():
            without_s.append(run_cpu_s(setup, SEED)[0])
    run_s, bare_s = min(with_s), min(without_s)
    write_s, size_bytes = written()
    return [
        row("record of a run, share of its CPU", (run_s - bare_s) / run_s, "1", "limit", SHARE),
        row("writing a run's folder, share of its CPU", write_s / run_s, "1", "limit", SHARE),
        row("folder of a run", size_bytes / 1000, "kB", "limit", SIZE_BYTES / 1000),
        row("tables of a run in a sweep", sampled_bytes() / 1000, "kB", "limit", SAMPLED_BYTES / 1000),
    ]
