"""A run that a page steers: one thread steps the fleet, and hands what is new to those who watch."""

from __future__ import annotations

import sys
import threading
import time
import traceback
from enum import Enum, StrEnum, auto
from pathlib import Path
from typing import Any

from missions.errors import MissionsError
from missions.runs.results import MemoryResults, write_results
from missions.runs.setup import Setup
from missions.runs.underway import Underway
from remoras.cli.live.audience import Audience
from remoras.collecting import rare_collections

USUAL_SPEED = 60.0
LONGEST_LAG_S = 0.5
"""A run that the machine cannot make as fast as it was asked for does not catch up more than this."""


class Phase(StrEnum):
    """What a live run does."""

    READY = "ready"
    RUNNING = "running"
    PAUSED = "paused"
    FINISHED = "finished"
    CRASHED = "crashed"


OVER = (Phase.FINISHED, Phase.CRASHED)


class SessionTask(Enum):
    """What the thread does next."""

    BEGIN = auto()
    STEP = auto()
    TELL = auto()
    CLOSE = auto()


class Session:
    """One run after the other, all of one seed; every method may be called from any thread.

    Args:
        setup: of the first run.
        seed: root of all draws of every run.
        out: folder for the results of the last run that finished; None keeps none.
        force: replace results that were there before the session; those of its own are replaced in any case.

    Attributes:
        audience: those who watch.
    """

    def __init__(self, setup: Setup, seed: int, out: Path | None = None, force: bool = False) -> None:
        self.seed = seed
        self._out = out
        self._may_replace = force
        self._changed = threading.Condition()
        self.audience = Audience(self._changed)
        self._asked: Setup | None = setup
        self._is_closing = False
        self._phase = Phase.READY
        self._speed: float | None = USUAL_SPEED
        self._n_steps = 0  # to be made while it stands still
        self._skip_to_s = 0.0  # the clock on the wall does not count before
        self._since = (0.0, 0.0)  # times of wall and mission from which the speed counts
        self._message = ""
        self._underway: Underway | None = None
        self._final: dict[str, Any] | None = None  # summary of a run that is over
        self._thread = threading.Thread(target=self._work, name="live run", daemon=True)
        self._thread.start()

    # What others ask for

    def state(self) -> dict[str, Any]:
        """What the page says of the run: phase, time_s, speed (None: full), message."""
        with self._changed:
            now_s = self._underway.now_s if self._underway is not None and self._asked is None else 0.0
            return {
                "phase": self._phase.value, "time_s": now_s, "speed": self._speed, "message": self._message
            }  # fmt: skip

    def play(self) -> None:
        """Go on; nothing happens to a run that is over."""
        self._set_phase(Phase.RUNNING)

    def pause(self) -> None:
        """Stand still after the step that is being made."""
        self._set_phase(Phase.PAUSED)

    def step(self, n: int) -> None:
        """Make ``n`` steps (ticks of motion) and stand still."""
        self._set_phase(Phase.PAUSED, n)

    def set_speed(self, speed: float | None) -> None:
        """Let the mission go on at so many times real time; None: as fast as the machine can."""
        with self._changed:
            self._speed = speed
            self._count_from_here()
            self._changed.notify_all()

    def restart(self, setup: Setup, is_playing: bool, skip_to_s: float = 0.0) -> None:
        """Give the run up, and begin another one of the same seed.

        Args:
            setup: of the other one.
            is_playing: it goes on by itself.
            skip_to_s: up to this time of the mission (s) it is made at once.
        """
        with self._changed:
            self._asked = setup
            self._phase = Phase.RUNNING if is_playing else Phase.PAUSED if skip_to_s else Phase.READY
            self._n_steps, self._skip_to_s, self._message = 0, skip_to_s, ""
            self._changed.notify_all()

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._is_closing = True
            self._changed.notify_all()
        self._thread.join()

    def _set_phase(self, phase: Phase, n_steps: int = 0) -> None:
        with self._changed:
            if self._phase not in OVER:
                self._phase = phase
                self._n_steps = n_steps
                self._count_from_here()
                self._changed.notify_all()

    def _count_from_here(self) -> None:
        self._since = (time.monotonic(), 0.0 if self._underway is None else self._underway.now_s)

    # The thread

    @rare_collections()
    def _work(self) -> None:
        while (task := self._next()) is not SessionTask.CLOSE:
            if task is SessionTask.BEGIN:
                self._begin()
            elif task is SessionTask.STEP:
                self._make_step()
            else:
                self._tell()

    def _next(self) -> SessionTask:
        """Wait for what is to be done."""
        with self._changed:
            while True:
                if self._is_closing:
                    return SessionTask.CLOSE
                if self._asked is not None:
                    return SessionTask.BEGIN
                if self._is_skipping:
                    return SessionTask.STEP
                until_step_s = self._until_step_s()
                until_tell_s = None if self._underway is None else self.audience.until_s()
                if until_tell_s is not None and until_tell_s <= 0.0:
                    return SessionTask.TELL
                if until_step_s is not None and until_step_s <= 0.0:
                    self._n_steps = max(0, self._n_steps - 1)
                    return SessionTask.STEP
                self._changed.wait(min((s for s in (until_tell_s, until_step_s) if s is not None), default=None))

    @property
    def _is_skipping(self) -> bool:
        """True while the run is made at once up to a time; nobody is told before."""
        underway = self._underway
        return underway is not None and self._phase not in OVER and underway.now_s < self._skip_to_s

    def _until_step_s(self) -> float | None:
        """Time (s) until the next step is due; None if the run stands still or is over."""
        underway = self._underway
        if underway is None or self._phase in OVER:
            return None
        if self._n_steps:
            return 0.0
        if self._phase is not Phase.RUNNING:
            return None
        if self._speed is None:
            return 0.0
        wall_s, mission_s = self._since
        left_s = wall_s + (underway.now_s - mission_s) / self._speed - time.monotonic()
        if left_s < -LONGEST_LAG_S:
            self._count_from_here()
        return left_s

    def _begin(self) -> None:
        with self._changed:
            setup, self._asked = self._asked, None
            before, self._underway, self._final = self._underway, None, None
            self.audience.begin()
        if before is not None:
            before.close()
        if setup is None:
            return
        try:
            underway = Underway(setup, self.seed)
        except (Exception, SystemExit) as error:
            self._crash(error, "before its start")
            return
        with self._changed:
            self._underway = underway
        self._make_step()  # of no time: what there is at 0 s
        self._count_from_here()

    def _make_step(self) -> None:
        underway = self._underway
        if underway is None:
            return
        was_skipping = self._is_skipping
        try:
            underway.step()
            self.audience.note()
            if not underway.is_running:
                self._finish(underway)
            elif was_skipping and not self._is_skipping:
                self._count_from_here()
        except (Exception, SystemExit) as error:  # missions, strategies and sensors are anybody's
            self._crash(error, f"at {underway.now_s:.1f} s")

    def _finish(self, underway: Underway) -> None:
        finished = underway.finish()
        how = "completed" if finished.completed else f"not completed: {finished.reason}"
        where = "no folder was named with --out, so the results are not kept"
        results = MemoryResults(finished)
        if self._out is not None:
            try:
                write_results(results, self._out, self._may_replace)
                self._may_replace = True
                where = f"results in {self._out}"
            except MissionsError as error:
                where = f"the results are not kept: {error}"
        self._end(Phase.FINISHED, f"{how}; {where}", results.summary)

    def _crash(self, error: BaseException, when: str) -> None:
        traceback.print_exception(error, file=sys.stderr)
        told = f"{type(error).__name__}: {error}"
        kept = "it had not begun" if self._underway is None else "what had happened until then is kept on this page"
        summary = None if self._underway is None else self._underway.summary(f"crashed {when}")
        self._end(Phase.CRASHED, f"{told}; {kept}", summary)

    def _end(self, phase: Phase, message: str, summary: dict[str, Any] | None) -> None:
        with self._changed:
            if self._asked is None:
                self._phase, self._message, self._final = phase, message, summary
                self.audience.note(is_last=True)

    def _tell(self) -> None:
        if self._underway is None:
            return
        try:
            self.audience.tell(self._underway, self._final or self._underway.summary())
        except Exception as error:  # rows of a mission's own that do not fit their table; the run itself goes on
            with self._changed:
                self._message = self._message or f"what is new cannot be shown: {error}"
