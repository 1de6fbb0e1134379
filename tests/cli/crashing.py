"""Runs that crash, for the tests of the program and of its page."""

import pytest

from missions.runs.underway import Underway


class Crash:
    """Lets runs underway crash at a time of the mission."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self._patch, self._step = patch, Underway.step

    def at(self, time_s: float) -> None:
        def step(run: Underway) -> None:
            if run.now_s >= time_s:
                raise RuntimeError("the hull broke")
            self._step(run)

        self._patch.setattr(Underway, "step", step)

    def never(self) -> None:
        self._patch.setattr(Underway, "step", self._step)
