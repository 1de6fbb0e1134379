"""``python -m benchmarks.flicker [NAME...] [--repeats N]``: how often vehicles change their minds back within 30 s.

A change of guidance is one of the activity, or of its role, that guides a vehicle; none at all counts as one. It is
undone if the next change, at most 30 s later, brings back what there was before: A, B, A. A line for each scenario,
of all that are shipped without a name, says how many of the changes in runs of seeds 1 to N were undone; the last of
all of them, with the Wilson interval.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator

from missions.runs.run import run
from missions.scenarios import load, shipped
from missions.statistics import wilson_interval

BACK_S = 30.0
Guidance = frozenset[tuple[str, str]]
"""Name and role of each activity that guides; one at most, or none."""


def changes(rows: Iterable[tuple[float, str, str, str, str, float]]) -> dict[str, list[tuple[float, Guidance]]]:
    """By vehicle, when guidance became what, by the rows of the table ``activities``."""
    found: dict[str, dict[float, Guidance]] = {}
    for time_s, vehicle, kind, name, role, _ in rows:
        of = found.setdefault(vehicle, {})
        of[time_s] = of.get(time_s, frozenset()) | (frozenset({(name, role)}) if kind == "guidance" else frozenset())
    return {
        vehicle: [(time_s, guidance) for time_s, guidance, before in _pairs(of) if guidance != before]
        for vehicle, of in found.items()
    }


def _pairs(of: dict[float, Guidance]) -> Iterator[tuple[float, Guidance, Guidance | None]]:
    before: Guidance | None = None
    for time_s, guidance in of.items():
        yield time_s, guidance, before
        before = guidance


def undone(rows: Iterable[tuple[float, str, str, str, str, float]]) -> tuple[int, int]:
    """How many changes of guidance were undone, and of how many; what a vehicle begins with is no change."""
    n_undone = n_changes = 0
    for of in changes(rows).values():
        n_changes += len(of) - 1
        for (_, first), (left_s, _), (back_s, third) in zip(of, of[1:], of[2:], strict=False):
            n_undone += first == third and back_s - left_s <= BACK_S
    return n_undone, n_changes


def main() -> int:
    """Print a line for each scenario, and one for all."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flicker", description=__doc__)
    parser.add_argument("name", nargs="*", help="scenarios; all by default")
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    all_undone = all_changes = 0
    for name in arguments.name or sorted(shipped()):
        found = [undone(run(load(name), seed).recorder.rows("activities")) for seed in range(1, arguments.repeats + 1)]
        n_undone, n_changes = (sum(of) for of in zip(*found, strict=True))
        all_undone, all_changes = all_undone + n_undone, all_changes + n_changes
        print(f"{name}: {n_undone} of {n_changes}", flush=True)
    low, high = wilson_interval(all_undone, all_changes)[:2]
    print(f"all: {all_undone} of {all_changes} ({low:.1%} to {high:.1%})")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
