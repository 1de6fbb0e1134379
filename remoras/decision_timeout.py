"""Time limit and file guard for decisions of a user's strategy.

A system timer interrupts a decision beyond its CPU time inside Python code, endless loops included. A decision in time
is never interrupted, so results are the same bytes with and without the limit. Outside the main thread, or without such
a timer, a late decision is detected only after it ends.

An audit hook refuses decisions to write, move or remove files, module imports and files opened earlier apart. Such a
hook stays in a process, so it is installed with the first guarded strategy.
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
AGAIN_S = 0.05
"""CPU time between repeated interrupts, if a decision survives the first (s)."""
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
CHANGING = frozenset({
    "os.chmod", "os.exec", "os.fork", "os.link", "os.mkdir", "os.posix_spawn", "os.remove", "os.rename", "os.rmdir",
    "os.symlink", "os.system", "os.truncate", "subprocess.Popen",
})  # fmt: skip
"""Audit events, besides ``open``, that may change something outside the program."""
COMPILED = "__pycache__"
"""Part of paths that Python writes when it imports a module."""
SILENT = Move(silent=True)

Answer = TypeVar("Answer")


class DecidedTooLate(PluginError):
    """A decision exceeded its CPU time."""


class _Rung(BaseException):
    """Interrupt of a late decision; no Exception, so that few handlers catch it."""


class _Watch:
    def __init__(self) -> None:
        self.until_s = math.inf  # thread CPU time at which a decision is late; infinite between decisions
        self.fault = ""  # forbidden act of a decision
        if self._can_ring():
            signal.signal(signal.SIGPROF, self._ring)
        sys.addaudithook(self._seen)

    @staticmethod
    def _can_ring() -> bool:
        return hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()

    def _ring(self, number: int, frame: object) -> None:
        # The timer counts the CPU time of all threads of the process.
        if time.thread_time() >= self.until_s:
            raise _Rung

    def _seen(self, event: str, args: tuple[Any, ...]) -> None:
        if self.until_s == math.inf or not (event in CHANGING or (event == "open" and args[2] & WRITING)):
            return
        if event == "open" and COMPILED in str(args[0]):
            return
        self.fault = f"opened {args[0]!r} for writing" if event == "open" else f"called {event}"
        raise PermissionError(f"a decision {self.fault}")

    def answer(self, cpu_s: float, asked: Callable[[], Answer]) -> Answer | None:
        """Return the result of ``asked``, or None after ``cpu_s`` of CPU time; set ``fault``."""
        self.fault, rings, before_s = "", self._can_ring(), self.until_s
        self.until_s = until_s = time.thread_time() + cpu_s
        # The timer may still ring between the end of the decision and its reset, hence the outer ``try``.
        try:
            try:
                if rings:
                    signal.setitimer(signal.ITIMER_PROF, cpu_s, AGAIN_S)
                value = asked()
            finally:
                if rings:
                    signal.setitimer(signal.ITIMER_PROF, 0.0)
                self.until_s = before_s
        except _Rung:
            if rings:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
            self.until_s = before_s
            return None
        return value if time.thread_time() < until_s else None


@cache  # an audit hook cannot be removed
def _watch() -> _Watch:
    return _Watch()


Late = Callable[[str, str, str, float], None]
"""Callback for late decisions: method, vehicle, group, time (s)."""


class InTime:
    """Strategy with a CPU limit on decisions; its methods raise PluginError if files change.

    ``late`` is called on late decisions at run time; their method returns nothing from then on. If it is None, and for
    ``form`` and ``negotiator``, DecidedTooLate is raised.
    """

    def __init__(self, strategy: Strategy, cpu_s: float = MOST_CPU_S) -> None:
        self.strategy, self._cpu_s = strategy, cpu_s
        self.late: Late | None = None
        self.silent: set[object] = set()
        """Negotiators, and groups to adapt, that are no longer asked."""

    @property
    def name(self) -> str:
        """Name in results and figures."""
        return self.strategy.name

    @property
    def declaration(self) -> Declaration:
        """Declaration of the wrapped strategy."""
        return self.strategy.declaration

    def form(self, database: AUVDatabase, groups: Sequence[Group]) -> Organisation:
        """Form the organisation by the strategy."""
        return self.decided("form", lambda: self.strategy.form(database, groups))

    def adapt(self, work: Work) -> tuple[RoleAssignment, ...]:
        """Return the strategy's allocation; nothing for a group after a timeout."""
        where = next(iter(work.heads), ""), work.group.name, work.now_s
        return self.until_late(work.group.name, "adapt", where, lambda: self.strategy.adapt(work), ())

    def negotiator(self, me: str, group: Group) -> Negotiator | None:
        """Return the strategy's negotiator with the same limit."""
        made = self.decided("negotiator", lambda: self.strategy.negotiator(me, group))
        if made is None or not callable(getattr(made, "negotiate", None)):
            return made
        return InTimeNegotiator(made, me, group.name, self)

    def until_late(
        self, key: object, part: str, where: tuple[str, str, float], asked: Callable[[], Answer], silent: Answer
    ) -> Answer:
        """Return the result of ``asked``, or ``silent`` from the first late decision of ``key`` on.

        ``where`` has vehicle, group and time (s).
        """
        if key not in self.silent:
            try:
                return self.decided(part, asked)
            except DecidedTooLate:
                if self.late is None:
                    raise
                self.silent.add(key)
                self.late(part, *where)
        return silent

    def decided(self, part: str, asked: Callable[[], Answer]) -> Answer:
        """Return the result of ``asked`` within the limit; ``part`` names the method in errors."""
        watch, collects = _watch(), gc.isenabled()
        # The cost of a collection depends on the objects of the whole process.
        gc.disable()
        try:
            # In a tuple, since None means a late decision.
            answer = watch.answer(self._cpu_s, lambda: (asked(),))
        finally:
            if collects:
                gc.enable()
            if watch.fault:
                raise PluginError(f"strategy {self.name}: {part} {watch.fault}; allowed: reading files") from None
        if answer is None:
            took = f"took more than {self._cpu_s:g} s of CPU time"
            raise DecidedTooLate(f"strategy {self.name}: {part} {took}; allowed: an answer within the limit")
        return answer[0]


class InTimeNegotiator:
    """Negotiator with a CPU limit on its decisions."""

    def __init__(self, negotiator: Negotiator, me: str, group: str, strategy: InTime) -> None:
        self._negotiator, self._me, self._group, self._strategy = negotiator, me, group, strategy
        self._now_s = 0.0

    def negotiate(self, situation: Situation) -> Move:
        """Return the negotiator's move, or a silent one after a timeout."""
        self._now_s = situation.now_s
        return self._decided("negotiate", lambda: self._negotiator.negotiate(situation), SILENT)

    def division(self) -> Mapping[str, str]:
        """Return the negotiator's division of jobs, or nothing after a timeout."""
        return self._decided("division", lambda: division_of(self._strategy.name, self._negotiator), {})

    def _decided(self, part: str, asked: Callable[[], Answer], silent: Answer) -> Answer:
        return self._strategy.until_late(self, part, (self._me, self._group, self._now_s), asked, silent)
