"""Cost of a whole mission on the channel ``acoustic``, against ``bernoulli``, in turn in one process.

Nothing is lost on either, so both fleets do nearly the same, and ``bernoulli`` draws nothing.
"""

from __future__ import annotations

from typing import Any

from benchmarks.measuring import row, run_cpu_s, setup_of

REPEATS = 9
GOAL = 1.3


def rows() -> list[dict[str, Any]]:
    """Benchmark rows: the best of some repeats, the two measured in turn."""
    setups = [setup_of("mapping-rendezvous", f"channel.name={channel}") for channel in ("acoustic", "bernoulli")]
    pairs = [[run_cpu_s(setup)[0] for setup in setups] for _ in range(REPEATS)]
    acoustic_s, bernoulli_s = (min(times) for times in zip(*pairs, strict=True))
    name = f"mission on the channel acoustic (goal {GOAL:g})"
    return [row(name, acoustic_s, "s", "on bernoulli without losses", bernoulli_s)]
