"""Cost of keeping clear: missions with the rule, against the same without it.

The look around for neighbours is there either way, for the obstacle sonar; the rule adds half-planes for those near.
"""

from __future__ import annotations

import time
from typing import Any
from unittest.mock import patch

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load

REPEATS = 3
CASES = (
    ("mapping-rendezvous", ()),
    ("mapping-patches, 16 in layers", ("fleet.size=16",)),
    ("mapping-patches, 16 in one layer", ("fleet.size=16", "fleet.layers=false")),
)
MISSION_S = 800.0
"""Missions are stopped then, so that both ways of running them do the same work."""


def mission_s(name: str, settings: tuple[str, ...]) -> float:
    """CPU seconds of the first part of a mission; loading and assembling are not counted."""
    options = [("--set", setting) for setting in (*settings, f"scenario.duration_s={MISSION_S}", "channel.per=0.2")]
    fleet = assemble(resolved(load(name.partition(",")[0], options)), seed=1)
    began = time.process_time()
    fleet.run()
    cpu_s = time.process_time() - began
    fleet.close()
    return cpu_s


def best_of(name: str, settings: tuple[str, ...]) -> tuple[float, float]:
    """The best of some repeats with the rule and without it, measured in turn."""
    pairs = []
    for _ in range(REPEATS):
        kept_s = mission_s(name, settings)
        with patch("remoras.functional.guidance.clear_velocity", lambda *_: None):
            pairs.append((kept_s, mission_s(name, settings)))
    return min(kept_s for kept_s, _ in pairs), min(free_s for _, free_s in pairs)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    found = []
    for name, settings in CASES:
        kept_s, free_s = best_of(name, settings)
        found.append(
            {
                "name": f"keeping clear, {name}",
                "value": kept_s,
                "unit": "s CPU",
                "reference": "without the rule",
                "reference_value": free_s,
                "ratio": kept_s / free_s,
            }
        )
    return found
