"""A limit of time for queries: what is asked may be of any length, and so may its answer.

An alarm of the system interrupts Python, a regular expression that it searches too. There is none on Windows or in
another thread than the first: there ``give_up``, which may end the process, is called a little later.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from worldmodel.errors import QueryError

AGAIN_S = 0.5
"""Time after which the alarm comes again: rdflib may have caught the first."""
LATER_S = 1.0
"""Time that the alarm has before ``give_up`` is called."""


class _TimeIsUp(BaseException):
    """The alarm; nothing that answers queries catches it on purpose."""


def _ring(*_: Any) -> None:
    raise _TimeIsUp


@contextmanager
def time_limit(limit_s: float | None, give_up: Callable[[str], None] | None = None) -> Iterator[None]:
    """End what is done within if it takes longer.

    Args:
        limit_s: time that it may take (s); None for any.
        give_up: called with a message, in another thread, if the alarm cannot end it; None for nothing.

    Raises:
        QueryError: it took longer.
    """
    if limit_s is None:
        yield
        return
    message = f"the query is not answered within {limit_s:g} s; ask for less, or allow more time"
    has_alarm = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
    last = threading.Timer(limit_s + LATER_S, lambda: give_up(message) if give_up is not None else None)
    last.daemon = True
    last.start()
    before: Any = signal.signal(signal.SIGALRM, _ring) if has_alarm else None
    try:
        if has_alarm:
            signal.setitimer(signal.ITIMER_REAL, limit_s, AGAIN_S)
        yield
    except _TimeIsUp:
        raise QueryError(message) from None
    finally:
        if has_alarm:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
        last.cancel()
