"""Driver: make the runs of a study that its folder lacks.

Any ``concurrent.futures.Executor`` executes the runs; results go to the ledger at once. A run whose process died is
retried a few times, then recorded as failed, while all others continue.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from missions.disk import STUDY
from missions.errors import DiskFullError, MissionsError, OutputError
from missions.sweeps.code import fingerprint, short
from missions.sweeps.folder import SweepFolder, SweepResults, SweepStatus
from missions.sweeps.ledger import FinishedRun
from missions.sweeps.plan import DRAWN, RunTask, SweepPlan
from missions.sweeps.pool import SupervisedPool, TookTooLong, WorkersCannotStart, cluster_executor
from missions.sweeps.study import Study
from missions.sweeps.worker import killed, run_checked, run_task

MAX_ATTEMPTS = 3  # attempts of a run before it counts as fatal to its process
AHEAD = 2  # runs submitted per process
TIMED_RUNS = 3


class PartlyDoneError(MissionsError):
    """The sweep stopped early; finished runs are kept, and the same command resumes it."""


@dataclass(frozen=True)
class SweepEstimate:
    """Result of a dry run; ``remaining`` bounds the runs to make, since configurations without draws run once."""

    planned: int
    done: int
    remaining: int
    estimate_s: float


ReportProgress = Callable[[int, int], None]  # callback with the numbers of finished and of planned runs


def estimate(study: Study, jobs: int, folder: Path) -> SweepEstimate:
    """Count the runs of a study that its folder has and lacks, and time a few of them, without writing anything."""
    plan = SweepPlan(study)
    lines = SweepResults.read(folder).lines if (folder / STUDY).is_file() else {}
    done = {key: line["summary"] for key, line in lines.items()}
    remaining = sum(len(plan.schedule.lacking(number, done)) for number in range(len(study.configurations)))
    numbers = sorted({round(share * (len(study.configurations) - 1) / TIMED_RUNS) for share in range(TIMED_RUNS + 1)})
    began = time.perf_counter()
    once = sum(run_task(plan.task(number, 0)).line["summary"].get(DRAWN) is False for number in numbers)
    spent_s = time.perf_counter() - began
    likely = max(0, remaining - once * (study.maximum - 1))
    estimate_s = round(likely * spent_s / len(numbers) / jobs, 1)
    return SweepEstimate(len(done) + remaining, len(done), remaining, estimate_s)


def sweep(
    study: Study,
    folder: Path,
    jobs: int = 1,
    cluster: str | None = None,
    executor: Executor | None = None,
    progress: ReportProgress | None = None,
    timeout_s: float | None = None,
    accept_code: bool = False,
    retry_failed: bool = False,
    repeats_of: Sequence[int] | None = None,
) -> SweepStatus:
    """Make the runs of a study that its folder lacks; return the status. After an interruption the same call resumes.

    Args:
        cluster: address of a Dask scheduler that replaces local processes.
        executor: other executor with ``jobs`` processes.
        timeout_s: limit (s) of every run, which fails beyond it; needs local processes.
        accept_code: resume a folder of other code.
        repeats_of: repeats of each configuration, at most those of the study; None for all.

    Raises:
        PartlyDoneError: the engine was lost or the disk is full; the same call resumes.
        StudyChangedError, OutputError, ClusterError: nothing was started.
    """
    if timeout_s is not None and (cluster is not None or executor is not None):
        raise OutputError(
            f"--timeout-s {timeout_s:g}: only processes of this machine can be ended; leave --cluster out"
        )
    plan = SweepPlan(study, repeats_of)
    try:
        opened = SweepFolder(folder, plan, accept_code, retry_failed)
    except DiskFullError as error:
        raise PartlyDoneError(str(error)) from None
    try:
        if next(plan.missing(opened.summaries), None) is not None:
            with _engine(jobs, cluster, executor, timeout_s) as (engine, n_processes):
                _drive(engine, n_processes, plan, opened, progress)
        opened.compact()
    except WorkersCannotStart as error:
        raise OutputError(f"no worker can start: {error}") from None
    except (BrokenExecutor, CancelledError, OSError) as error:
        _compact_if_possible(opened)
        raise PartlyDoneError(f"the workers or their scheduler were lost ({type(error).__name__})") from None
    except OutputError as error:
        raise PartlyDoneError(str(error)) from None
    except KeyboardInterrupt:
        _compact_if_possible(opened)
        raise
    finally:
        opened.close()
    return SweepResults.read(folder).status()


def _compact_if_possible(folder: SweepFolder) -> None:
    with suppress(OutputError):
        folder.compact()


@contextmanager
def _engine(
    jobs: int, cluster: str | None, executor: Executor | None, timeout_s: float | None
) -> Iterator[tuple[Executor, int]]:
    if executor is not None:
        yield executor, jobs
    elif cluster is not None:
        with cluster_executor(cluster) as engine:
            yield engine
    else:
        pool = SupervisedPool(jobs, "missions.sweeps.worker", timeout_s)
        try:
            yield pool, jobs
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _drive(
    executor: Executor,
    n_processes: int,
    plan: SweepPlan,
    folder: SweepFolder,
    progress: ReportProgress | None,
) -> None:
    schedule, summaries, code = plan.schedule, folder.summaries, short(fingerprint())
    n_lacking = {number: len(schedule.lacking(number, summaries)) for number in range(len(schedule.labels))}
    waiting, deaths = deque(plan.due(summaries)), Counter[str]()
    busy: dict[Future[list[FinishedRun]], list[RunTask]] = {}
    while waiting or busy:
        while waiting and len(busy) < AHEAD * n_processes:
            tasks = waiting.popleft()
            busy[executor.submit(run_checked, code, tasks)] = tasks
        ready, _ = wait(busy, return_when=FIRST_COMPLETED)
        finished: list[FinishedRun] = []
        ended = [busy.pop(future) for future in ready]
        for future, tasks in zip(ready, ended, strict=True):
            try:
                finished += future.result()
            except Exception as error:
                if not _is_death(error):
                    raise
                task = tasks[0]  # the others come up again
                # Dask retries a run before it reports its death
                deaths[task.key] += MAX_ATTEMPTS if type(error).__name__ == "KilledWorker" else 1
                if isinstance(error, TookTooLong):
                    finished.append(killed(task, str(error)))
                elif deaths[task.key] >= MAX_ATTEMPTS:
                    finished.append(killed(task, "the process died every time that this run was tried"))
                else:
                    # First in the queue, since later repeats of its configuration may wait for its outcome.
                    waiting.appendleft(tasks)
        folder.append(finished)
        # Only now, since it visits all configurations of the study.
        if not waiting:
            waiting.extend(plan.due(summaries, {task.key for tasks in busy.values() for task in tasks}))
        # Only configurations of ended runs can have changed, and counting all takes longer the larger the study.
        n_lacking |= {task.number: len(schedule.lacking(task.number, summaries)) for tasks in ended for task in tasks}
        if progress is not None:
            progress(len(summaries), len(summaries) + sum(n_lacking.values()))


def _is_death(error: Exception) -> bool:
    """True if a process died with the run, as reported by the pool or by Dask."""
    if isinstance(error, WorkersCannotStart):
        return False
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"
