"""Storms of exchange managers, as many as you like: `python tests/tools/storms.py 10000 adaptive holdings`.

Each is a schedule of what is told, lost, late, doubled, damaged, restarted, as `tests/exchange/test_storm.py` draws it;
after every event nobody may believe what is false. It says how many there were, every 500, and ends with the count, or
with the shortest storm that breaks the law. Without names it takes every policy that states holdings. ``--seed N``
draws others.
"""

import argparse
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import run_state_machine_as_test

from exchange.policies import POLICIES, STATING
from stress.storm.machine import storm_machine
from stress.storm.storm import Storm

sys.path.insert(0, str(Path(__file__).parent.parent / "exchange"))

drawn = import_module("test_storm")


def main() -> None:
    """Weather so many storms."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("storms", type=int, help="how many")
    parser.add_argument("policies", nargs="*", help="names; every policy that states holdings if there is none")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    names = asked.policies or sorted(STATING)
    if unknown := [name for name in names if name not in POLICIES]:
        parser.error(f"{unknown[0]}: no policy; there are {', '.join(sorted(POLICIES))}")
    made: list[str] = []

    def counted(policy: str, **others: Any) -> Storm:
        made.append(policy)
        if len(made) % 500 == 0:
            print(f"{len(made)} storms", flush=True)
        storm: Storm = drawn.storm_of_any(policy=policy, **others)
        return storm

    storms = st.builds(
        counted, n_nodes=st.integers(2, 5), policy=st.sampled_from(names), payload_bytes=st.sampled_from([24, 32, 64]),
        carrier_evidence=st.booleans(), offsets=st.lists(st.sampled_from([0.0, 0.2, -0.2]), min_size=5, max_size=5),
        n_absent=st.integers(0, 1), crc_bits=st.sampled_from([0, 32]), queue_limit=st.sampled_from([None, None, 2]),
    )  # fmt: skip
    machine = seed(asked.seed)(storm_machine(storms, drawn.TELLS, lambda storm: storm.repeats))  # type: ignore[attr-defined]
    run_state_machine_as_test(
        machine,
        settings=settings(
            max_examples=asked.storms, stateful_step_count=30, deadline=None, database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )  # fmt: skip
    print(f"{len(made)} storms, 0 false beliefs: " + ", ".join(f"{name} {made.count(name)}" for name in names))


if __name__ == "__main__":
    main()
