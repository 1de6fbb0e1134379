"""Cost of a vehicle in fleets of 4 to 32, against its cost in the fleet of 4; with ``cbba``, of 64 against 4.

The scenario is the same over the same mission time; the added vehicles are copies. Memory is what ``tracemalloc`` has
at its peak from the assembly of the fleet to the end of the run, rows of the recorder included, over the vehicles: it
counts the blocks of this process exactly and comes out alike every time, where the resident set depends on what was
freed before.
"""

from __future__ import annotations

import gc
import tracemalloc
from typing import Any

from benchmarks.measuring import row, run_cpu_s
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import Scenario, load

SIZES = (4, 8, 16, 32)
REPEATS = 3
PER = 0.2
MISSION_S = 1200.0
BIDDERS, BIDDING_S = (4, 64), (200.0, 600.0)
"""Vehicles that bid for jobs, by ``cbba`` on ``mapping-patches``, and for how long."""


def scenario(size: int) -> Scenario:
    """The mission with a fleet of that size, stopped before any of them completes it."""
    settings = [f"fleet.size={size}", f"channel.per={PER}", f"scenario.duration_s={MISSION_S}"]
    return load("mapping-rendezvous", [("--set", setting) for setting in settings])


def bidding(size: int, duration_s: float) -> Scenario:
    """A fleet of that size whose vehicles divide the jobs by bids."""
    settings = ["strategy.name=cbba", "channel.name=bernoulli", f"channel.per={PER}"]
    settings += [f"scenario.duration_s={duration_s}", f"fleet.size={size}"]
    return load("mapping-patches", [("--set", setting) for setting in settings])


def vehicle_step_s(of: Scenario) -> float:
    """CPU seconds per vehicle and step of one run; loading and assembling are not counted."""
    cpu_s, n_steps = run_cpu_s(resolved(of))
    return cpu_s / (n_steps * len(of.vehicle))


def peak_bytes(of: Scenario) -> float:
    """Peak memory per vehicle of one run."""
    gc.collect()
    tracemalloc.start()
    try:
        fleet = assemble(resolved(of), seed=1)
        fleet.run()
        _, peak = tracemalloc.get_traced_memory()
        fleet.close()
    finally:
        tracemalloc.stop()
    return peak / len(of.vehicle)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, the sizes measured in turn."""
    scenarios = {size: scenario(size) for size in SIZES}
    measured = [{size: vehicle_step_s(of) for size, of in scenarios.items()} for _ in range(REPEATS)]
    step_us = {size: 1e6 * min(costs[size] for costs in measured) for size in SIZES}
    peak_mb = {size: peak_bytes(of) / 1e6 for size, of in scenarios.items()}
    few, many = BIDDERS
    bids_us = {
        duration_s: [1e6 * vehicle_step_s(bidding(size, duration_s)) for size in BIDDERS] for duration_s in BIDDING_S
    }
    return [
        row(f"{what}, {size} vehicles", values[size], unit, f"{SIZES[0]} vehicles", values[SIZES[0]])
        for what, unit, values in (("vehicle-step", "us CPU", step_us), ("peak memory per vehicle", "MB", peak_mb))
        for size in SIZES
    ] + [
        row(f"vehicle-step, cbba, {many} vehicles, {duration_s:g} s", many_us, "us CPU", f"{few} vehicles", few_us)
        for duration_s, (few_us, many_us) in bids_us.items()
    ]
