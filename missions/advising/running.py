"""Running: the runs of all shipped strategies on instances, by the sweeps: they resume, and use several processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import tomli_w

from missions.advising.instances import DURATION_S, SEED, drawn_scenario
from missions.disk import write_synced
from missions.document import Document
from missions.sweeps.driver import sweep
from missions.sweeps.folder import SweepResults
from missions.sweeps.ledger import FAILED
from missions.sweeps.pool import SupervisedPool
from missions.sweeps.study import Study, study_of

STRATEGIES = (
    "remoras", "remoras-planned", "plan-and-dispatch", "central", "contract-net", "cbba", "status-broadcast",
    "rendezvous-sync", "fixed-partition",
)  # fmt: skip
"""Shipped strategies that are told apart: neither the bound nor ``cbba-plain``, which is ``cbba`` with another plan."""
STRATEGY = "strategy.name"


STAGES: Sequence[tuple[Sequence[int], int]] = ((range(46), 2), (range(46, 65), 1), (range(65, 100), 2))
"""Instances and their repeats, in the order in which runs are made."""


def study_on(number: int, repeats: int, folder: Path) -> Study:
    """The runs of all strategies on an instance; its scenario is written into the folder."""
    path = instance_file(folder, number)
    write_synced(path, tomli_w.dumps(drawn_scenario(number)))
    tables = {
        "study": {
            "name": path.stem,
            "scenario": path.name,
            "strategies": list(STRATEGIES),
            "repeats": repeats,
            "seed": SEED * 1000 + number,
            "keep_tables": 0,
            "metrics": ["mission_time_s", "completed"],
        }
    }
    return study_of(Document.of_text(tomli_w.dumps(tables), str(path)))


def make(
    folder: Path,
    jobs: int,
    stages: Sequence[tuple[Sequence[int], int]] = STAGES,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Make the runs that the folder does not have yet.

    Args:
        folder: made if it is not there; after an interruption the same call goes on.
        jobs: processes.
        stages: numbers of instances, and how often each is repeated, one after another.
        progress: called with what is done, and with all, in instances of a stage.

    Raises:
        PartlyDoneError: see ``missions.sweeps.sweep``; the same call goes on.
    """
    folder.mkdir(parents=True, exist_ok=True)
    wanted = [(number, repeats) for numbers, repeats in stages for number in numbers]
    pool = SupervisedPool(jobs, preload="missions.sweeps.worker")
    try:
        for at, (number, repeats) in enumerate(wanted):
            runs = runs_of(folder, number)
            asked = SweepResults.read(runs).schedule.demand.repeats if runs.is_dir() else 0  # by a later stage before
            sweep(study_on(number, max(repeats, asked), folder), runs, jobs, executor=pool)
            if progress is not None:
                progress(at + 1, len(wanted))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def instance_file(folder: Path, number: int) -> Path:
    """Where the scenario of an instance is."""
    return folder / f"instance-{number:03d}.toml"


def runs_of(folder: Path, number: int) -> Path:
    """Where the runs on an instance are."""
    return folder / f"instance-{number:03d}"


def times_s(folder: Path, number: int) -> Mapping[str, Sequence[float]]:
    """Mission times (s) of each strategy on an instance, by repeat; ``DURATION_S`` where a run has not completed.

    Where nothing is drawn all repeats are one run.

    Raises:
        OutputError: the folder holds no runs.
    """
    found: dict[str, dict[int, float]] = {name: {} for name in STRATEGIES}
    for line in SweepResults.read(runs_of(folder, number)).lines.values():
        summary = line["summary"]
        completed = line["status"] != FAILED and bool(summary["completed"])
        found[line["settings"][STRATEGY]][line["repeat"]] = (
            float(summary["mission_time_s"]) if completed else DURATION_S
        )
    return {name: [by_repeat[repeat] for repeat in sorted(by_repeat)] for name, by_repeat in found.items()}
