"""Random faults in random settings on many grounds: campaigns of ``remoras stress``, one table of them all.

    python -m tests.tools.campaigns --first 2800002 --schedules 10000 --out campaigns

Every seed draws faults, and every block of six seeds the configuration that they befall: strategy, policy, channel,
sea, fleet and the other settings of docs/howto/stress.md. The grounds take turns (``GROUNDS``, with the share of each):
three areas of 50 or of 100 m, in which a schedule takes a fifth to a twentieth of the time, the mapping grounds with
all lengths and waits times 0.4, and scenarios as they are shipped. ``--grounds`` takes some of them, ``--faults`` draws
faults of some kinds alone, ``--set`` sets a key on all of them, which is then not drawn.

Each campaign of 30 seeds has a folder of its own in ``--out``; those that are there already are not made again, so
that a search which was ended goes on. The exit status is 1 if an invariant broke.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from missions.files import shipped
from missions.mapping.scenario import MappingScenario
from missions.scenarios import load
from stress.campaign import campaign
from stress.configurations import SEEDS_EACH
from stress.drawing import plan_of
from stress.reporting import lines, write_report

SMALLER = 0.4
EACH = 30
"""Seeds of a campaign: whole blocks of one configuration."""
GROUNDS = {
    "areas-50m": 270, "areas-100m": 30, "mapping-rendezvous-small": 8, "mapping-patches-small": 8,
    "mapping-rendezvous": 1, "mapping-patches": 1, "mapping-three-teams-small": 1, "mapping-inspection-small": 1,
    "mapping-objects-small": 1, "mapping-corridor": 1, "mapping-three-teams": 1, "pandora-inspection": 1,
    "trident-intervention": 1, "arrows-archaeology": 1,
}  # fmt: skip
"""How many campaigns each ground has beside those of the others."""


class Ground(NamedTuple):
    """A scenario, and what is set in it."""

    scenario: str
    settings: tuple[str, ...] = ()


def areas(side_m: float) -> Ground:
    """Three areas side by side, with rally points beyond them."""
    near, middle, far = 0.5 * side_m, 1.5 * side_m, 2.5 * side_m
    squares = {"middle": (near, near), "left": (middle, near), "right": (near, middle)}
    found = ["communication.lease_frames=10", f"mission.meeting_deadline_s={3.6 * side_m:g}"]
    for name, (x_m, y_m) in squares.items():
        corners = [[x_m, y_m], [x_m, y_m + side_m], [x_m + side_m, y_m + side_m], [x_m + side_m, y_m]]
        found.append(f"area.{name}.corners_m={json.dumps(corners)}")
    for name, at_m in (("operational rally", 2.0 * side_m), ("coordination rally", far - 0.1 * side_m)):
        found.append(f'rally_point."{name}".position_m={json.dumps([at_m, at_m])}')
    return Ground("mapping-rendezvous", tuple(found))


def made_smaller(scenario: str) -> Ground:
    """A mapping ground with all lengths times 0.4, and shorter leases and waits."""
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
    return Ground(scenario, tuple(found))


def ground_of(name: str) -> Ground:
    """The ground of a name of ``GROUNDS``, or a shipped scenario, or one with ``-small`` behind it."""
    if name.startswith("areas-"):
        return areas(float(name.removeprefix("areas-").removesuffix("m")))
    return made_smaller(name.removesuffix("-small")) if name.endswith("-small") else Ground(name)


class Campaign(NamedTuple):
    """Which seeds on which ground."""

    ground: str
    seeds: range

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.seeds.start}-{self.ground}"


def campaigns(n_schedules: int, first: int, shares: dict[str, int]) -> Iterator[Campaign]:
    """All of them, each with the next seeds; after any number of them each ground has had about its share."""
    had = dict.fromkeys(shares, 0)
    for start in range(first, first + n_schedules, EACH):
        ground = max(shares, key=lambda one: shares[one] / (2 * had[one] + 1))  # after Sainte-Laguë
        had[ground] += 1
        yield Campaign(ground, range(start, min(start + EACH, first + n_schedules)))


def made(
    one: Campaign, folder: Path, kinds: Sequence[str], draws: str, given: Sequence[str], jobs: int
) -> dict[str, Any]:
    """What came of a campaign: as its folder says, else after running it."""
    file = folder / one.name / "report.json"
    if not file.exists():
        ground = ground_of(one.ground)
        report = campaign(plan_of(ground.scenario, "", (*ground.settings, *given), kinds, draws), one.seeds, jobs=jobs)
        draft = folder / f".{one.name}"
        draft.mkdir(parents=True, exist_ok=True)
        write_report(report, draft)
        draft.replace(file.parent)
        if report.broken:
            print("\n".join(lines(report)))
    found: dict[str, Any] = json.loads(file.read_text())
    return found


def main() -> int:
    """Run them one after another, and print a row for each, then how many each ground has had and what has happened."""
    parser = argparse.ArgumentParser(description="Campaigns of random faults in random settings on many grounds.")
    parser.add_argument("--schedules", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help=f"seed of the first schedule, a multiple of {SEEDS_EACH}")
    parser.add_argument("--grounds", default=",".join(GROUNDS), help="names with commas; shipped scenarios, too")
    parser.add_argument("--faults", default="", help="kinds with commas, as of remoras stress; all if empty")
    parser.add_argument("--settings", default="all", help="as of remoras stress")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="on all grounds")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    names = given.grounds.split(",")
    kinds = given.faults.split(",") if given.faults else ()
    known = {*GROUNDS, *shipped()}
    if given.first % SEEDS_EACH or not known.issuperset(names):
        parser.error(f"--first is a multiple of {SEEDS_EACH}; --grounds are of {', '.join(sorted(known))}")
    happened, drawn, ran = Counter[str](), Counter[str](), Counter[str]()
    broken = list[str]()
    print(f"{'campaign':<44} {'schedules':>9} {'finish without':>14} {'breaches':>8} {'wall (s)':>8}")
    for one in campaigns(given.schedules, given.first, {name: GROUNDS.get(name, 1) for name in names}):
        report = made(one, given.out, kinds, given.settings, given.set, given.jobs)
        happened.update(report["happened"])
        drawn.update(report["drawn"])
        ran[one.ground] += report["n_runs"]
        broken += [f"{one.name} seed {case['seed']}: {case['invariant']}: {case['text']}" for case in report["broken"]]
        usual = f"{report['usual_s']:.0f} s" if report["completes_without_faults"] else "never"
        numbers = f"{report['n_runs']:>9} {usual:>14} {report['n_broken']:>8} {report['wall_s']:>8.0f}"
        print(f"{one.name:<44} {numbers}", flush=True)
    print(f"{ran.total()} schedules, {len(broken)} with a breach")
    for title, counts in (("grounds", ran), ("happened", happened), ("drawn", drawn)):
        print(f"{title}: " + ", ".join(f"{name} {count}" for name, count in counts.most_common()))
    print("\n".join(broken))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
