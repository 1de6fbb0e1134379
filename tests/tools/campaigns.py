"""Every strategy on both grounds under random faults: campaigns of ``remoras stress``, one table of them all.

    python -m tests.tools.campaigns --schedules 10000 --jobs 1 --out campaigns

The grounds are those of mapping-rendezvous and mapping-patches, each of two sizes: as they are for one schedule in ten
(``--whole`` another share), and with all lengths and the longest wait for a meeting times 0.4 for the others, which
take a fifth of the time. Each campaign has a folder of its own in ``--out``; those that are there already are not made
again, so that a search which was ended goes on. The exit status is 1 if an invariant broke.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

from missions.mapping.scenario import MappingScenario
from missions.scenarios import load
from remoras.testing import campaign, plan_of
from stress.reporting import as_value, lines, write_report

STRATEGIES = (
    "remoras", "remoras-planned", "central", "plan-and-dispatch", "contract-net", "status-broadcast", "cbba",
    "rendezvous-sync", "fixed-partition", "oracle",
)  # fmt: skip
SCENARIOS = ("mapping-rendezvous", "mapping-patches")
SMALLER = 0.4


class Campaign(NamedTuple):
    """Which seeds of which strategy on which ground."""

    scenario: str
    strategy: str
    is_small: bool
    seeds: range

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.scenario}{'-small' if self.is_small else ''}-{self.strategy}"


def made_smaller(scenario: str) -> list[str]:
    """Settings by which a ground has all lengths times 0.4, and leases and waits are shorter too."""
    own = load(scenario)
    assert isinstance(own, MappingScenario)
    deadline_s = SMALLER * own.mission.meeting_deadline_s
    found = ["communication.lease_frames=10", f"mission.meeting_deadline_s={deadline_s:g}"]
    for area in own.area:
        corners = [[SMALLER * one for one in corner] for corner in area.corners_m]
        found.append(f'area."{area.name}".corners_m={json.dumps(corners)}')
    for point in own.rally_point:
        at_m = [SMALLER * one for one in point.position_m]
        found.append(f'rally_point."{point.name}".position_m={json.dumps(at_m)}')
    return found


def campaigns(n_schedules: int, whole: float, first: int) -> list[Campaign]:
    """All of them, with the seeds of each from the first on, so that none is drawn twice; whole grounds come last."""
    found: list[Campaign] = []
    pairs = [(scenario, strategy) for scenario in SCENARIOS for strategy in STRATEGIES]
    each = n_schedules / len(pairs)
    for is_small, share in ((True, 1.0 - whole), (False, whole)):
        for scenario, strategy in pairs:
            n = round(each * share)
            found.append(Campaign(scenario, strategy, is_small, range(first, first + n)))
            first += n
    return [one for one in found if one.seeds]


def made(one: Campaign, folder: Path, jobs: int) -> dict[str, Any]:
    """What came of a campaign: as its folder says, else after running it."""
    file = folder / one.name / "report.json"
    if not file.exists():
        plan = plan_of(one.scenario, one.strategy, made_smaller(one.scenario) if one.is_small else ())
        report = campaign(plan, one.seeds, jobs=jobs)
        draft = folder / f".{one.name}"
        draft.mkdir(parents=True, exist_ok=True)
        write_report(report, draft)
        draft.replace(file.parent)
        if report.broken:
            print("\n".join(lines(report)))
        assert as_value(report) == json.loads(file.read_text())
    found: dict[str, Any] = json.loads(file.read_text())
    return found


def main() -> int:
    """Run them one after another, and print a row for each, then how often each kind has happened."""
    parser = argparse.ArgumentParser(description="Campaigns of random faults for every strategy on both grounds.")
    parser.add_argument("--schedules", type=int, default=10_000)
    parser.add_argument("--whole", type=float, default=0.1, help="share of schedules on grounds of full size")
    parser.add_argument("--first", type=int, default=1, help="seed of the first schedule")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    happened: Counter[str] = Counter()
    n_runs, broken = 0, list[str]()
    print(f"{'campaign':<44} {'schedules':>9} {'finish without':>14} {'breaches':>8} {'wall (s)':>8}")
    for one in campaigns(given.schedules, given.whole, given.first):
        report = made(one, given.out, given.jobs)
        happened.update(report["happened"])
        n_runs += report["n_runs"]
        broken += [f"{one.name} seed {case['seed']}: {case['invariant']}: {case['text']}" for case in report["broken"]]
        usual = f"{report['usual_s']:.0f} s" if report["completes_without_faults"] else "never"
        numbers = f"{report['n_runs']:>9} {usual:>14} {report['n_broken']:>8} {report['wall_s']:>8.0f}"
        print(f"{one.name:<44} {numbers}", flush=True)
    print(f"{n_runs} schedules, {len(broken)} with a breach")
    print("happened: " + ", ".join(f"{kind} {count}" for kind, count in happened.most_common()))
    print("\n".join(broken))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
