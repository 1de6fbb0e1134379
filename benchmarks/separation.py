"""Cost of keeping clear: missions with the rule, against the same without it.

The look around for neighbours is there either way, for the obstacle sonar; the rule adds half-planes for those near.
"""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from benchmarks.measuring import row, run_cpu_s, setup_of

REPEATS = 3
CASES = (
    ("mapping-rendezvous", ()),
    ("mapping-patches, 16 in layers", ("fleet.size=16",)),
    ("mapping-patches, 16 in one layer", ("fleet.size=16", "fleet.layers=false")),
)
MISSION_S = 800.0
"""Missions are stopped then, so that both ways of running them do the same work."""


def best_of(name: str, settings: tuple[str, ...]) -> tuple[float, float]:
    """The best of some repeats with the rule and without it, measured in turn."""
    setup = setup_of(name.partition(",")[0], *settings, f"scenario.duration_s={MISSION_S}", "channel.per=0.2")
    pairs = []
    for _ in range(REPEATS):
        kept_s, _ = run_cpu_s(setup)
        with patch("remoras.functional.guidance.clear_velocity", lambda *_: None):
            pairs.append((kept_s, run_cpu_s(setup)[0]))
    return min(kept_s for kept_s, _ in pairs), min(free_s for _, free_s in pairs)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    found = []
    for name, settings in CASES:
        kept_s, free_s = best_of(name, settings)
        found.append(row(f"keeping clear, {name}", kept_s, "s CPU", "without the rule", free_s))
    return found
