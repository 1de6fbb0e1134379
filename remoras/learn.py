"""The learning face: the suites of the benchmark as environments, and policies as strategies.

``parallel_env`` gives a PettingZoo ``ParallelEnv``, for which the extra ``learn`` is to be installed; ``strategy``
makes a policy a strategy, which needs nothing more.

>>> from remoras.learn import parallel_env, strategy
>>> env = parallel_env("fathom-1")  # doctest: +SKIP
>>> mine = strategy(lambda seen: int(seen["action_mask"].argmax()), name="mine")
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from missions.benchmark.judging import split_to_judge
from missions.benchmark.learning.observing import AGAIN, JOB, LEAVE, MOST_JOBS, MOST_PEERS, OWN, PEER, TAKE, Sight
from missions.benchmark.learning.policies import strategy
from missions.benchmark.suite import DEV, TEST, suite_named
from remoras.errors import RemorasError

if TYPE_CHECKING:
    from missions.benchmark.learning.environment import FleetEnv

__all__ = [
    "AGAIN",
    "JOB",
    "LEAVE",
    "MOST_JOBS",
    "MOST_PEERS",
    "OWN",
    "PEER",
    "TAKE",
    "Sight",
    "parallel_env",
    "strategy",
]
EXTRA = ("pettingzoo", "gymnasium", "greenlet")


def parallel_env(suite: str, split: str = DEV, seeds: str | Path | None = None) -> FleetEnv:
    """The runs of a suite as an environment.

    Args:
        suite: a shipped one, or a TOML file.
        split: ``dev``, or ``test`` with the file of its ``seeds``: to be judged by, without rewards and ``state``.

    Raises:
        RemorasError: the extra ``learn`` is not installed, or there is no such split.
        OutputError: the seeds of the split are not out, or others.
        ConfigurationError: there is no such suite.
    """
    try:
        from missions.benchmark.learning.environment import FleetEnv
    except ModuleNotFoundError as error:
        if error.name not in EXTRA:
            raise
        raise RemorasError(f"learning needs {error.name}: pip install 'remoras-sim[learn]'") from error
    if split not in (DEV, TEST):
        raise RemorasError(f"split = {split!r}; allowed: {DEV}, {TEST}")
    found = suite_named(suite)
    if split == DEV:
        return FleetEnv(found)
    with TemporaryDirectory() as folder:
        return FleetEnv(split_to_judge(found, None if seeds is None else Path(seeds), Path(folder)))
