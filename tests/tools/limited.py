"""A plug-in of pytest for tests of mutants: the session ends after a time, and a test that does not end fails.

It reads ``MUTANT_LIMIT_S`` of the environment, the CPU time of all tests and of their processes (s), after which no
further one is asked. CPU time, since what other work the machine has is no fault of a test.
"""

import os
import signal
from collections.abc import Iterator
from typing import Any

import pytest

LIMIT = "MUTANT_LIMIT_S"
HANGS_S = float(os.environ.get("MUTANT_HANGS_S", "60"))
"""A test that takes more CPU time than this does not end."""


class HangsError(BaseException):
    """A test does not end; nothing that is tested catches this."""


def _hangs(*_: Any) -> None:
    raise HangsError


def pytest_sessionstart(session: pytest.Session) -> None:
    signal.signal(signal.SIGPROF, _hangs)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Ask no further test once the time is up."""
    yield
    if sum(os.times()[:4]) > float(os.environ[LIMIT]):
        item.session.shouldstop = "the time is up"


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Let no test take longer than ``HANGS_S``."""
    signal.setitimer(signal.ITIMER_PROF, HANGS_S)
    try:
        result = yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    if isinstance(getattr(result, "exception", None), HangsError):
        result.force_exception(AssertionError("the test does not end"))  # type: ignore[attr-defined]
