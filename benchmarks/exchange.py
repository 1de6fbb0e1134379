"""Cost of the policy study, against the time NumPy needs to draw as many random numbers as there are link outcomes."""

from __future__ import annotations

import sys
import time
from statistics import median
from typing import Any

import numpy as np

from benchmarks.measuring import row
from exchange.study.study import ExchangeStudy, StudyRow, run

PER = tuple(step / 20 for step in range(1, 17))
REPEATS = 3
PAIRS = 7
"""Times that a study and its floor are measured, in turn; the ratio is the median, and its spread is stated."""
MOST_FLOORS = 1.5
"""What a study may take, in floors."""
DRAWS_AT_ONCE = 1 << 16
SCALING_NODES = (12, 25, 50)
SCALING_POLICIES = {"ack": 2, "m-ack-repeat": 3, "mps-ack-repeat": 3}
"""The power of the number of nodes that the cost of a slot may grow with."""


def link_outcomes(rows: list[StudyRow]) -> int:
    """Packets that a receiver heard or lost, over all slots of all trials."""
    return sum(told.slots_played * (told.nodes - 1) for told in rows)


def float32_draws_s(n_draws: int) -> float:
    """CPU seconds that NumPy's default generator needs for float32 uniforms, in memory that stays in the cache."""
    generator = np.random.default_rng(1)
    block = np.empty(DRAWS_AT_ONCE, np.float32)
    began_s = time.process_time()
    for _ in range(n_draws // DRAWS_AT_ONCE + 1):
        generator.random(out=block, dtype=np.float32)
    return time.process_time() - began_s


def study_s(study: ExchangeStudy) -> tuple[float, list[StudyRow]]:
    """CPU seconds that a study takes, and its rows."""
    began_s = time.process_time()
    rows = run(study, jobs=1, say=lambda text: print(text, file=sys.stderr))
    return time.process_time() - began_s, rows


def figure_row(n_nodes: int) -> dict[str, Any]:
    """Six policies, sixteen loss rates, 2000 trials."""
    study = ExchangeStudy(nodes=n_nodes, per=PER, trials=2000)
    run(ExchangeStudy(nodes=n_nodes, trials=1), say=lambda text: print(text, file=sys.stderr))
    pairs = []
    for _ in range(PAIRS):
        seconds, rows = study_s(study)
        n_outcomes = link_outcomes(rows)
        pairs.append((seconds, float32_draws_s(n_outcomes)))
    value_s, floor_s = (median(column) for column in zip(*pairs, strict=True))
    ratios = sorted(seconds / floor for seconds, floor in pairs)
    name = f"policy study, N = {n_nodes}, 6 policies x 16 PER x 2000"
    reference = f"{n_outcomes} float32 uniforms; {PAIRS} pairs, {ratios[0]:.2f} to {ratios[-1]:.2f}"
    return row(name, value_s, "s", reference, floor_s, median(ratios), f"<= {MOST_FLOORS:g}", median(ratios))


def slot_s(policy: str, n_nodes: int) -> float:
    """CPU seconds of a slot; at PER 0.5, where half of the fleet hears each packet."""
    study = ExchangeStudy(nodes=n_nodes, per=(0.5,), trials=40, policies=(policy,))
    best = min((run(study)[0] for _ in range(REPEATS)), key=lambda told: told.cpu_s)
    return best.cpu_s / best.slots_played


def scaling_rows() -> list[dict[str, Any]]:
    """Cost of a slot with many nodes, against that with fewer times the power that it may grow with."""
    found = []
    for policy, power in SCALING_POLICIES.items():
        costs_us = {n_nodes: 1e6 * slot_s(policy, n_nodes) for n_nodes in SCALING_NODES}
        fewest = SCALING_NODES[0]
        for n_nodes in SCALING_NODES[1:]:
            allowed_us = costs_us[fewest] * (n_nodes / fewest) ** power
            reference = f"slot at N = {fewest}, times ({n_nodes}/{fewest})^{power}"
            found.append(row(f"slot of {policy}, N = {n_nodes}", costs_us[n_nodes], "us", reference, allowed_us))
    return found


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    return [figure_row(5), figure_row(10), *scaling_rows()]
