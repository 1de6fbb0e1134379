"""One run of a scenario, in memory."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from exchange.acoustics.channel import Channel
from missions.files import OURS, is_reference, texts
from missions.runs.assembly import assemble
from missions.runs.setup import Setup, resolved
from missions.scenarios.scenario import Scenario
from remoras.fleet import Fleet
from remoras.mission import Milestone, Mission
from remoras.recorder import Recorder
from remoras.settling import Settled, settle
from remoras.strategy import Strategy
from remoras.truth import reachable_fraction


class Root(int):
    """A seed that notes whether anything was drawn from it.

    All draws are made by ``exchange.acoustics.loss``, which adds 1 to the seed before it scrambles it. So nobody who
    draws can forget to say so, and nothing is asked of those who do not.

    >>> seed = Root(7)
    >>> seed.is_drawn_from, seed + 1, seed.is_drawn_from
    (False, 8, True)
    """

    is_drawn_from = False

    def __add__(self, other: int) -> int:
        self.is_drawn_from = True
        return int(self) + other


def is_drawn(root: int, scenario: Scenario, strategy: object) -> bool | None:
    """Whether anything was drawn in a run; None where nobody can say, for parts of a user's own may draw unseen.

    Args:
        root: of its draws.
        scenario: of the run.
        strategy: of the run.
    """
    if not isinstance(root, Root) or root.is_drawn_from:
        return True
    is_ours = type(strategy).__module__.partition(".")[0] in OURS
    parts = scenario.model_dump(mode="json", exclude={"scenario": {"metrics"}})  # which are asked when the run is over
    return False if is_ours and not any(map(is_reference, texts(parts))) else None


@dataclass(frozen=True, repr=False)
class Run:
    """A finished run, before anything is written.

    Attributes:
        setup: the scenario resolved; seed: root of its draws.
        recorder: its tables; milestones: in time order.
        goal_fraction: share of the mission's whole goal that was reached on the ground, 0..1.
        reachable_fraction: share that was reached, or was within reach of the vehicles left at the end.
        completed: the mission is complete; reason: why not, else empty.
        end_s: mission time; the whole duration where the mission is not complete.
        n_false_beliefs: how often a vehicle came to believe that a peer held what that peer lacked.
        distance_m: travelled by the whole fleet; wall_s: what the run took on this machine.
        wrong_belief_fraction: how often one was wrong that a vehicle named as the holder of a job.
        settled: how the exchange after the mission ended; None where there is none.
        drawn: whether anything was drawn; None where parts of a user's own may have drawn unseen.
    """

    setup: Setup
    seed: int
    recorder: Recorder
    milestones: tuple[Milestone, ...]
    goal_fraction: float
    reachable_fraction: float
    completed: bool
    reason: str
    end_s: float
    n_false_beliefs: int
    distance_m: float
    wall_s: float
    wrong_belief_fraction: float | None = None
    settled: Settled | None = None
    drawn: bool | None = True

    @property
    def scenario(self) -> Scenario:
        """The whole input."""
        return self.setup.scenario

    @property
    def mission(self) -> Mission:
        """The mission that was run."""
        return self.setup.mission

    def __repr__(self) -> str:
        how = "completed" if self.completed else f"not completed: {self.reason}"
        return f"<Run of {self.scenario.scenario.name}, seed {self.seed}: {how}, {self.end_s:.1f} s>"


def run(
    scenario: Scenario,
    seed: int = 1,
    channel: Channel | None = None,
    progress: Callable[[float], None] | None = None,
    strategy: Strategy | None = None,
) -> Run:
    """Run a scenario to its end.

    Args:
        scenario: the whole input.
        seed: root of all draws.
        channel: replaces the scenario's, for tests and experiments; what it draws is not seen.
        progress: is told the mission time (s) now and then.
        strategy: replaces the one that the scenario names.
    """
    return run_of(resolved(scenario, strategy), seed, channel, progress)


def run_of(
    setup: Setup, seed: int = 1, channel: Channel | None = None, progress: Callable[[float], None] | None = None
) -> Run:
    """Run a scenario that is resolved: any number of runs may share what follows from it.

    Args:
        setup: the scenario resolved.
        seed, channel, progress: see ``run``.
    """
    began = time.perf_counter()
    seed = Root(seed)
    fleet = assemble(setup, seed, channel)
    fleet.run(progress)
    settled = settled_of(setup, fleet)
    result = result_of(setup, seed, fleet, time.perf_counter() - began, settled)
    fleet.close()
    return result if channel is None else replace(result, drawn=result.drawn or None)


def settled_of(setup: Setup, fleet: Fleet) -> Settled | None:
    """Let the exchange of a fleet whose run is over go on, if its scenario asks for it."""
    settle_s = setup.scenario.scenario.settle_s
    return settle(fleet, settle_s) if settle_s > 0.0 else None


def result_of(setup: Setup, seed: int, fleet: Fleet, wall_s: float, settled: Settled | None = None) -> Run:
    """The run of a fleet that stands still.

    Args:
        setup: the scenario resolved.
        seed: root of its draws.
        fleet: whose run is over.
        wall_s: what it took on this machine (s).
        settled: how the exchange after the mission ended.
    """
    return Run(
        setup,
        int(seed),
        fleet.recorder,
        tuple(fleet.truth.milestones),
        fleet.truth.goal_fraction,
        reachable_fraction(fleet.truth, setup.mission.jobs, setup.agreement.groups, fleet.view),
        fleet.completed,
        fleet.reason,
        fleet.ended_s if fleet.completed else fleet.duration_s,
        fleet.n_false_beliefs,
        math.fsum(vehicle.functional.motion.distance_m for vehicle in fleet.vehicles),
        wall_s,
        fleet.holders.wrong_fraction,
        settled,
        is_drawn(seed, setup.scenario, setup.strategy),
    )
