"""Deciding: a strategy of a user's own that is watched while it decides, so that it neither hangs nor writes files.

A decision is one call of ``form``, ``adapt``, ``negotiator``, ``negotiate`` or ``division``. It may take so much CPU
time of its thread; Python collects no garbage meanwhile, since that takes longer the more the process holds. The
system rings once the process has spent as much, and from then on again and again; the ring looks at the thread's own
time, and stops what it finds in the midst of Python code, an endless loop too. A decision that ends in time is never
rung for, so it gives the same bytes with and without the watch. In a thread beside the main one, and where the system
has no such timer, a decision is not stopped, only judged once it has ended.

Files that a decision opens for writing, moves or removes are refused by an audit hook of Python. A process that has
such a hook keeps it, so it is made with the first strategy that is watched. What a module does when it is imported,
and what it writes to files that were open before, is not seen.
"""

from __future__ import annotations

import gc
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

from remoras.database import AUVDatabase
from remoras.errors import PluginError
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.strategy import Declaration, Move, Negotiator, Situation, Strategy, division_of
from remoras.work import Work

MOST_CPU_S = 1.0
"""CPU time that a decision may take (s)."""
AGAIN_S = 0.05
"""CPU time between two rings, for a decision that goes on in spite of the first (s)."""
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGING = frozenset({
    "os.chmod", "os.exec", "os.fork", "os.link", "os.mkdir", "os.posix_spawn", "os.remove", "os.rename", "os.rmdir",
    "os.symlink", "os.system", "os.truncate", "subprocess.Popen",
})  # fmt: skip
"""Events of Python's audit hooks, beside ``open``, by which something outside the program may be changed."""
COMPILED = "__pycache__"
"""In paths that Python writes itself when a module is imported."""
SILENT = Move(silent=True)

Answer = TypeVar("Answer")


class DecidedTooLate(PluginError):
    """A decision took more CPU time than it may."""


class _Rung(BaseException):
    """Ends a decision in its midst; no Exception, so that few catch it."""


class _Watch:
    """What the one timer and the one hook of this process look at.

    Attributes:
        until_s: CPU time of the thread at which the decision under way is late; infinite between decisions.
        fault: what it did that it must not, in words.
    """

    def __init__(self) -> None:
        self.until_s = math.inf
        self.fault = ""
        if self._can_ring():
            signal.signal(signal.SIGPROF, self._ring)
        sys.addaudithook(self._seen)

    @staticmethod
    def _can_ring() -> bool:
        return hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()

    def _ring(self, number: int, frame: object) -> None:
        if time.thread_time() >= self.until_s:
            raise _Rung

    def _seen(self, event: str, given: tuple[Any, ...]) -> None:
        """Refuse what a decision must not do; called by Python for each event of the process."""
        if self.until_s == math.inf or not (event in CHANGING or (event == "open" and given[2] & WRITING)):
            return
        if event == "open" and COMPILED in str(given[0]):
            return
        self.fault = f"opened {given[0]!r} for writing" if event == "open" else f"called {event}"
        raise PermissionError(f"a decision {self.fault}")

    def answer(self, cpu_s: float, asked: Callable[[], Answer]) -> Answer | None:
        """What is answered, or None if that takes too long; its fault is noted.

        Args:
            cpu_s: CPU time that it may take (s).
            asked: makes the decision.
        """
        self.fault, rings, before_s = "", self._can_ring(), self.until_s
        self.until_s = until_s = time.thread_time() + cpu_s
        try:
            try:
                if rings:
                    signal.setitimer(signal.ITIMER_PROF, cpu_s, AGAIN_S)
                found = asked()
            finally:
                if rings:
                    signal.setitimer(signal.ITIMER_PROF, 0.0)
                self.until_s = before_s
        except _Rung:
            if rings:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
            self.until_s = before_s
            return None
        return found if time.thread_time() < until_s else None


@cache
def _watch() -> _Watch:
    return _Watch()


Late = Callable[[str, str, str, float], None]
"""Told of a decision that took too long: part of the strategy, vehicle and group that it was for, time (s)."""


class InTime:
    """A strategy that is watched while it decides.

    Args:
        strategy: that decides.
        cpu_s: CPU time that a decision may take (s).
        late: told of each at sea that took more; whoever made it is not asked again and counts as silent. If None, and
            of ``form`` and ``negotiator``, without which there is nobody, it raises.

    Raises:
        DecidedTooLate: of its methods, where nobody is told.
        PluginError: of its methods, if a decision changes files.
    """

    def __init__(self, strategy: Strategy, cpu_s: float = MOST_CPU_S, late: Late | None = None) -> None:
        self.strategy, self.late = strategy, late
        self._cpu_s = cpu_s
        self.silent: set[tuple[str, str]] = set()
        """Parts that are asked no more, and of which group."""

    @property
    def name(self) -> str:
        """Name by which results and figures show it."""
        return self.strategy.name

    @property
    def declaration(self) -> Declaration:
        """What it is and what it takes from the vehicles."""
        return self.strategy.declaration

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """The organisation that the strategy forms."""
        return self.decided("form", lambda: self.strategy.form(database, groups))

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """What the strategy allocates; nothing in a group for which it once took too long."""
        key = "adapt", work.group.name
        if key not in self.silent:
            try:
                return self.decided("adapt", lambda: self.strategy.adapt(work))
            except DecidedTooLate:
                if self.late is None:
                    raise
                self.silent.add(key)
                self.late("adapt", next(iter(work.heads), ""), work.group.name, work.now_s)
        return ()

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """The strategy's, watched."""
        made = self.decided("negotiator", lambda: self.strategy.negotiator(me, group))
        if made is None or not callable(getattr(made, "negotiate", None)):
            return made
        return InTimeNegotiator(made, me, group.name, self)

    def decided(self, part: str, asked: Callable[[], Answer]) -> Answer:
        """What is answered in time.

        Args:
            part: of the strategy; asked: calls it.
        """
        watch, collects = _watch(), gc.isenabled()
        gc.disable()
        try:
            found = watch.answer(self._cpu_s, lambda: (asked(),))
        finally:
            if collects:
                gc.enable()
            if watch.fault:
                raise PluginError(f"strategy {self.name}: {part} {watch.fault}; allowed: to read") from None
        if found is None:
            took = f"took more than {self._cpu_s:g} s of CPU time"
            raise DecidedTooLate(f"strategy {self.name}: {part} {took}; allowed: an answer before")
        return found[0]


class InTimeNegotiator:
    """A negotiator that is watched while it decides.

    Args:
        negotiator: that decides; me: its vehicle; group: whose jobs are divided.
        strategy: that made it.
    """

    def __init__(self, negotiator: Negotiator, me: str, group: str, strategy: InTime) -> None:
        self._negotiator, self._me, self._group, self._strategy = negotiator, me, group, strategy
        self._is_silent, self._now_s = False, 0.0

    def negotiate(self, situation: Situation) -> Move:
        """What the negotiator states; nothing from when it once took too long."""
        self._now_s = situation.now_s
        return self._decided("negotiate", lambda: self._negotiator.negotiate(situation), SILENT)

    def division(self) -> Mapping[str, str]:
        """What the negotiator says of who is to do jobs; nothing from when it once took too long."""
        return self._decided("division", lambda: division_of(self._strategy.name, self._negotiator), {})

    def _decided(self, part: str, asked: Callable[[], Answer], silent: Answer) -> Answer:
        """What is answered, ``silent`` once something took too long."""
        if not self._is_silent:
            try:
                return self._strategy.decided(part, asked)
            except DecidedTooLate:
                if self._strategy.late is None:
                    raise
                self._is_silent = True
                self._strategy.late(part, self._me, self._group, self._now_s)
        return silent
