"""Do survivors finish? Every vehicle in turn is lost, mute or deaf, under every communicating strategy.

    python tests/tools/surviving.py --scenario mapping-patches --per 0.4 --seeds 1 --jobs 2
    python tests/tools/surviving.py --scenario mapping-patches mapping-rendezvous --seeds 10 --in-turn --jobs 2

A run is sound if it completes with the whole goal, and no two vehicles that hear each other lead one group for longer
than two leases. Each run that is not sound has its line, with all that makes it again. At the end come, for each
strategy and kind of fault, how many runs were sound, the mean mission time, and the mean time until others held the
work of the vehicle, with its 95 % interval. The exit status is 1 if a run was not sound.

Kinds: ``lost``, ``mute``, ``deaf``; ``back``, lost for 600 s; ``joins``, absent until then; ``weak``, AUV02 with an
energy of 130 kJ; ``alone``, all AUVs but one lost; ``none``.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from statistics import fmean
from typing import Any, NamedTuple

from missions.comparison.intervals import NoInterval, mean_interval
from missions.metric import NOT_APPLICABLE
from missions.runs.assembly import assemble
from missions.runs.fleet_metrics import recovery_time_s
from missions.runs.run import result_of
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.fleet import Fleet

STRATEGIES = (
    "remoras", "remoras-planned", "central", "plan-and-dispatch", "contract-net", "status-broadcast", "cbba",
    "rendezvous-sync",
)  # fmt: skip
VEHICLES = ("ASV00", "AUV00", "AUV01", "AUV02")
SCENARIOS = ("mapping-rendezvous", "mapping-patches")
KINDS = ("lost", "mute", "deaf")
AWAY_S = 600.0


class Case(NamedTuple):
    """One run: what is run, and what befalls whom."""

    scenario: str
    strategy: str
    per: float
    kind: str
    vehicle: str
    at_s: float
    seed: int

    def settings(self) -> list[str]:
        """What makes this run of the scenario, as ``--set`` has it."""
        given = [f"strategy.name={self.strategy}", f"channel.per={self.per}"]
        match self.kind:
            case "none":
                return given
            case "weak":
                return [*given, f"vehicle.{self.vehicle}.energy_j=130000"]
            case "back":
                faults = [f'kind="lost",vehicle="{self.vehicle}",at_s={self.at_s},until_s={self.at_s + AWAY_S}']
            case "alone":
                faults = [
                    f'kind="lost",vehicle="{name}",at_s={self.at_s}' for name in VEHICLES[1:] if name != self.vehicle
                ]
            case "lost" if self.vehicle == "any":  # at a time that is drawn
                faults = ['kind="lost",vehicle="any",at_s=[300.0,1500.0]']
            case kind:
                faults = [f'kind="{kind}",vehicle="{self.vehicle}",at_s={self.at_s}']
        return [*given, "fault=[" + ",".join(f"{{{fault}}}" for fault in faults) + "]"]


class Outcome(NamedTuple):
    """What came of a run; ``reason`` is empty if it was sound."""

    reason: str
    end_s: float
    recovery_s: float | None


def longest_double_lead_s(fleet: Fleet) -> float:
    """Step a fleet to its end; the longest time in which one group had two heads that hear and are heard (s)."""
    since_s: dict[str, float] = {}
    longest_s = 0.0
    while fleet.running:
        fleet.step()
        survivors = [vehicle for vehicle in fleet.view.vehicles if vehicle.is_in_contact]
        for group in survivors[0].organisation.groups if survivors else ():
            if sum(vehicle.leads(group) for vehicle in survivors) > 1:
                longest_s = max(longest_s, fleet.now_s - since_s.setdefault(group, fleet.now_s))
            else:
                since_s.pop(group, None)
    return longest_s


def outcome(case: Case) -> Outcome:
    """Run a case and judge it."""
    scenario = load(case.scenario, [("--set", one) for one in case.settings()])
    setup = resolved(scenario)
    fleet = assemble(setup, case.seed)
    lead_s = longest_double_lead_s(fleet)
    run = result_of(setup, case.seed, fleet, 0.0)
    fleet.close()
    recovery = recovery_time_s(run)
    two_leases_s = 2.0 * scenario.communication.lease_frames * setup.schedule.frame_s
    why = [run.reason] if not run.completed else []
    if run.goal_fraction < 1.0:
        why.append(f"goal {run.goal_fraction:.3f}")
    if lead_s > two_leases_s:
        why.append(f"two heads for {lead_s:.0f} s")
    missed = [f"{one.group} met without {one.vehicle}" for one in run.milestones if one.name == "missed_meeting"]
    why += missed if case.kind in ("none", "lost") else []
    return Outcome("; ".join(why), run.end_s, None if recovery in (None, NOT_APPLICABLE) else float(recovery))  # type: ignore[arg-type]


def cases(arguments: argparse.Namespace) -> Iterator[Case]:
    """Every case that was asked for: with each seed, or with one of them in turn."""
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    for n, case in enumerate(_cases_without_seed(arguments)):
        for seed in [seeds[n % len(seeds)]] if arguments.in_turn else seeds:
            yield case._replace(seed=seed)


def _cases_without_seed(arguments: argparse.Namespace) -> Iterator[Case]:
    for scenario, per, strategy, kind in itertools.product(
        arguments.scenario, arguments.per, arguments.strategy, arguments.kinds
    ):
        if kind in ("none", "weak"):
            yield Case(scenario, strategy, per, kind, "AUV02", 0.0, seed=0)
            continue
        for vehicle, at_s in itertools.product(arguments.vehicle, arguments.at_s):
            if kind != "alone" or vehicle != "ASV00":
                yield Case(scenario, strategy, per, kind, vehicle, at_s, seed=0)


def main() -> int:
    """Run all cases; print those that are not sound, and the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options: dict[str, Any] = {"nargs": "+"}
    parser.add_argument("--scenario", default=["mapping-patches"], choices=SCENARIOS, **options)
    parser.add_argument("--strategy", default=STRATEGIES, **options)
    parser.add_argument("--per", type=float, default=[0.0, 0.4], **options)
    parser.add_argument("--kinds", default=KINDS, **options)
    parser.add_argument("--vehicle", default=VEHICLES, choices=VEHICLES, **options)
    parser.add_argument("--at-s", type=float, default=[300.0, 900.0, 1500.0], **options)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--in-turn", action="store_true", help="run each case with one of the seeds, in turn")
    parser.add_argument("--jobs", type=int, default=1)
    found: dict[tuple[str, str], list[Outcome]] = defaultdict(list)
    with ProcessPoolExecutor((arguments := parser.parse_args()).jobs) as pool:
        running = {pool.submit(outcome, case): case for case in cases(arguments)}
        for future in as_completed(running):
            case, result = running[future], future.result()
            found[case.strategy, case.kind].append(result)
            if result.reason:
                print(*case, f"{result.end_s:.0f} s:", result.reason, flush=True)
    print(f"{'strategy':<18}{'kind':<7}{'sound':>9}{'mission s':>11}{'recovery s':>12}  95 % interval")
    for (strategy, kind), results in sorted(found.items()):
        n_sound = sum(not one.reason for one in results)
        recoveries_s = [one.recovery_s for one in results if one.recovery_s is not None]
        mean_s = f"{fmean(recoveries_s):12.0f}" if recoveries_s else f"{'-':>12}"
        interval = mean_interval(recoveries_s)
        spread = "" if isinstance(interval, NoInterval) else f"  {interval[0]:.0f} to {interval[1]:.0f}"
        end_s = fmean(one.end_s for one in results)
        print(f"{strategy:<18}{kind:<7}{n_sound:>4}/{len(results):<4}{end_s:>11.0f}{mean_s}{spread}")
    return int(any(one.reason for results in found.values() for one in results))


if __name__ == "__main__":
    sys.exit(main())
