"""Driver: make all runs that a study asks for and that its folder does not have yet.

The engine is any ``concurrent.futures.Executor``. It gets chunks of about a second; what comes back goes to the ledger
at once. A chunk whose process died is split, so that the run at fault is found: it is tried alone a few times and then
logged as failed, while all others go on.
"""

from __future__ import annotations

import itertools
import math
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from missions.errors import DiskFullError, MissionsError, OutputError
from missions.runs.summary import identity
from missions.sweeps.folder import SweepFolder, SweepResults, SweepStatus
from missions.sweeps.ledger import FinishedRun
from missions.sweeps.plan import DRAWN, RunTask, SweepPlan
from missions.sweeps.pool import SupervisedPool, TookTooLong, WorkersCannotStart, cluster_executor
from missions.sweeps.study import Study
from missions.sweeps.worker import Needed, killed, run_chunk, run_task

CHUNK_S = 1.0
MAX_CHUNK = 200
MAX_ATTEMPTS = 3
"""Times that a run is tried alone before it counts as the one that kills its process."""
AHEAD = 2
"""Chunks that are given out for every process of the executor."""
TIMED_RUNS = 3
LOSSLESS_TIMED = 8
"""Configurations without losses that a dry run makes at most, to see whether anything is drawn in them."""


class PartlyDoneError(MissionsError):
    """The sweep stopped before its end; what is finished is kept, and the same command goes on from there."""


@dataclass(frozen=True)
class Limits:
    """Of a run that exceeds one of them only itself is lost: it counts as failed.

    Args:
        timeout_s: wall-clock time.
        memory_mb: memory of its process.
    """

    timeout_s: float | None = None
    memory_mb: int | None = None


UNLIMITED = Limits()


@dataclass(frozen=True)
class SweepEstimate:
    """Answer of a dry run.

    Args:
        planned: runs that are to be made, at most.
        estimate_s: the time they will take.
        timed: configurations that were run once to say so.
        deterministic: of these, those in which nothing was drawn: they are made once, and ``planned`` counts them so.
    """

    planned: int
    estimate_s: float
    timed: int = 0
    deterministic: int = 0


ReportProgress = Callable[[int, int], None]
"""Called with the number of finished runs and the number of planned runs."""


def estimate(study: Study, jobs: int) -> SweepEstimate:
    """Count the runs of a study and time a few of them, without writing anything.

    Args:
        study: see ``load_study``.
        jobs: processes that would make them.
    """
    plan = SweepPlan(study)
    planned = study.n_runs
    numbers = sorted({round(share * (len(study.configurations) - 1) / TIMED_RUNS) for share in range(TIMED_RUNS + 1)})
    numbers = sorted({*numbers, *_lossless(plan)})
    began = time.perf_counter()
    once = sum(run_task(plan.task(number, 0)).line["summary"].get(DRAWN) is False for number in numbers)
    planned -= once * (study.maximum - 1)
    spent_s = time.perf_counter() - began
    return SweepEstimate(planned, round(planned * spent_s / len(numbers) / jobs, 1), len(numbers), once)


def _lossless(plan: SweepPlan) -> list[int]:
    """Configurations that may draw nothing, as far as the packet error rate tells; the first of them."""
    lossless = (
        number
        for number, configuration in enumerate(plan.study.configurations)
        if identity(configuration.scenario, 0)["per"] == 0.0
    )
    return list(itertools.islice(lossless, LOSSLESS_TIMED))


def sweep(
    study: Study,
    folder: Path,
    jobs: int = 1,
    cluster: str | None = None,
    executor: Executor | None = None,
    force_new: bool = False,
    progress: ReportProgress | None = None,
    limits: Limits = UNLIMITED,
    accept_code: bool = False,
    retry_failed: bool = False,
) -> SweepStatus:
    """Make the runs of a study that its folder does not have yet.

    Args:
        study: see ``load_study``.
        folder: made if it is not there; after an interruption the same call goes on.
        jobs: processes on this machine.
        cluster: address of a Dask scheduler to use instead.
        executor: any other executor to use instead, with ``jobs`` processes.
        force_new: set the runs of another study in the folder aside.
        progress: called with the number of finished runs and of planned runs.
        limits: of every run; a time needs processes of this machine, which are killed.
        accept_code: go on in a folder whose runs other code has made.
        retry_failed: make runs that failed again.

    Returns:
        How far the sweep is: nothing remains, some runs may have failed.

    Raises:
        PartlyDoneError: the engine was lost or the disk is full; run again to go on.
        StudyChangedError, OutputError, ClusterError: nothing was begun.
    """
    if limits.timeout_s is not None and (cluster is not None or executor is not None):
        raise OutputError(
            f"--timeout-s {limits.timeout_s:g}: only processes of this machine can be ended; leave --cluster out"
        )
    plan = SweepPlan(study)
    try:
        opened = SweepFolder(folder, plan, force_new, accept_code, retry_failed)
    except DiskFullError as error:
        raise PartlyDoneError(str(error)) from None
    try:
        if next(plan.missing(opened.summaries), None) is not None:
            with _engine(jobs, cluster, executor) as (engine, n_processes):
                _drive(engine, n_processes, plan, opened, progress, limits)
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
    """Make the tables of what is finished, if the disk takes them; the ledger has it all."""
    with suppress(OutputError):
        folder.compact()


@contextmanager
def _engine(jobs: int, cluster: str | None, executor: Executor | None) -> Iterator[tuple[Executor, int]]:
    """(executor, number of its processes), shut down at the end if it was made here."""
    if executor is not None:
        yield executor, jobs
    elif cluster is not None:
        with cluster_executor(cluster) as engine:
            yield engine
    else:
        pool = SupervisedPool(jobs, preload="missions.sweeps.worker")
        try:
            yield pool, jobs
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


class _Queue:
    """Tasks that wait for a process. They leave in chunks, and come back when their process dies.

    Args:
        tasks: in the order in which they are to be made.
        n_processes: of the executor.
        timeout_s: that a run may take; None if that does not matter.
    """

    def __init__(self, tasks: Iterable[RunTask], n_processes: int, timeout_s: float | None) -> None:
        self._timeout_s = timeout_s
        self.waiting = deque(tasks)
        self._n_processes = n_processes
        self._attempts: Counter[str] = Counter()
        self._suspects: set[str] = set()
        self._run_s: float | None = None

    def next_chunk(self) -> list[RunTask]:
        """The next tasks, about ``CHUNK_S`` of work, fewer towards the end; a suspect goes alone."""
        share = math.ceil(len(self.waiting) / (AHEAD * self._n_processes))
        fitting = 1 if self._run_s is None else round(CHUNK_S / max(self._run_s, 1e-6))
        size = max(1, min(MAX_CHUNK, share, fitting))
        chunk = [self.waiting.popleft()]
        while len(chunk) < size and self.waiting:
            if self._suspects.intersection((chunk[0].key, self.waiting[0].key)):
                break
            chunk.append(self.waiting.popleft())
        return chunk

    def learn(self, finished: Iterable[FinishedRun]) -> None:
        """Take the time of finished runs into account."""
        for run in finished:
            if (wall_s := run.line["machine"]["wall_s"]) is not None:
                self._run_s = wall_s if self._run_s is None else 0.8 * self._run_s + 0.2 * wall_s

    def put_back(self, chunk: list[RunTask], error: Exception) -> list[FinishedRun]:
        """Let the tasks of a dead chunk wait again, each on its own from now on.

        Dask has tried a chunk several times before it gives it up, so there once is often.

        Args:
            chunk: given out before.
            error: how it died.

        Returns:
            The run that has failed, if it was alone too often.
        """
        if len(chunk) == 1:
            key = chunk[0].key
            if isinstance(error, TookTooLong):
                return [killed(chunk[0], f"it took longer than timeout_s = {self._timeout_s:g}")]
            self._attempts[key] += MAX_ATTEMPTS if type(error).__name__ == "KilledWorker" else 1
            if self._attempts[key] >= MAX_ATTEMPTS:
                return [killed(chunk[0], "the process died every time that this run was tried, alone at the last")]
        self._suspects.update(task.key for task in chunk)
        self.waiting.extendleft(reversed(chunk))
        return []


def _drive(
    executor: Executor,
    n_processes: int,
    plan: SweepPlan,
    folder: SweepFolder,
    progress: ReportProgress | None,
    limits: Limits,
) -> None:
    """Give out chunks and log what comes back until nothing is missing."""
    queue = _Queue(plan.due(folder.summaries), n_processes, limits.timeout_s)
    needed = Needed.like_here(limits.memory_mb)
    busy: dict[Future[list[FinishedRun]], list[RunTask]] = {}
    while queue.waiting or busy:
        while queue.waiting and len(busy) < AHEAD * n_processes:
            chunk = queue.next_chunk()
            if isinstance(executor, SupervisedPool) and limits.timeout_s is not None:
                future = executor.submit_within(limits.timeout_s * len(chunk), run_chunk, needed, chunk)
            else:
                future = executor.submit(run_chunk, needed, chunk)
            busy[future] = chunk
        ready, _ = wait(busy, return_when=FIRST_COMPLETED)
        finished: list[FinishedRun] = []
        for future in ready:
            chunk = busy.pop(future)
            try:
                finished += future.result()
            except Exception as error:
                if not _is_death(error):
                    raise
                finished += queue.put_back(chunk, error)
        folder.append(finished)
        queue.learn(finished)
        if not queue.waiting:
            given_out = {task.key for chunk in busy.values() for task in chunk}
            queue.waiting.extend(plan.due(folder.summaries, given_out))
        if progress is not None:
            progress(len(folder.lines), len(folder.lines) + plan.schedule.n_missing(folder.summaries))


def _is_death(error: Exception) -> bool:
    """True if a process died with the chunk, as our pool and Dask say it."""
    if isinstance(error, WorkersCannotStart):
        return False
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"
