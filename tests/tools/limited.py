"""A plug-in of pytest for tests of mutants: the session ends after a time, and a test that does not end fails.

It reads ``MUTANT_LIMIT_S`` of the environment, the time for all tests (s); a single test has half of it.
"""

import os
import signal
import time
from collections.abc import Iterator
from typing import Any

import pytest

LIMIT = "MUTANT_LIMIT_S"
STOPPED = 2
"""Exit status of a session that ended before all tests were asked."""
BEGAN_S = time.monotonic()


class HangsError(BaseException):
    """A test does not end; nothing that is tested catches this."""


def _hangs(*_: Any) -> None:
    raise HangsError


def pytest_sessionstart(session: pytest.Session) -> None:
    signal.signal(signal.SIGALRM, _hangs)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Ask no further test once the time is up."""
    yield
    if time.monotonic() - BEGAN_S > float(os.environ[LIMIT]):
        item.session.shouldstop = "the time is up"


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Let a test take half the time."""
    signal.alarm(max(1, int(float(os.environ[LIMIT]) / 2)))
    try:
        result = yield
    finally:
        signal.alarm(0)
    if isinstance(getattr(result, "exception", None), HangsError):
        result.force_exception(AssertionError("the test does not end"))  # type: ignore[attr-defined]
