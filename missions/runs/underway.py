"""A run that somebody steps: what ``run`` does at once, tick by tick, with its results so far."""

from __future__ import annotations

import time
from functools import cached_property
from typing import Any

import pyarrow as pa
import tomli_w

from missions.runs.run import Run, result_of
from missions.runs.setup import Setup, assemble
from missions.runs.summary import identity
from missions.runs.tables import arrow_table
from remoras.version import __version__


class Underway:
    """A run between its start and its end.

    Args:
        setup: the scenario resolved.
        seed: root of all draws.

    Attributes:
        spent_s: what its steps took on this machine (s).
    """

    def __init__(self, setup: Setup, seed: int) -> None:
        self.setup = setup
        self.seed = seed
        self.spent_s = 0.0
        self._fleet = assemble(setup, seed)

    @property
    def now_s(self) -> float:
        """Time of the mission (s)."""
        return self._fleet.now_s

    @property
    def is_running(self) -> bool:
        """True until the mission is complete or its time is over."""
        return bool(self._fleet.running)

    def step(self) -> None:
        """Let one tick of motion pass, and all that is said and heard before it."""
        began = time.perf_counter()
        self._fleet.step()
        self.spent_s += time.perf_counter() - began

    def so_far(self, reason: str) -> SoFar:
        """Results until now; ``reason`` says why the mission is not complete. They hold until the next step."""
        return SoFar(self, reason)

    def finish(self) -> Run:
        """The finished run, as ``run`` gives it; after that the vehicles are gone."""
        result = result_of(self.setup, self.seed, self._fleet, self.spent_s)
        self._fleet.close()
        return result

    def tables(self) -> dict[str, pa.Table]:
        """All tables as they are now."""
        recorder = self._fleet.recorder
        return {name: arrow_table(table, recorder.rows(name)) for name, table in recorder.tables.items()}

    def figures(self) -> dict[str, Any]:
        """Figures that a run has before its end, by their names in the summary."""
        truth = self._fleet.truth
        return {
            **identity(self.setup.scenario, self.seed),
            "completed": self._fleet.completed,
            "goal_fraction": truth.goal_fraction,
            "mission_time_s": self.now_s,
            "milestones": [
                {"name": m.name, "vehicle": m.vehicle, "group": m.group, "time_s": m.time_s} for m in truth.milestones
            ],
        }


class SoFar:
    """Results of a run until now: what those who show runs read of any, see ``missions.figure.RunResults``."""

    def __init__(self, underway: Underway, reason: str) -> None:
        self._underway = underway
        self._reason = reason

    @cached_property
    def _tables(self) -> dict[str, pa.Table]:
        return self._underway.tables()

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Figures that a run has before its end."""
        return {**self._underway.figures(), "reason": self._reason}

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """Version, seed and resolved scenario."""
        scenario = self._underway.setup.scenario.model_dump(mode="json", exclude_none=True)
        return {"version": __version__, "seed": self._underway.seed, "scenario": tomli_w.dumps(scenario)}

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables."""
        return tuple(sorted(self._tables))

    def has(self, name: str) -> bool:
        """True if there is a table of that name."""
        return name in self._tables

    def table(self, name: str) -> pa.Table:
        """An Arrow table."""
        return self._tables[name]
