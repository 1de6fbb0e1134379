"""Does a fleet that errs about its place keep its word? One run for each drift, current, strategy and seed.

    python -m tests.tools.drifting
    python -m tests.tools.drifting --drift 0.02 --strategy cbba --seeds 1

A run is sound if it ends before its time is over, if what it says to be completed is on the ground, if nothing is
believed that is not, and if no role has more holders than it has room for. Each run that is not has its line. At the
end come the means for each drift and current. The exit status is 1 if a run was not sound.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections import defaultdict
from statistics import fmean
from typing import Any, NamedTuple

from missions.runs.run import Run, run
from missions.runs.summary import summary
from missions.scenarios import load

STRATEGIES = ("remoras", "cbba", "plan-and-dispatch", "central")


class Case(NamedTuple):
    """One run of a scenario."""

    drift: float
    north_mps: float
    strategy: str
    seed: int

    def settings(self) -> list[str]:
        """What makes this run, as ``--set`` has it."""
        given = [f"navigation.drift={self.drift}", f"strategy.name={self.strategy}"]
        return [*given, f"current.north_mps={self.north_mps}"]


def faults(scenario: Any, finished: Run, found: dict[str, Any]) -> list[str]:
    """What is not sound of a run."""
    why = []
    if finished.end_s >= scenario.scenario.duration_s:
        why.append(f"never ends: {found['reason']}")
    if finished.completed and found["coverage_fraction"] < scenario.mission.goal:
        why.append(f"completed with {found['coverage_fraction']:.3f} of the ground")
    if finished.n_false_beliefs:
        why.append(f"{finished.n_false_beliefs} false beliefs")
    if share := found["holder_conflict_fraction"]:
        why.append(f"a role with too many holders for {share * finished.end_s:.0f} s")
    return why


def main() -> int:
    """Run all cases; print those that are not sound, and the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="mapping-rendezvous")
    parser.add_argument("--drift", nargs="+", type=float, default=[0.002, 0.01, 0.02, 0.05], help="share of the way")
    parser.add_argument("--north-mps", nargs="+", type=float, default=[0.0, 0.4], help="of the current")
    parser.add_argument("--strategy", nargs="+", default=STRATEGIES)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3, 4, 5])
    asked = parser.parse_args()
    n_sound, found = 0, defaultdict(list)
    for case in itertools.starmap(Case, itertools.product(asked.drift, asked.north_mps, asked.strategy, asked.seeds)):
        scenario = load(asked.scenario, [("--set", one) for one in case.settings()])
        finished = run(scenario, case.seed)
        of_run = summary(finished)
        why = faults(scenario, finished, of_run)
        n_sound += not why
        found[case.drift, case.north_mps].append(of_run)
        if why:
            print(*case, f"{finished.end_s:.0f} s:", "; ".join(why), flush=True)
    print("drift / %  current / m/s  completed  mission / s  covered  fixes")
    for (drift, north_mps), runs in found.items():
        means = (fmean(float(one[name]) for one in runs) for name in ("mission_time_s", "coverage_fraction", "n_fixes"))
        n_completed = sum(one["completed"] for one in runs)
        time_s, covered, n_fixes = means
        print(
            f"{100.0 * drift:9g}{north_mps:15g}{n_completed:8}/{len(runs):<3}{time_s:12.0f}{covered:9.3f}{n_fixes:7.1f}"
        )
    n = sum(map(len, found.values()))
    print(f"{n_sound} of {n} runs are sound")
    return int(n_sound < n)


if __name__ == "__main__":
    sys.exit(main())
