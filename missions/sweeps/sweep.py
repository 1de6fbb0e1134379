"""Sweep: make all runs that a study asks for and that its folder does not have yet.

The engine is any ``concurrent.futures.Executor``. It gets chunks of 0.5 to 2 s; what comes back goes to the log at
once. A chunk whose process died is split, so that the run at fault is found: it is tried alone a few times and then
logged as failed, while all others go on.
"""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from missions.errors import DiskFullError, MissionsError, OutputError
from missions.sweeps.cluster import cluster_executor
from missions.sweeps.execution import Finished, killed, run_chunk, run_task
from missions.sweeps.plan import Plan, Task
from missions.sweeps.pool import SupervisedPool, WorkersCannotStart
from missions.sweeps.runlog import RunLog, Status, SweepResults
from missions.sweeps.study import Study

CHUNK_S = 1.0
MAX_CHUNK = 200
MAX_ATTEMPTS = 3
"""Times that a run is tried alone before it counts as the one that kills its process."""
AHEAD = 2
"""Chunks that are given out for every process of the executor."""
TIMED_RUNS = 3


class PartlyDoneError(MissionsError):
    """The sweep stopped before its end; what is finished is kept, and the same command goes on from there."""


@dataclass(frozen=True)
class Estimate:
    """Answer of a dry run: runs that are still to make, at most, and the time they will take."""

    planned: int
    estimate_s: float


Progress = Callable[[int, int], None]
"""Is told the number of finished runs and of planned runs."""


def estimate(study: Study, jobs: int) -> Estimate:
    """Count the runs of a study and time a few of them, without writing anything."""
    plan = Plan(study)
    planned = study.n_runs
    numbers = sorted({round(share * (len(study.configurations) - 1) / TIMED_RUNS) for share in range(TIMED_RUNS + 1)})
    began = time.perf_counter()
    for number in numbers:
        run_task(plan.task(number, 0))
    return Estimate(planned, round(planned * (time.perf_counter() - began) / len(numbers) / jobs, 1))


def sweep(
    study: Study,
    folder: Path,
    jobs: int = 1,
    cluster: str | None = None,
    executor: Executor | None = None,
    force_new: bool = False,
    progress: Progress | None = None,
) -> Status:
    """Make the runs that ``folder`` does not have yet.

    Args:
        jobs: processes on this machine.
        cluster: address of a Dask scheduler to use instead.
        executor: any other executor to use instead, with ``jobs`` processes.
        force_new: set the runs of another study aside.

    Raises:
        PartlyDoneError: the engine was lost or the disk is full; run again to go on.
        StudyChangedError, OutputError, ClusterError: nothing was begun.
    """
    plan = Plan(study)
    try:
        log = RunLog(folder, plan, force_new)
    except DiskFullError as error:
        raise PartlyDoneError(str(error)) from None
    try:
        if next(plan.missing(log.summaries), None) is not None:
            with _engine(jobs, cluster, executor) as (engine, n_processes):
                _drive(engine, n_processes, plan, log, progress)
        log.compact()
    except WorkersCannotStart as error:
        raise OutputError(
            f"no worker can start: {error}, before its first run; a script that calls sweep does so below "
            "if __name__ == '__main__': since every worker loads the script again"
        ) from None
    except (BrokenExecutor, CancelledError, OSError) as error:
        _compact_if_possible(log)
        raise PartlyDoneError(f"the workers or their scheduler were lost ({type(error).__name__})") from None
    except OutputError as error:
        raise PartlyDoneError(str(error)) from None
    except KeyboardInterrupt:
        _compact_if_possible(log)
        raise
    finally:
        log.close()
    return SweepResults.read(folder).status()


def _compact_if_possible(log: RunLog) -> None:
    """What is finished, as far as the disk takes it; the ledger has it all."""
    with suppress(OutputError):
        log.compact()


@contextmanager
def _engine(jobs: int, cluster: str | None, executor: Executor | None) -> Iterator[tuple[Executor, int]]:
    """(executor, number of its processes), shut down at the end if it was made here."""
    if executor is not None:
        yield executor, jobs
    elif cluster is not None:
        with cluster_executor(cluster) as found:
            yield found
    else:
        pool = SupervisedPool(jobs, preload="missions.sweeps.execution")
        try:
            yield pool, jobs
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _drive(executor: Executor, n_processes: int, plan: Plan, log: RunLog, progress: Progress | None) -> None:
    """Give out chunks and log what comes back until nothing is missing."""
    waiting = deque(plan.missing(log.summaries))
    busy: dict[Future[list[Finished]], list[Task]] = {}
    attempts: Counter[str] = Counter()
    suspects: set[str] = set()
    run_s: float | None = None
    while waiting or busy:
        while waiting and len(busy) < AHEAD * n_processes:
            chunk = _next_chunk(waiting, suspects, run_s, n_processes)
            busy[executor.submit(run_chunk, plan.schedule.version, chunk)] = chunk
        ready, _ = wait(busy, return_when=FIRST_COMPLETED)
        finished: list[Finished] = []
        for future in ready:
            chunk = busy.pop(future)
            try:
                finished += future.result()
            except Exception as error:
                if not _is_death(error):
                    raise
                finished += _blamed(chunk, error, attempts, suspects, waiting)
        log.append(finished)
        for run in finished:
            if (wall_s := run.line["machine"]["wall_s"]) is not None:
                run_s = wall_s if run_s is None else 0.8 * run_s + 0.2 * wall_s
        if not waiting:
            waiting.extend(plan.missing(log.summaries, {task.key for chunk in busy.values() for task in chunk}))
        if progress is not None:
            progress(len(log.lines), plan.schedule.count(log.summaries))


def _next_chunk(waiting: deque[Task], suspects: set[str], run_s: float | None, n_processes: int) -> list[Task]:
    """The next tasks, about ``CHUNK_S`` of work, fewer towards the end; a suspect goes alone."""
    share = math.ceil(len(waiting) / (AHEAD * n_processes))
    size = 1 if run_s is None else max(1, min(MAX_CHUNK, share, round(CHUNK_S / max(run_s, 1e-6))))
    chunk = [waiting.popleft()]
    while len(chunk) < size and waiting and not suspects.intersection((chunk[0].key, waiting[0].key)):
        chunk.append(waiting.popleft())
    return chunk


def _is_death(error: Exception) -> bool:
    """Whether a process died with the chunk, as our pool and Dask say it."""
    if isinstance(error, WorkersCannotStart):
        return False
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


def _blamed(
    chunk: list[Task], error: Exception, attempts: Counter[str], suspects: set[str], waiting: deque[Task]
) -> list[Finished]:
    """Put the tasks of a dead chunk back, each on its own from now on; a run that was alone too often has failed.

    Dask has tried a chunk several times before it gives it up, so there once is often.
    """
    if len(chunk) == 1:
        attempts[chunk[0].key] += MAX_ATTEMPTS if type(error).__name__ == "KilledWorker" else 1
        if attempts[chunk[0].key] >= MAX_ATTEMPTS:
            return [killed(chunk[0])]
    suspects.update(task.key for task in chunk)
    waiting.extendleft(reversed(chunk))
    return []
