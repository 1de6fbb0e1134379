"""Learn the weights of the baseline ``learned`` on ``dev`` of ``fathom-1``: ``python -m benchmarks.learning``.

Cross-entropy method (Rubinstein 1999; Szita, Lorincz 2006) over the weights of a linear score. In each generation all
candidates fly the same drawn runs of ``dev``; the next generation is drawn around the mean of the best. All follows
from the seed.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from itertools import repeat

import numpy as np

from missions.benchmark.learning.baselines import FEATURES, WEIGHTS, Scorer
from missions.benchmark.learning.policies import strategy
from missions.benchmark.running import Bounds
from missions.benchmark.suite import Suite, suite_named
from missions.runs.run import run_of
from missions.runs.setup import resolved
from missions.sweeps.study import Study
from remoras.plugins import named_object

SEED, N_GENERATIONS, N_CANDIDATES, N_ELITE, N_RUNS = 1, 3, 8, 3, 4
START = {"bias": -2.5, "turn": 1.0, "others": -1.0, "held": -3.0, "planned": 3.0}
"""At its turn a vehicle without a job takes the first of the plan that it makes for all."""
SPREAD, LEAST_SPREAD = 0.3, 0.1
N_PROCESSES = 2
Flight = tuple[int, int]
"""Number of a cell, and of a repeat."""


@cache
def _cases() -> tuple[Suite, Study, Bounds]:
    suite = suite_named("fathom-1")
    return suite, suite.study(("remoras",)), Bounds(named_object(suite.about.bound))


def score(weights: Sequence[float], flown: Sequence[Flight]) -> float:
    """Mean efficiency of a policy in some runs.

    Args:
        weights: of the policy; flown: the runs.
    """
    suite, study, bounds = _cases()
    found = []
    for at, number in flown:
        scenario, seed = study.configurations[at].scenario, suite.seed(number)
        run = run_of(resolved(scenario, strategy(Scorer(weights))), seed)
        found.append(bounds.bound_s(at, scenario, seed) / (run.end_s if run.completed else suite.about.limit_s))
    return float(np.mean(found))


def learn() -> None:
    """Learn, and write the weights."""
    suite, _, _ = _cases()
    draws = np.random.default_rng(SEED)
    mean = np.array([START.get(name, 0.0) for name in FEATURES])
    spread = np.full(len(mean), SPREAD)
    with ProcessPoolExecutor(N_PROCESSES) as processes:
        for generation in range(N_GENERATIONS):
            cells = draws.choice(len(suite.cells), N_RUNS, replace=False)
            flown = [(int(at), int(draws.integers(suite.repeats))) for at in cells]
            candidates = mean + spread * draws.standard_normal((N_CANDIDATES, len(mean)))
            candidates[0] = mean
            scores = list(processes.map(score, [list(map(float, weights)) for weights in candidates], repeat(flown)))
            elite = candidates[np.argsort(scores, kind="stable")[::-1][:N_ELITE]]
            mean, spread = elite.mean(axis=0), np.maximum(LEAST_SPREAD, 0.8 * elite.std(axis=0) + 0.2 * spread)
            print(f"{generation}: mean {scores[0]:.3f}, best {max(scores):.3f}", file=sys.stderr)
    text = {
        "weights": {name: round(float(value), 4) for name, value in zip(FEATURES, mean, strict=True)},
        "learned": f"seed {SEED}, {N_GENERATIONS} generations of {N_CANDIDATES} candidates, {N_RUNS} runs each",
        "suite": suite.about.name,
        "digest": suite.digest,
    }
    WEIGHTS.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    learn()
