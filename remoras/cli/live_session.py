"""A run that a page steers: a thread steps the fleet, and keeps what the page shows of it."""

from __future__ import annotations

import base64
import sys
import threading
import time
import traceback
from enum import StrEnum
from pathlib import Path
from typing import Any

from missions.errors import MissionsError
from missions.figure import RunResults
from missions.runs.results import MemoryResults, write
from missions.runs.setup import Setup
from missions.runs.underway import Underway
from remoras.fleet import rare_collections
from visualisation.replay import run_data

USUAL_SPEED = 60.0
LEAST_GAP_S = 0.4
"""The page gets new rows no more often than this."""
SHARE_AT_FULL_SPEED, SHARE = 1 / 10, 1 / 3
"""Of the time, so much goes into showing the run at most: at full speed, and where steps wait for the clock."""


class Phase(StrEnum):
    """What a live run does."""

    READY = "ready"
    RUNNING = "running"
    PAUSED = "paused"
    FINISHED = "finished"
    CRASHED = "crashed"


WHY_NOT_COMPLETE = "the run is not over"


class Session:
    """One run after the other, all of one seed; every method may be called from any thread.

    Args:
        setup: of the first run.
        seed: root of all draws of every run.
        out: folder for the results of the last run that finished; None keeps none. What is there is replaced.

    Attributes:
        rows: what the page shows of the run, as text; n_rows: how often that has changed.
    """

    def __init__(self, setup: Setup, seed: int, out: Path | None) -> None:
        self.seed = seed
        self.out = out
        self.rows = ""
        self.n_rows = 0
        self._changed = threading.Condition()
        self._asked: Setup | None = setup
        self._is_closing = False
        self._phase = Phase.READY
        self._speed: float | None = USUAL_SPEED
        self._n_steps = 0
        self._now_s = 0.0
        self._message = ""
        self._since = (0.0, 0.0)  # times of wall and mission from which the speed counts
        self._shown_at_s = self._shown_for_s = self._cost_s = 0.0
        self._thread = threading.Thread(target=self._work, name="live run", daemon=True)
        self._thread.start()

    # What the page asks for

    def state(self) -> dict[str, Any]:
        """What the page says of the run: phase, time_s, speed (None: full), message."""
        with self._changed:
            return {
                "phase": self._phase.value, "time_s": self._now_s, "speed": self._speed, "message": self._message
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
            self._since = (time.monotonic(), self._now_s)
            self._changed.notify_all()

    def restart(self, setup: Setup, is_playing: bool) -> None:
        """Give the run up, and begin another one of the same seed."""
        with self._changed:
            self._asked = setup
            self._phase = Phase.RUNNING if is_playing else Phase.READY
            self._n_steps, self._now_s, self._message = 0, 0.0, ""
            self._since = (time.monotonic(), 0.0)
            self._changed.notify_all()

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._is_closing = True
            self._changed.notify_all()
        self._thread.join()

    def _set_phase(self, phase: Phase, n_steps: int = 0) -> None:
        with self._changed:
            if self._phase not in (Phase.FINISHED, Phase.CRASHED):
                self._phase = phase
                self._n_steps = n_steps
                self._since = (time.monotonic(), self._now_s)
                self._changed.notify_all()

    # The thread

    def _work(self) -> None:
        while True:
            with self._changed:
                while self._asked is None and not self._is_closing:
                    self._changed.wait()
                if self._is_closing or self._asked is None:
                    return
                setup, self._asked = self._asked, None
                self._now_s, self._since = 0.0, (time.monotonic(), 0.0)
            underway = None
            try:
                underway = Underway(setup, self.seed)
                with rare_collections():
                    self._run(underway)
            except (Exception, SystemExit) as error:
                self._crash(underway, error)

    def _run(self, underway: Underway) -> None:
        """Step a run to its end, or until it is given up."""
        self._show(underway.setup, underway.so_far(WHY_NOT_COMPLETE), underway.spent_s)
        while underway.is_running:
            if not self._may_step(underway):
                return
            underway.step()
            self._now_s = underway.now_s
            if self._is_time_to_show(underway.spent_s):
                self._show(underway.setup, underway.so_far(WHY_NOT_COMPLETE), underway.spent_s)
        self._finish(underway)

    def _may_step(self, underway: Underway) -> bool:
        """Wait until the next step is due; False if the run is given up. What stands still is shown meanwhile."""
        while True:
            with self._changed:
                if self._asked is not None or self._is_closing:
                    return False
                if self._phase is Phase.RUNNING:
                    left_s = self._left_s(underway.now_s)
                    if left_s <= 0.0:
                        return True
                    self._changed.wait(left_s)
                    continue
                if self._n_steps:
                    self._n_steps -= 1
                    return True
                if self._shown_for_s == underway.spent_s:
                    self._changed.wait()
                    continue
            self._show(underway.setup, underway.so_far(WHY_NOT_COMPLETE), underway.spent_s)

    def _left_s(self, now_s: float) -> float:
        """Time (s) until the clock on the wall is where the mission is."""
        if self._speed is None:
            return 0.0
        wall_s, mission_s = self._since
        return wall_s + (now_s - mission_s) / self._speed - time.monotonic()

    def _is_time_to_show(self, spent_s: float) -> bool:
        if time.monotonic() - self._shown_at_s < LEAST_GAP_S:
            return False
        if self._speed is None:
            return spent_s - self._shown_for_s >= self._cost_s / SHARE_AT_FULL_SPEED
        return time.monotonic() - self._shown_at_s >= self._cost_s / SHARE

    def _show(self, setup: Setup, results: RunResults, spent_s: float) -> None:
        """Keep what the page shows of a run."""
        began = time.perf_counter()
        mission, is_bound = setup.mission, setup.strategy.declaration.is_bound
        rows = base64.b64encode(run_data(results, mission.places, mission.jobs.values(), is_bound)).decode()
        with self._changed:
            if self._asked is None:
                self.rows, self.n_rows = rows, self.n_rows + 1
        self._shown_for_s, self._shown_at_s = spent_s, time.monotonic()
        self._cost_s = time.perf_counter() - began

    def _finish(self, underway: Underway) -> None:
        finished = underway.finish()
        self._show(underway.setup, MemoryResults(finished), underway.spent_s)
        how = "completed" if finished.completed else f"not completed: {finished.reason}"
        where = "no folder was named with --out, so the results are not kept"
        if self.out is not None:
            try:
                write(finished, self.out, force=True)
                where = f"results in {self.out}"
            except MissionsError as error:
                where = f"the results are not kept: {error}"
        self._end(Phase.FINISHED, f"{how}; {where}")

    def _crash(self, underway: Underway | None, error: BaseException) -> None:
        """Say what happened, and show what was there until then."""
        traceback.print_exception(error, file=sys.stderr)
        at = "before its start" if underway is None else f"at {self._now_s:.1f} s"
        told = f"the run crashed {at}: {type(error).__name__}: {error}"
        if underway is not None:
            try:
                self._show(underway.setup, underway.so_far(told), underway.spent_s)
            except Exception as second:  # rows of the crash that cannot be shown; the page keeps those before
                told += f" (its last rows cannot be shown: {second})"
        self._end(Phase.CRASHED, told)

    def _end(self, phase: Phase, message: str) -> None:
        with self._changed:
            if self._asked is None:
                self._phase, self._message = phase, message
