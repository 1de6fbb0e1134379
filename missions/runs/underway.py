"""A run that somebody steps: what ``run`` does at once, tick by tick, and its results so far."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa
import tomli_w

from missions.runs.assembly import assemble
from missions.runs.root import Root
from missions.runs.run import Run, result_of, settled_of
from missions.runs.setup import Setup
from missions.runs.summary import identity
from missions.runs.tables import arrow_table
from remoras.mission import FleetView, Milestone
from remoras.recorder import PACKETS, Row
from remoras.version import __version__

IS_UNDERWAY = "is_underway"
"""Key of a summary: the run goes on."""
END, ARRIVALS = (PACKETS.column_names.index(name) for name in ("end_s", "arrivals_s"))


class Underway:
    """A run between its start and its end.

    Args:
        setup: the scenario resolved.
        seed: root of all draws.

    Attributes:
        now_s: time of the mission (s).
        is_running: True until the mission is complete or its time is over.
        recorder: its rows so far.
    """

    def __init__(self, setup: Setup, seed: int) -> None:
        self.setup = setup
        self.seed = seed
        self._spent_s = 0.0
        self._is_closed = False
        self._root = Root(seed)
        self._fleet = assemble(setup, self._root)
        self.recorder = self._fleet.recorder
        self._truth = self._fleet.truth
        self.now_s = self._fleet.now_s
        self.is_running = bool(self._fleet.running)

    def step(self) -> None:
        """Let one tick of motion pass, and all that is said and heard before it."""
        began = time.perf_counter()
        self._fleet.step()
        self.now_s, self.is_running = self._fleet.now_s, bool(self._fleet.running)
        self._spent_s += time.perf_counter() - began

    @property
    def view(self) -> FleetView:
        """The vehicles as they really are now."""
        return self._fleet.view

    @property
    def milestones(self) -> Sequence[Milestone]:
        """What happened so far, in time order."""
        return tuple(self._truth.milestones)

    @property
    def goal_fraction(self) -> float:
        """Share of the mission's whole goal that is reached on the ground, 0..1."""
        return self._truth.goal_fraction

    def finish(self) -> Run:
        """The finished run, as ``run`` gives it; the vehicles are gone after that."""
        settled = settled_of(self.setup, self._fleet)
        result = result_of(self.setup, self._root, self._fleet, self._spent_s, settled)
        self.close()
        return result

    def close(self) -> None:
        """Let go of the vehicles; what was recorded stays."""
        if not self._is_closed:
            self._is_closed = True
            self._fleet.close()

    def rows(self, name: str) -> Sequence[Row]:
        """Rows of a table of which nothing will change: a packet is one once it has been heard by all who hear it."""
        rows = self.recorder.rows(name)
        if name != PACKETS.name or not self.is_running:
            return rows
        n = len(rows)
        while n and max([rows[n - 1][END], *rows[n - 1][ARRIVALS]]) >= self.now_s:
            n -= 1
        return rows[:n]

    def table(self, name: str) -> pa.Table:
        """An Arrow table of the rows so far."""
        return arrow_table(self.recorder.tables[name], self.rows(name))

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables."""
        return tuple(sorted(self.recorder.tables))

    def summary(self, reason: str = "") -> dict[str, Any]:
        """The figures that a run has before its end; ``reason`` says why there is no other end, if it is one."""
        return {
            **identity(self.setup.scenario, self.seed),
            "completed": False,
            "reason": reason,
            IS_UNDERWAY: not reason,
            "goal_fraction": self._truth.goal_fraction,
            "mission_time_s": self.now_s,
            "milestones": [
                {"name": m.name, "vehicle": m.vehicle, "group": m.group, "time_s": m.time_s}
                for m in self._truth.milestones
            ],
        }

    def manifest(self) -> dict[str, Any]:
        """Version, seed and resolved scenario."""
        scenario = self.setup.scenario.model_dump(mode="json", exclude_none=True)
        return {"version": __version__, "seed": self.seed, "scenario": tomli_w.dumps(scenario)}


@dataclass(frozen=True)
class ResultsSoFar:
    """What there is of a run underway, read as results are (``missions.figure.RunResults``).

    Attributes:
        underway: the run.
        reason: why it ended before its end; empty while it goes on.
    """

    underway: Underway
    reason: str = ""

    @property
    def summary(self) -> dict[str, Any]:
        """The figures of the run."""
        return self.underway.summary(self.reason)

    @property
    def manifest(self) -> dict[str, Any]:
        """Version, seed and resolved scenario."""
        return self.underway.manifest()

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables."""
        return self.underway.tables

    def has(self, name: str) -> bool:
        """True if there is a table of that name."""
        return name in self.tables

    def table(self, name: str) -> pa.Table:
        """An Arrow table; raises KeyError if there is none of that name."""
        return self.underway.table(name)
