"""Run stepped by the caller: ``for state in remoras.stepping("mapping-rendezvous"): ...``."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from missions.errors import OutputError
from missions.runs.assembly import assemble
from missions.runs.reader import RunReader
from missions.runs.results import MemoryResults, identity, milestone_rows
from missions.runs.run import Root, result_of, settled_of
from missions.runs.setup import resolved
from missions.runs.tables import arrow_table
from remoras.api import Run
from remoras.recorder import PACKETS, Row
from remoras.truth import Milestone
from remoras.version import __version__

if TYPE_CHECKING:
    import pyarrow as pa
    from pandas import DataFrame

    from missions.figure import Place
    from missions.scenarios import Scenario
    from remoras.fleet.fleet import Fleet
    from remoras.strategy import Strategy

END, ARRIVALS = (PACKETS.column_names.index(name) for name in ("end_s", "arrivals_s"))


@dataclass(frozen=True)
class VehicleNow:
    """True state of a vehicle: x east, y north, speed over ground; roles in its own view."""

    x_m: float
    y_m: float
    speed_mps: float
    is_alive: bool
    roles: tuple[str, ...]
    activities: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class MissionState:
    """Immutable state after a motion tick: share of the goal, 0..1, and new milestones; ``is_over`` at the end.

    >>> from remoras.api import stepping
    >>> state: MissionState = next(stepping("mapping-rendezvous"))
    >>> state
    <MissionState at 0 s: 0% of the goal, 4 vehicles>
    """

    time_s: float
    goal_fraction: float
    vehicles: Mapping[str, VehicleNow]
    milestones: tuple[Milestone, ...]
    completed: bool
    is_over: bool

    def __repr__(self) -> str:
        return (
            f"<MissionState at {self.time_s:g} s: {self.goal_fraction:.0%} of the goal, {len(self.vehicles)} vehicles>"
        )


class RunSoFar(RunReader):
    """Run between start and end; ``failure`` is the reason why it cannot continue, else empty."""

    def __init__(self, scenario: Scenario, seed: int, fleet: Fleet, failure: str = "") -> None:
        self._scenario, self._seed, self._failure = scenario, seed, failure
        self.fleet = fleet

    @property
    def scenario(self) -> Scenario:
        return self._scenario

    @property
    def summary(self) -> dict[str, Any]:
        truth = self.fleet.truth
        return {
            **identity(self.scenario, self._seed),
            "completed": False,
            "reason": self._failure,
            "is_underway": not self._failure,
            "goal_fraction": truth.goal_fraction,
            "mission_time_s": self.fleet.now_s,
            "milestones": milestone_rows(truth.milestones),
        }

    @property
    def manifest(self) -> dict[str, Any]:
        return {"version": __version__, "seed": self._seed, "scenario": self.scenario.text}

    @property
    def tables(self) -> tuple[str, ...]:
        return tuple(sorted(self.fleet.recorder.tables))

    def _read(self, name: str) -> pa.Table:
        return arrow_table(self.fleet.recorder.tables[name], self._settled_rows(name))

    def _settled_rows(self, name: str) -> Sequence[Row]:
        rows = self.fleet.recorder.rows(name)
        if name != PACKETS.name or not self.fleet.running:
            return rows
        n = len(rows)
        # Rows of packets under way still change, and only the newest are.
        while n and max([rows[n - 1][END], *rows[n - 1][ARRIVALS]]) >= self.fleet.now_s:
            n -= 1
        return rows[:n]


class Stepping:
    """Iterator over the states of a run, one per tick; callers that stop early call ``close``.

    >>> from remoras.api import load
    >>> with Stepping(load("mapping-rendezvous"), seed=1) as steps:
    ...     next(steps), next(steps)
    (<MissionState at 0 s: 0% of the goal, 4 vehicles>, <MissionState at 1 s: 0% of the goal, 4 vehicles>)
    """

    def __init__(self, scenario: Scenario, seed: int, strategy: Strategy | None = None) -> None:
        self._seed = Root(seed)
        self._setup = resolved(scenario.for_seed(self._seed), strategy)
        self._fleet = assemble(self._setup, self._seed)
        self._spent_s = 0.0
        self._n_earlier = 0  # milestones before the last step
        self._final: MemoryResults | None = None
        self._is_whole = True
        self._is_closed = False

    def __repr__(self) -> str:
        how = "ended" if self._final else "is underway"
        return f"<Stepping of {self._setup.scenario.scenario.name}: {how}, {self._fleet.now_s:g} s>"

    def __iter__(self) -> Iterator[MissionState]:
        return self

    def __next__(self) -> MissionState:
        if self._final or not self._fleet.running:
            self.run()
            raise StopIteration
        self._n_earlier = len(self._fleet.truth.milestones)
        self._step()
        return self.state

    @property
    def state(self) -> MissionState:
        """State after the last step."""
        fleet = self._fleet
        vehicles = {
            vehicle.name: VehicleNow(
                *vehicle.position_m,
                vehicle.speed_mps,
                vehicle.is_alive,
                tuple(sorted(f"{role.group}.{role.role}" for role in vehicle.organisation.roles_of(vehicle.name))),
                vehicle.performed if vehicle.is_alive else (),
            )
            for vehicle in fleet.view.vehicles
        }
        milestones = tuple(fleet.truth.milestones[self._n_earlier :])
        how = fleet.completed, not fleet.running
        return MissionState(fleet.now_s, fleet.truth.goal_fraction, vehicles, milestones, *how)

    def position_ages_s(self, vehicle: str) -> dict[str, float]:
        """Return the ages (s) of the newest positions of all others that a vehicle knows; 0 s is the start."""
        fleet = self._fleet
        observed_s = fleet.named(vehicle).beliefs.observed_s
        others = (name for name in fleet.names if name != vehicle)
        return {name: fleet.now_s - (observed_s(("position", name)) or 0.0) for name in others}

    @property
    def places(self) -> Sequence[Place]:
        """Places of the mission."""
        return self._setup.mission.places

    def _step(self) -> None:
        if not self._is_whole:
            raise OutputError("the run was interrupted within a step, so it has no results; restart it")
        self._is_whole = False
        began = time.perf_counter()
        self._fleet.step()
        self._spent_s += time.perf_counter() - began
        self._is_whole = True

    def table(self, name: str) -> DataFrame:
        """Return the current rows of a table; raise OutputError for an unknown table."""
        frame: DataFrame = self._so_far().table(name).to_pandas()
        return frame

    def run(self) -> Run:
        """Run the remaining steps and return the finished run."""
        if self._final is None:
            while self._fleet.running:
                self._step()
            settled = settled_of(self._setup, self._fleet)
            self._final = MemoryResults(result_of(self._setup, self._seed, self._fleet, self._spent_s, settled))
            self.close()
        return Run(self._final)

    def shown(self, reason: str = "") -> bytes:
        """Return the current data of the page; ``reason`` explains why the run cannot continue."""
        from visualisation.replay import run_data

        mission, communicates = self._setup.mission, self._setup.strategy.declaration.communicates
        return run_data(self._final or self._so_far(reason), mission.places, mission.jobs.values(), communicates)

    def _so_far(self, failure: str = "") -> RunSoFar:
        return RunSoFar(self._setup.scenario, int(self._seed), self._fleet, failure)

    def close(self) -> None:
        """Release the vehicles of an unfinished run."""
        if not self._is_closed:
            self._is_closed = True
            self._fleet.close()

    def __enter__(self) -> Stepping:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
