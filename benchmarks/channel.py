"""Cost of a whole mission on the channel ``acoustic``, against ``bernoulli``, in turn in one process.

Nothing is lost on either, so both fleets do nearly the same, and ``bernoulli`` draws nothing.
"""

from __future__ import annotations

import time
from typing import Any

from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load

REPEATS = 9
GOAL = 1.3


def mission_cpu_s(channel: str) -> float:
    """CPU seconds of one run of mapping-rendezvous; loading and writing are not counted."""
    fleet = assemble(resolved(load("mapping-rendezvous", [("--channel", f"channel.name={channel}")])), seed=1)
    began = time.process_time()
    fleet.run()
    cpu_s = time.process_time() - began
    fleet.close()
    return cpu_s


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, the two measured in turn."""
    pairs = [(mission_cpu_s("acoustic"), mission_cpu_s("bernoulli")) for _ in range(REPEATS)]
    acoustic_s, bernoulli_s = (min(times) for times in zip(*pairs, strict=True))
    return [
        {
            "name": f"mission on the channel acoustic (goal {GOAL:g})",
            "value": acoustic_s,
            "unit": "s",
            "ratio": acoustic_s / bernoulli_s,
            "reference": "on bernoulli without losses",
            "reference_value": bernoulli_s,
        }
    ]
