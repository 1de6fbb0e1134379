"""Cost of a decision among 20 candidates, against an empty step of Mesa in the same process. Goal: at most 500.

Every decision has stimuli of its own, so nothing could be kept from the one before.
"""

from __future__ import annotations

import time
from random import Random
from typing import Any

import mesa

from benchmarks.measuring import row
from remoras.activities import Activity, ActivityKind, ActivitySet, ActivityType
from remoras.executive.decision import Choice

N_SETS = 20
N_CHOICES = 20
N_DECISIONS = 20
REPEATS = 5
EMPTY_STEPS = 20_000
N_TYPES = {"one type": (1, 1), "one or two": (1, 2), "up to three": (1, 3), "two or three": (2, 3)}


class _Empty(mesa.Model):  # type: ignore[misc]  # Mesa is untyped
    def step(self) -> None:
        """Nothing."""


def empty_step_s() -> float:
    """CPU seconds of one step of a model without agents."""
    model = _Empty(rng=0)
    began = time.process_time()
    for _ in range(EMPTY_STEPS):
        model.step()
    return (time.process_time() - began) / EMPTY_STEPS


def sets(draw: Random, least: int, most: int) -> list[ActivitySet]:
    """Candidates with so many types each."""
    found = []
    for number in range(N_SETS):
        types = draw.sample(list(ActivityType), draw.randint(least, most))
        activities = tuple(Activity(f"A{number}", kind, (), ("sonar",)) for kind in types)
        found.append(ActivitySet(None, ActivityKind.COLLECTIVE, activities, 0.5))
    return found


def decision_s(least: int, most: int) -> float:
    """CPU seconds of one decision, the mean over choices drawn with seed 1."""
    draw = Random(1)
    cases = [
        (Choice(sets(draw, least, most)), [[draw.random() for _ in range(N_SETS)] for _ in range(N_DECISIONS)])
        for _ in range(N_CHOICES)
    ]
    began = time.process_time()
    for choice, all_motivations in cases:
        for motivations in all_motivations:
            choice.best(motivations)
    return (time.process_time() - began) / (N_CHOICES * N_DECISIONS)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, the two measured in turn."""
    found = []
    for name, (least, most) in N_TYPES.items():
        pairs = [(decision_s(least, most), empty_step_s()) for _ in range(REPEATS)]
        own_s, empty_s = min(own for own, _ in pairs), min(empty for _, empty in pairs)
        found.append(row(f"decision, {N_SETS} sets, {name}", own_s * 1e6, "us", "empty step of Mesa", empty_s * 1e6))
    return found
