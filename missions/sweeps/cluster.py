"""Many machines: an executor over Dask distributed, checked before it is used."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

from missions.errors import ClusterError
from missions.sweeps.plan import version

ADDRESS = re.compile(r"(tcp|tls|ucx|wss?)://(\[[0-9a-fA-F:]+\]|[^/:\s]+):\d{1,5}")
REACH_S = 10.0
"""Time within which a scheduler has to answer and a worker has to be there."""

JOINING = 32
"""Fewest threads that work is given out for, so that workers that join later find some."""


@contextmanager
def cluster_executor(address: str) -> Iterator[tuple[Executor, int]]:
    """A connection to a Dask cluster, closed at the end.

    Args:
        address: of its scheduler, as tcp://HOST:PORT.

    Returns:
        The executor, and the number of threads to give work to.

    Raises:
        ClusterError: the scheduler cannot be reached, has no workers, or a worker has another version.
    """
    try:
        import distributed
    except ImportError:
        raise ClusterError('--cluster needs Dask distributed: pip install "distributed>=2024.5"') from None
    if not ADDRESS.fullmatch(address):
        raise ClusterError(f"--cluster {address!r}: allowed: tcp://HOST:PORT or tls://HOST:PORT of a Dask scheduler")
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # a lost scheduler is told once, by us
    try:
        connect: Callable[..., Any] = distributed.Client
        client = connect(address, timeout=REACH_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(f"--cluster {address}: cannot be reached: {error}") from None
    try:
        client.wait_for_workers(1, timeout=REACH_S)
        versions: dict[str, str] = client.run(version)
    except TimeoutError:
        client.close(timeout=1)
        raise ClusterError(f"--cluster {address}: has no workers; start some with: dask worker {address}") from None
    except Exception as error:
        client.close(timeout=1)
        raise ClusterError(f"--cluster {address}: a worker cannot load remoras: {error}") from None
    others = {worker: other for worker, other in versions.items() if other != version()}
    if others:
        client.close(timeout=1)
        worker, other = next(iter(others.items()))
        raise ClusterError(
            f"--cluster {address}: {len(others)} workers have another version, {worker} has {other}, "
            f"this is {version()}: install the same everywhere"
        )
    try:
        yield client.get_executor(pure=False), max(JOINING, sum(client.nthreads().values()))
    finally:
        client.close(timeout=1)
