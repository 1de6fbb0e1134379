"""What benchmarks share: the row that each prints, and what runs and calls cost in processor time."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from missions.runs.assembly import assemble
from missions.runs.setup import Setup, resolved
from missions.scenarios import load


def row(
    name: str,
    value: float | None,
    unit: str,
    reference: str,
    reference_value: float,
    ratio: float | None = None,
    goal: str = "",
    judged: float | None = None,
    why: str = "",
) -> dict[str, Any]:
    """A benchmark row.

    Args:
        name: of what was measured; value: what came of it, None if it cannot be measured; unit: of both values.
        reference: what it is held against; reference_value: of that.
        ratio: how the two compare; the value over the reference's if left out.
        goal: such as ``<= 1.2``; left out of the row if empty.
        judged: what the goal is about; the ratio if left out.
        why: reason for a missing value.
    """
    ratio = value / reference_value if ratio is None and value is not None else ratio
    entry = {
        "name": name, "value": value, "unit": unit, "reference": reference, "reference_value": reference_value,
        "ratio": ratio,
    }  # fmt: skip
    if value is None:
        return entry | {"why": why}
    if goal:
        sign, limit = goal.split()[:2]
        of = ratio if judged is None else judged
        assert of is not None
        entry |= {"goal": goal, "met": of >= float(limit) if sign == ">=" else of <= float(limit)}
    return entry


def least_s(*ways: Callable[[], object], repeats: int, calls: int = 1) -> list[float]:
    """CPU seconds of one call of each way, the least of some repeats, measured in turn."""
    best = [float("inf")] * len(ways)
    for _ in range(repeats):
        for number, way in enumerate(ways):
            began = time.process_time()
            for _ in range(calls):
                way()
            best[number] = min(best[number], (time.process_time() - began) / calls)
    return best


def setup_of(scenario: str, *settings: str) -> Setup:
    """What follows from a scenario with KEY=VALUE of its settings."""
    return resolved(load(scenario, [("--set", setting) for setting in settings]))


def run_cpu_s(setup: Setup, seed: int = 1) -> tuple[float, int]:
    """(CPU seconds, steps) of one run; loading, assembling and writing are not counted."""
    fleet = assemble(setup, seed)
    began = time.process_time()
    fleet.run()
    cpu_s = time.process_time() - began
    fleet.close()
    return cpu_s, fleet.n_ticks
