"""Conduct of the process: interruptions, progress on standard error, thresholds of the garbage collector.

Ctrl-C and SIGTERM end the program with one line after cleaning up. During imports, where an exception could surface
anywhere with a traceback, the process exits at once. Progress is a bar on a terminal, a rewritten line in a notebook,
else lines.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any

SAID = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
LOADER = "<frozen importlib._bootstrap>"
"""File name of frames that load a module."""


class Terminated(KeyboardInterrupt):
    """Termination by the system (SIGTERM), with the same cleanup as an interruption."""


def heed() -> None:
    """Install handlers for both signals, unless ignored or handled elsewhere."""
    for number in SAID:
        if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):
            signal.signal(number, _end)


def _end(number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code.co_filename == LOADER:
            os.write(2, f"remoras: {SAID[signal.Signals(number)]}\n".encode())
            os._exit(128 + number)
        frame = frame.f_back
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


QUIET_S = 1.0
"""Time (s) before any progress is shown."""
LINE_EVERY_S = 10.0
NOTEBOOK_EVERY_S = 0.5


def is_notebook() -> bool:
    """Return whether this is the kernel of a notebook."""
    return "ipykernel" in sys.modules


def is_watched() -> bool:
    """Return whether standard error is a terminal or a notebook."""
    return is_notebook() or sys.stderr.isatty()


class Progress:
    """Progress of a job: ``with Progress("run", total) as progress: progress.at(done)``."""

    def __init__(self, label: str, total: float, unit: str = "") -> None:
        self._label = label
        self._total = total
        self._unit = unit
        self._began = self._last_line = time.monotonic()
        self._first: float | None = None
        self._rewritten = 0
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Progress:
        return self

    def of(self, done: float, total: float) -> None:
        """Report progress with a changed total."""
        self._total = total
        self.at(done)

    def at(self, done: float) -> None:
        """Report progress."""
        now = time.monotonic()
        if self._first is None:
            self._first, self._began = done, now
        if now - self._began < QUIET_S:
            return
        if sys.stderr.isatty():
            self._show_bar(done)
        elif now - self._last_line >= (NOTEBOOK_EVERY_S if is_notebook() else LINE_EVERY_S):
            self._last_line = now
            rate = (done - self._first) / (now - self._began)
            left = f", {(self._total - done) / rate:.0f} s left" if rate > 0.0 else ""
            text = f"{self._label}: {done:.0f} of {self._total:.0f} {self._unit}, {rate:.2g} per s{left}"
            if is_notebook():  # overwrite the previous line
                self._rewritten = max(self._rewritten, len(text))
                print(f"\r{text:{self._rewritten}}", end="", file=sys.stderr, flush=True)
            else:
                print(text, file=sys.stderr)

    def _show_bar(self, done: float) -> None:
        if self._bar is None:
            from rich.console import Console
            from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
            from rich.progress import Progress as RichProgress

            counts = TextColumn("{task.completed:.0f} of {task.total:.0f} {task.fields[unit]}")
            rates = TextColumn("{task.fields[rate]:.2g}/s")
            columns = (TextColumn("{task.description}"), BarColumn(), counts, rates, TimeRemainingColumn())
            self._bar = RichProgress(*columns, console=Console(stderr=True), transient=True)
            self._bar.start()
            self._task = self._bar.add_task(self._label, total=self._total, unit=self._unit, rate=0.0)
        rate = (done - (self._first or 0.0)) / max(time.monotonic() - self._began, QUIET_S)
        self._bar.update(self._task, completed=done, total=self._total, rate=rate)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
        if self._rewritten:
            print("\r" + " " * self._rewritten + "\r", end="", file=sys.stderr, flush=True)


COLLECT_AFTER = 1_000_000
"""New objects between garbage collections meanwhile."""


@contextmanager
def rare_collections() -> Iterator[None]:
    """Collect garbage less often inside the context.

    A run makes many values and hardly any cycles; collection would take a sixth of its time, and up to two fifths of a
    plan of 10,000 levels. A rarer setting is kept; of overlapping contexts the end of the first ends it.
    """
    usual = gc.get_threshold()
    if usual[0] >= COLLECT_AFTER:
        yield
        return
    gc.set_threshold(COLLECT_AFTER, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)
