"""One run of a scenario, in memory."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from missions.files import OURS, is_reference, texts
from missions.runs.assembly import assemble
from missions.runs.setup import Setup, resolved
from missions.scenarios.scenario import Scenario
from remoras.fleet.final_exchange import Settled, settle
from remoras.fleet.fleet import Fleet
from remoras.mission import Milestone, Mission
from remoras.recorder import Recorder
from remoras.strategy import Strategy
from remoras.truth import reachable_fraction


class Root(int):
    """Seed that records its use: ``exchange.channel.loss`` adds 1 to it before each draw, so none goes unrecorded.

    >>> seed = Root(7)
    >>> seed.is_drawn_from, seed + 1, seed.is_drawn_from
    (False, 8, True)
    """

    is_drawn_from = False

    def __add__(self, other: int) -> int:
        self.is_drawn_from = True
        return int(self) + other


def is_drawn(root: int, scenario: Scenario, strategy: object) -> bool | None:
    """True if the run drew random numbers; None if unknown, as user code may draw unseen."""
    if not isinstance(root, Root) or root.is_drawn_from:
        return True
    is_ours = type(strategy).__module__.partition(".")[0] in OURS
    parts = scenario.model_dump(mode="json", exclude={"scenario": {"metrics"}})  # metrics are computed after the run
    return False if is_ours and not any(map(is_reference, texts(parts))) else None


@dataclass(frozen=True, repr=False)
class Run:
    """Finished run, before results are written.

    Attributes:
        goal_fraction: share of the mission's whole goal that was achieved, 0..1.
        reachable_fraction: share achieved, or achievable by the remaining vehicles at the end.
        reason: for failure; empty after success.
        ended_s: time at which the run ended.
        n_false_beliefs: wrong beliefs that a peer held a block.
        wrong_belief_fraction: share of wrong beliefs about job holders.
        settled: outcome of the exchange after the mission; None without one.
        drawn: whether random numbers were drawn; None if unknown.
    """

    setup: Setup
    seed: int
    recorder: Recorder
    milestones: tuple[Milestone, ...]
    goal_fraction: float
    reachable_fraction: float
    completed: bool
    reason: str
    ended_s: float
    n_false_beliefs: int
    distance_m: float
    wall_s: float
    wrong_belief_fraction: float | None = None
    settled: Settled | None = None
    drawn: bool | None = True

    @property
    def scenario(self) -> Scenario:
        """Resolved scenario."""
        return self.setup.scenario

    @property
    def mission(self) -> Mission:
        """Mission of the run."""
        return self.setup.mission

    @property
    def end_s(self) -> float:
        """Mission time (s); the full duration if the mission did not complete."""
        return self.ended_s if self.completed else self.scenario.scenario.duration_s

    def __repr__(self) -> str:
        how = "completed" if self.completed else f"not completed: {self.reason}"
        return f"<Run of {self.scenario.scenario.name}, seed {self.seed}: {how}, {self.ended_s:.1f} s>"


def run(
    scenario: Scenario, seed: int = 1, progress: Callable[[float], None] | None = None, strategy: Strategy | None = None
) -> Run:
    """Run a scenario to its end; ``seed`` is the root of all draws, ``progress`` receives the mission time (s).

    ``strategy`` replaces that of the scenario.
    """
    began, seed = time.perf_counter(), Root(seed)
    setup = resolved(scenario.for_seed(seed), strategy)
    fleet = assemble(setup, seed)
    fleet.run(progress)
    settled = settled_of(setup, fleet)
    result = result_of(setup, seed, fleet, time.perf_counter() - began, settled)
    fleet.close()
    return result


def settled_of(setup: Setup, fleet: Fleet) -> Settled | None:
    """Continue the exchange after the mission if the scenario asks for it."""
    settle_s = setup.scenario.scenario.settle_s
    return settle(fleet, settle_s) if settle_s > 0.0 else None


def result_of(setup: Setup, seed: int, fleet: Fleet, wall_s: float, settled: Settled | None = None) -> Run:
    """Return the run of a fleet that has stopped; ``wall_s`` is its wall-clock time."""
    return Run(
        setup,
        int(seed),
        fleet.recorder,
        tuple(fleet.truth.milestones),
        fleet.truth.goal_fraction,
        reachable_fraction(fleet.truth, setup.mission.jobs, setup.agreement.groups, fleet.view),
        fleet.completed,
        fleet.reason,
        fleet.ended_s,
        fleet.n_false_beliefs,
        math.fsum(vehicle.functional.motion.distance_m for vehicle in fleet.vehicles),
        wall_s,
        fleet.holders.wrong_fraction,
        settled,
        is_drawn(seed, setup.scenario, setup.strategy),
    )
