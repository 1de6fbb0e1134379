"""Speed of missions: against peers, over idle time, over fleet size and over channels; minima of interleaved runs.

Peers do a part of the work: Mesa moves four agents along waypoints for as long as the mission takes; Mesa with SimPy
also sends packets in time slots with losses and acknowledgements. Instructions are counted by ``instructions``.
"""

from __future__ import annotations

import gc
import importlib.util
import math
import random
import time
import tracemalloc
from collections.abc import Generator, Iterator
from typing import Any

from mesa import Agent, Model

from benchmarks.measuring import least_s, row, run_cpu_s, setup_of
from missions.runs.assembly import assemble
from missions.runs.setup import Setup
from remoras.truth import FleetView, Truth

MISSION, PER = "mapping-rendezvous", 0.2
REPEATS = 3
N_AGENTS, SLOT_S, SPEED_MPS = 4, 6.0, 1.5
WAYPOINTS_M = ((0.0, 0.0), (300.0, 0.0), (300.0, 300.0), (0.0, 300.0))
SIZES, GROWTH_S = (4, 64), 600.0


class Walker(Agent):  # type: ignore[misc]  # Mesa is untyped
    """Agent that follows a closed course of waypoints."""

    def __init__(self, model: Model) -> None:
        super().__init__(model)
        self.x_m, self.y_m, self.goal = 0.0, 0.0, 0
        self.received: set[tuple[int, int]] = set()

    def step(self) -> None:
        """Move towards the next waypoint for a second."""
        x_m, y_m = WAYPOINTS_M[self.goal]
        dx_m, dy_m = x_m - self.x_m, y_m - self.y_m
        range_m = math.hypot(dx_m, dy_m)
        if range_m < SPEED_MPS:
            self.goal = (self.goal + 1) % len(WAYPOINTS_M)
            return
        self.x_m += SPEED_MPS * dx_m / range_m
        self.y_m += SPEED_MPS * dy_m / range_m


def waypoints(duration_s: float) -> list[Walker]:
    """Step agents once a second; return them."""
    model = Model(rng=0)
    walkers = [Walker(model) for _ in range(N_AGENTS)]
    for _ in range(int(duration_s)):
        model.agents.do("step")
    return walkers


def network(duration_s: float) -> None:
    """Step agents that also send packets in time slots; each packet repeats what is not acknowledged."""
    import simpy  # not a dependency

    walkers, draws = waypoints(0.0), random.Random(1)
    clock = simpy.Environment()
    acknowledged: list[set[tuple[int, int, int]]] = [set() for _ in walkers]

    def motion() -> Generator[Any, Any, Any]:
        while True:
            for walker in walkers:
                walker.step()
            yield clock.timeout(1.0)

    def slots(node: int) -> Generator[Any, Any, Any]:
        yield clock.timeout(node * SLOT_S)
        n_items = 0
        while True:
            n_items += 1
            items = [(node, item) for item in range(n_items)]
            pending = [i for i in items if any((*i, peer) not in acknowledged[node] for peer in range(N_AGENTS))]
            for peer, receiver in enumerate(walkers):
                if peer != node and draws.random() >= PER:
                    receiver.received.update(pending[:8])
                    acknowledged[node].update((*item, peer) for item in receiver.received if item[0] == node)
            yield clock.timeout(N_AGENTS * SLOT_S)

    clock.process(motion())
    for node in range(N_AGENTS):
        clock.process(slots(node))
    clock.run(until=duration_s)


def vehicle_s(setup: Setup) -> float:
    """CPU seconds per vehicle and second of a run."""
    cpu_s, n_ticks = run_cpu_s(setup)
    return cpu_s / (n_ticks * len(setup.scenario.vehicle))


def peak_bytes(setup: Setup) -> float:
    """Peak memory per vehicle of one run, in the blocks of this process (tracemalloc)."""
    gc.collect()
    tracemalloc.start()
    try:
        fleet = assemble(setup, seed=1)
        fleet.run()
        _, peak = tracemalloc.get_traced_memory()
        fleet.close()
    finally:
        tracemalloc.stop()
    return peak / len(setup.scenario.vehicle)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    return [*_peers(), *_idle(), *_growth(), *_channels()]


def _peers() -> Iterator[dict[str, Any]]:
    setup = setup_of(MISSION, f"channel.per={PER}")
    duration_s = float(run_cpu_s(setup)[1])
    has_simpy = importlib.util.find_spec("simpy") is not None
    ways = [lambda: run_cpu_s(setup), lambda: waypoints(duration_s)]
    mission_s, mesa_s, *peer_s = least_s(*ways, *([lambda: network(duration_s)] if has_simpy else []), repeats=REPEATS)
    yield row(f"{MISSION}, PER {PER}", mission_s, "s CPU", "Mesa, waypoints", mesa_s, goal="<= 20")
    if peer_s:
        yield row(f"{MISSION}, PER {PER}", mission_s, "s CPU", "Mesa and SimPy, network", peer_s[0], goal="<= 6")
    else:
        yield row(f"{MISSION}, PER {PER}", None, "s CPU", "Mesa and SimPy, network", 0.0, why="SimPy is not installed")


class Endless:
    """Referee that observes as another one does, and never ends a run."""

    is_over = False

    def __init__(self, truth: Truth) -> None:
        self._truth = truth

    def observe(self, fleet: FleetView, now_s: float) -> bool:
        """Let the other one observe."""
        self._truth.observe(fleet, now_s)
        return False


def twice(setup: Setup) -> tuple[float, float]:
    """CPU seconds of a mission, and of it with as long again after its end, when there is nothing left to do."""
    fleet = assemble(setup, seed=1)
    began_s = time.process_time()
    fleet.run()
    once_s = time.process_time() - began_s
    fleet.truth, fleet.completed = Endless(fleet.truth), False  # type: ignore[assignment]
    for _ in range(fleet.n_ticks):
        fleet.step()
    twice_s = time.process_time() - began_s
    fleet.close()
    return once_s, twice_s


def _idle() -> Iterator[dict[str, Any]]:
    for name, strategy, goal in (("silent", "fixed-partition", 1.1), ("transmitting", "remoras", 1.4)):
        setup = setup_of(MISSION, f"strategy.name={strategy}", f"channel.per={PER}")
        once_s, twice_s = map(min, zip(*(twice(setup) for _ in range(REPEATS)), strict=True))
        yield row(f"twice the time, {name} fleet", twice_s, "s CPU", "the mission", once_s, goal=f"<= {goal}")


def _growth() -> Iterator[dict[str, Any]]:
    few, many = SIZES
    for scenario, strategy in (
        (MISSION, "remoras"),
        ("mapping-patches", "cbba"),
        ("mapping-patches", "status-broadcast"),
    ):
        sizes = [
            setup_of(
                scenario, f"strategy.name={strategy}", "channel.name=bernoulli", f"channel.per={PER}",
                f"scenario.duration_s={GROWTH_S}", f"fleet.size={size}",
            )
            for size in SIZES
        ]  # fmt: skip
        rounds = [[vehicle_s(setup) for setup in sizes] for _ in range(REPEATS)]
        few_us, many_us = (1e6 * min(times) for times in zip(*rounds, strict=True))
        yield row(f"vehicle-second, {strategy}, {many}", many_us, "us CPU", f"{few} vehicles", few_us, goal="<= 1.2")
    few_mb, many_mb = (
        peak_bytes(setup_of(MISSION, f"fleet.size={size}", f"scenario.duration_s={GROWTH_S}")) / 1e6 for size in (4, 32)
    )
    yield row("peak memory per vehicle, 32", many_mb, "MB", "4 vehicles", few_mb)


def _channels() -> Iterator[dict[str, Any]]:
    """The channel model ``acoustic`` against ``bernoulli``; without losses both fleets do nearly the same."""
    setups = [setup_of(MISSION, f"channel.name={channel}") for channel in ("acoustic", "bernoulli")]
    acoustic_s, bernoulli_s = least_s(*(lambda of=of: run_cpu_s(of) for of in setups), repeats=REPEATS)
    yield row("mission on the channel acoustic", acoustic_s, "s CPU", "bernoulli", bernoulli_s, goal="<= 1.3")
