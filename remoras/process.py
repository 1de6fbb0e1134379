"""Conduct of the process: interruptions, progress, thresholds of the garbage collector.

Ctrl-C and SIGTERM end the program with one line after cleaning up; during imports at once, without traceback.
"""

from __future__ import annotations

import gc
import os
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

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
            # Not by ``print``: the signal may have interrupted a write to the same buffer.
            os.write(2, f"remoras: {SAID[signal.Signals(number)]}\n".encode())
            os._exit(128 + number)
        frame = frame.f_back
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


@contextmanager
def instead(end: Callable[[], None]) -> Iterator[None]:
    """Call ``end`` at an interruption or termination inside the context, so that no step is cut short."""
    usual = {number: signal.signal(number, lambda *_: end()) for number in SAID}
    try:
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)


QUIET_S = 1.0
"""Time (s) before any progress is shown."""
LINE_EVERY_S = 10.0
REWRITTEN_EVERY_S = 0.5


def is_watched() -> bool:
    """Return whether standard error is a terminal or a notebook."""
    return "ipykernel" in sys.modules or sys.stderr.isatty()


class Progress:
    """Progress of a job: ``with Progress("run", total) as progress: progress.at(done)``."""

    def __init__(self, label: str, total: float, unit: str = "") -> None:
        self._label = label
        self._total = total
        self._unit = unit
        self._began = self._last_line = time.monotonic()
        self._first: float | None = None
        self._rewritten = 0

    def __enter__(self) -> Progress:
        return self

    def at(self, done: float, total: float | None = None) -> None:
        """Report progress, with the total if it has changed."""
        now, self._total = time.monotonic(), self._total if total is None else total
        if self._first is None:
            # A resumed job starts above 0: the rate counts from there.
            self._first, self._began = done, now
        rewrites = is_watched()
        if now - self._began < QUIET_S or now - self._last_line < (REWRITTEN_EVERY_S if rewrites else LINE_EVERY_S):
            return
        self._last_line = now
        rate = (done - self._first) / (now - self._began)
        left = f", {(self._total - done) / rate:.0f} s left" if rate > 0.0 else ""
        digits = f"{rate:.0f}" if rate >= 10.0 else f"{rate:.2g}"
        text = f"{self._label}: {done:.0f} of {self._total:.0f} {self._unit}, {digits} per s{left}"
        if rewrites:
            # A longer line would wrap, and the next one not replace it.
            text = text[: shutil.get_terminal_size().columns - 1]
            self._rewritten = max(self._rewritten, len(text))
            print(f"\r{text:{self._rewritten}}", end="", file=sys.stderr, flush=True)
        else:
            print(text, file=sys.stderr)

    def __exit__(self, *error: object) -> None:
        if self._rewritten:
            print("\r" + " " * self._rewritten + "\r", end="", file=sys.stderr, flush=True)


COLLECT_AFTER = 1_000_000
"""New objects between garbage collections meanwhile."""


@contextmanager
def rare_collections() -> Iterator[None]:
    """Collect garbage less often inside the context, until the first of overlapping ones ends."""
    # A run makes many values and hardly any cycles; collection would take a sixth of its time.
    usual = gc.get_threshold()
    if usual[0] >= COLLECT_AFTER:
        yield
        return
    gc.set_threshold(COLLECT_AFTER, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)
