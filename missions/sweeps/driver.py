"""Driver: make the runs of a study that its folder lacks.

Any ``concurrent.futures.Executor`` executes chunks of about a second; results go to the ledger at once. A chunk whose
process died is split until the faulty run is found. That run is retried alone a few times, then recorded as failed,
while all others continue.
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
from missions.runs.results import identity
from missions.sweeps.folder import SweepFolder, SweepResults, SweepStatus
from missions.sweeps.ledger import FinishedRun
from missions.sweeps.plan import DRAWN, RunTask, SweepPlan
from missions.sweeps.pool import SupervisedPool, TookTooLong, WorkersCannotStart, cluster_executor
from missions.sweeps.study import Study
from missions.sweeps.worker import Needed, killed, run_chunk, run_task

CHUNK_S = 1.0
MAX_CHUNK = 200
MAX_ATTEMPTS = 3
"""Attempts of a run alone before it counts as fatal to its process."""
AHEAD = 2
"""Chunks submitted per process."""
TIMED_RUNS = 3
LOSSLESS_TIMED = 8
"""Upper bound on lossless configurations tested in a dry run for random draws."""


class PartlyDoneError(MissionsError):
    """The sweep stopped early; finished runs are kept, and the same command resumes it."""


@dataclass(frozen=True)
class Limits:
    """Limits on wall-clock time and memory of a single run, which fails beyond them."""

    timeout_s: float | None = None
    memory_mb: int | None = None


UNLIMITED = Limits()


@dataclass(frozen=True)
class SweepEstimate:
    """Result of a dry run.

    ``planned`` bounds the number of runs. Of the ``timed`` configurations, the ``deterministic`` ones draw no random
    numbers and run once.
    """

    planned: int
    estimate_s: float
    timed: int = 0
    deterministic: int = 0


ReportProgress = Callable[[int, int], None]
"""Callback with the numbers of finished and of planned runs."""


def estimate(study: Study, jobs: int) -> SweepEstimate:
    """Count the runs of a study and time a few of them, without writing anything."""
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
    """Return the first configurations that may draw nothing, judged by the packet error rate."""
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
    """Make the runs of a study that its folder lacks; return the status.

    Args:
        folder: created if missing; after an interruption the same call resumes.
        cluster: address of a Dask scheduler that replaces local processes.
        executor: other executor with ``jobs`` processes.
        force_new: move the runs of another study in the folder aside.
        progress: called with the numbers of finished and of planned runs.
        limits: of every run; a timeout needs local processes.
        accept_code: resume a folder of other code.
        retry_failed: repeat failed runs.

    Raises:
        PartlyDoneError: the engine was lost or the disk is full; the same call resumes.
        StudyChangedError, OutputError, ClusterError: nothing was started.
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
    """Write the tables of finished runs if the disk allows; the ledger has all data."""
    with suppress(OutputError):
        folder.compact()


@contextmanager
def _engine(jobs: int, cluster: str | None, executor: Executor | None) -> Iterator[tuple[Executor, int]]:
    """Yield the executor and its number of processes; shut it down if it was created here."""
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
    """Tasks waiting for a process; they leave in chunks and return if their process dies."""

    def __init__(self, tasks: Iterable[RunTask], n_processes: int, timeout_s: float | None) -> None:
        self._timeout_s = timeout_s
        self.waiting = deque(tasks)
        self._n_processes = n_processes
        self._attempts: Counter[str] = Counter()
        self._suspects: set[str] = set()
        self._run_s: float | None = None

    def next_chunk(self) -> list[RunTask]:
        """Return the next tasks, about ``CHUNK_S`` of work, fewer near the end; a suspect alone."""
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
        """Update the mean duration of a run."""
        for run in finished:
            if (wall_s := run.line["machine"]["wall_s"]) is not None:
                self._run_s = wall_s if self._run_s is None else 0.8 * self._run_s + 0.2 * wall_s

    def put_back(self, chunk: list[RunTask], error: Exception) -> list[FinishedRun]:
        """Return the tasks of a dead chunk to the queue, each to be run alone.

        Dask has retried a chunk before it reports its death, which therefore counts as ``MAX_ATTEMPTS``. Returns the
        run that has finally failed, if any.
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
    """Submit chunks and record their results until no run is missing."""
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
            n_missing = sum(1 for _ in plan.schedule.missing(folder.summaries))
            progress(len(folder.lines), len(folder.lines) + n_missing)


def _is_death(error: Exception) -> bool:
    """True if a process died with the chunk, as reported by the pool or by Dask."""
    if isinstance(error, WorkersCannotStart):
        return False
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"
