"""Process pool that survives its workers, and a Dask executor for many machines.

The pool of the standard library breaks as a whole if one process dies. Here a thread watches each process. If it dies,
its call fails with ``WorkerDied``, and a new process takes the next call.
"""

from __future__ import annotations

import logging
import multiprocessing
import re
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from queue import SimpleQueue
from threading import Lock, Thread
from typing import Any, ParamSpec, TypeVar

from missions.errors import ClusterError
from missions.sweeps.code import program
from remoras.plugins import SAFE_PATH, look_in, plugin_folders, switched_on

START_ATTEMPTS = 3
SERVER_DIED = 255  # exit code in ``multiprocessing`` of a process whose fork server was killed
GUARD = (
    "before its first run; a script that calls sweep does so below if __name__ == '__main__': since every worker "
    "loads the script again"
)
_STARTING = Lock()  # lock for process starts, which use global state
Arguments = ParamSpec("Arguments")
T = TypeVar("T")
Call = tuple["Future[Any]", Callable[..., Any], tuple[Any, ...], dict[str, Any]]


class WorkerDied(BrokenExecutor):
    """The process of a call died; the pool continues."""


class TookTooLong(WorkerDied):
    """The process of a call was killed at the timeout."""


class WorkersCannotStart(BrokenExecutor):
    """A new process ended before its first call, as would the next."""


class SupervisedPool(Executor):
    """Executor that replaces dead processes; ``preload`` is loaded in new ones, calls beyond ``limit_s`` (s) fail."""

    def __init__(self, n_workers: int, preload: str, limit_s: float | None = None) -> None:
        self._limit_s = limit_s
        known = multiprocessing.get_all_start_methods()
        self._context: BaseContext = multiprocessing.get_context("forkserver" if "forkserver" in known else "spawn")
        self._context.set_forkserver_preload([preload])
        self._calls: SimpleQueue[Call | None] = SimpleQueue()
        self._processes: set[BaseProcess] = set()
        self._open = True
        self._threads = [Thread(target=self._watch, daemon=True) for _ in range(n_workers)]
        for thread in self._threads:
            thread.start()

    def submit(self, fn: Callable[Arguments, T], /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> Future[T]:
        """Schedule a call; its future may raise ``WorkerDied`` or ``WorkersCannotStart``."""
        if not self._open:
            raise RuntimeError("the pool is shut down")
        future: Future[T] = Future()
        self._calls.put((future, fn, args, kwargs))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Stop the processes, after the pending calls, or at once with ``cancel_futures``."""
        self._open = False
        if cancel_futures:
            while not self._calls.empty():
                if (call := self._calls.get()) is not None:
                    call[0].cancel()
            # A copy, since watching threads change the set.
            for process in list(self._processes):
                process.kill()
        for _ in self._threads:
            self._calls.put(None)
        if wait:
            for thread in self._threads:
                thread.join()

    def _watch(self) -> None:
        process: BaseProcess | None = None
        began = False
        while (call := self._calls.get()) is not None:
            future, *request = call
            if not future.set_running_or_notify_cancel():
                continue
            in_time = True
            if process is None or not process.is_alive():
                try:
                    process, connection = self._started()
                except RuntimeError as error:  # the starting process is itself a worker
                    future.set_exception(WorkersCannotStart(f"{error}, {GUARD}"))
                    continue
                except (OSError, EOFError) as error:
                    future.set_exception(WorkersCannotStart(f"the system starts none ({error}); try again"))
                    continue
                began = False
            try:
                # The first message of a process shows that it has loaded; its end before that is no fault of the call.
                if not began:
                    began = connection.recv()
                connection.send(request)
                in_time = connection.poll(self._limit_s)
                if not in_time:
                    process.kill()
                succeeded, value = connection.recv()
            except (EOFError, OSError):
                process.join()
                self._processes.discard(process)
                ending = f"process {process.pid} ended with {process.exitcode}"
                own_fault = not began and (process.exitcode or 0) > 0 and process.exitcode != SERVER_DIED
                if own_fault:  # negative for a signal
                    future.set_exception(WorkersCannotStart(f"{ending}, {GUARD}"))
                elif in_time:
                    future.set_exception(WorkerDied(ending))
                else:
                    future.set_exception(TookTooLong(f"it took longer than timeout_s = {self._limit_s:g}"))
                process = None
                continue
            if succeeded:
                future.set_result(value)
            else:
                future.set_exception(value)
        if process is not None:
            connection.close()
            process.join()
            self._processes.discard(process)

    def _started(self) -> tuple[BaseProcess, Connection]:
        for attempt in range(1, START_ATTEMPTS + 1):
            ours, theirs = self._context.Pipe()
            process: BaseProcess = self._context.Process(target=_serve, args=(theirs, plugin_folders()), daemon=True)  # type: ignore[attr-defined]
            try:
                with _STARTING, switched_on(SAFE_PATH), _interruption_held():
                    process.start()
                break
            except (OSError, EOFError):  # the fork server was killed: the next start replaces it
                ours.close()
                if attempt == START_ATTEMPTS:
                    raise
            finally:
                theirs.close()
        self._processes.add(process)
        return process, ours


@contextmanager
def _interruption_held() -> Iterator[None]:
    """Block Ctrl-C, which a terminal sends to all processes: started ones inherit the mask until they have handlers."""
    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # if started later, it would reset the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(connection: Connection, folders: tuple[str, ...]) -> None:
    """Answer calls until the connection closes; interruptions are left to the parent."""
    look_in(folders)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        connection.send(True)
    except OSError:  # the parent has ended
        return
    while True:
        try:
            function, args, kwargs = connection.recv()
        except (EOFError, OSError):
            return
        try:
            answer = (True, function(*args, **kwargs))
        except Exception as error:
            answer = (False, error)
        try:
            connection.send(answer)
        except OSError:
            return


ADDRESS = re.compile(r"(tcp|tls|ucx|wss?)://(\[[0-9a-fA-F:]+\]|[^/:\s]+):\d{1,5}")
REACH_S = 10.0  # timeout (s) for a scheduler to answer and a worker to join

JOINING = 32  # least number of threads assumed, so that workers that join later find tasks


@contextmanager
def cluster_executor(address: str) -> Iterator[tuple[Executor, int]]:
    """Connect to a Dask scheduler (tcp://HOST:PORT); yield executor and thread count, ClusterError without workers."""
    try:
        import distributed
    except ImportError:
        raise ClusterError('--cluster needs Dask distributed: pip install "distributed>=2024.5"') from None
    if not ADDRESS.fullmatch(address):
        raise ClusterError(f"--cluster {address!r}: allowed: tcp://HOST:PORT or tls://HOST:PORT of a Dask scheduler")
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # a lost scheduler is reported once, here
    try:
        connect: Callable[..., Any] = distributed.Client
        client = connect(address, timeout=REACH_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(f"--cluster {address}: cannot be reached: {error}") from None
    try:
        try:
            client.wait_for_workers(1, timeout=REACH_S)
            client.run(program)
        except TimeoutError:
            why = f"has no workers; start some with: dask worker {address}"
            raise ClusterError(f"--cluster {address}: {why}") from None
        except Exception as error:
            raise ClusterError(f"--cluster {address}: a worker cannot load remoras: {error}") from None
        yield client.get_executor(pure=False), max(JOINING, sum(client.nthreads().values()))
    finally:
        client.close(timeout=1)
