"""Cost of a whole mission run, against the cost of an empty Mesa agent step in the same process."""

from __future__ import annotations

import time
from typing import Any

import mesa

from benchmarks.measuring import row, run_cpu_s, setup_of

REPEATS = 5
EMPTY_STEPS = 5000
PER = 0.2
N_VEHICLES = 4


class _Idle(mesa.Agent):  # type: ignore[misc]  # Mesa is untyped
    def step(self) -> None:
        """Nothing."""


class _Empty(mesa.Model):  # type: ignore[misc]
    def __init__(self) -> None:
        super().__init__(rng=0)
        _Idle.create_agents(self, N_VEHICLES)

    def step(self) -> None:
        self.agents.shuffle_do("step")


def empty_agent_step_s() -> float:
    """CPU seconds of one agent step of a model of four agents that do nothing."""
    model = _Empty()
    began = time.process_time()
    for _ in range(EMPTY_STEPS):
        model.step()
    return (time.process_time() - began) / (EMPTY_STEPS * N_VEHICLES)


def mission_cpu_s() -> tuple[float, int]:
    """(CPU seconds, steps) of one run of mapping-rendezvous; loading and writing are not counted."""
    return run_cpu_s(setup_of("mapping-rendezvous", f"channel.per={PER}"))


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, the two measured in turn."""
    pairs = [(mission_cpu_s(), empty_agent_step_s()) for _ in range(REPEATS)]
    cpu_s, steps = min(mission for mission, _ in pairs)
    empty_s = min(empty for _, empty in pairs)
    per_step_s = cpu_s / (steps * N_VEHICLES)
    return [
        row(f"mission run, PER {PER}", cpu_s, "s CPU", "limit", 0.5),
        row("mission, per vehicle and step", 1e6 * per_step_s, "us CPU", "empty Mesa agent step", 1e6 * empty_s),
    ]
