"""Faults that the program once had, found again from seeds alone.

    python -m tests.tools.old_faults
    python -m tests.tools.old_faults --write tests/faults

Each mend is taken out in turn, stress looks for what breaks and shrinks it, and the short schedule has to hold with
the mend. Prints a row of the table in ``docs/howto/stress.md`` for each. ``--write`` keeps the short schedules in a
folder. The exit status is 1 if one is not found, or breaks with its mend.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

STRESS = Path(__file__).parents[1] / "stress"


def main() -> int:
    """Look for each, and print the table."""
    sys.path.insert(0, str(STRESS))  # as pytest does for the tests there
    from old_faults import OLD, search

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    given = parser.parse_args()
    n_wrong = 0
    print("| what happened | named by | seed | faults left | runs of shrinking |\n|---|---|---|---|---|")
    for fault in OLD:
        found = search(fault)
        if found is None or found.mended is not None:
            n_wrong += 1
            print(f"| {fault.text} | not found, or not mended: {found and found.mended} | | | |", flush=True)
            continue
        kinds = ", ".join(f"`{one.kind}`" for one in found.schedule.fault)
        about = f"`{fault.planted.invariant}` | {found.first.seed} | {len(found.schedule.fault)}: {kinds}"
        print(f"| {fault.text} | {about} | {found.small.n_runs} |", flush=True)
        if given.write is not None:
            head = f"# {fault.text[0].upper()}{fault.text[1:]} ({fault.planted.invariant}).\n"
            target = given.write / f"{fault.name}.toml"
            target.write_text(head + found.schedule.as_toml(), encoding="utf-8")
    return min(n_wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
