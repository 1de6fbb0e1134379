"""Missions on a measured network over missions whose links lose alike, with what membership and succession do there.

``python -m benchmarks seas`` takes all five choices of four of the nodes of ``mission-2012`` for the four vehicles of
``mapping-patches``, with the seeds of ``SEEDS``; ``python -m benchmarks.seas 1:10 remoras cbba`` others, of these
strategies alone. Differences are paired by seed and nodes; intervals are of Student's t over the seeds.
"""

from __future__ import annotations

import math
import statistics
import sys
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations, permutations, product
from typing import Any, NamedTuple

from benchmarks.measuring import row
from exchange.channel.network import network_of
from missions.runs.assembly import assemble
from missions.runs.results import summary
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load
from missions.statistics import t_half_width

SCENARIO, NETWORK = "mapping-patches", "mission-2012"
VEHICLES = ("ASV00", "AUV00", "AUV01", "AUV02")
STRATEGIES = (
    "plan-and-dispatch", "central", "remoras", "remoras-planned", "contract-net", "cbba", "status-broadcast",
    "rendezvous-sync",
)  # fmt: skip
SEEDS = range(1, 4)
LOST, LOST_S = "AUV01", 600.0
"""The vehicle whose work others take up, and when it is lost."""
GROUP, HEAD, HEAD_LOST_S = "Operational", "AUV00", 500.0
"""A group that others claim to lead or come to lead, its head, and when that is lost."""
CLAIMED_S, TERMS = 300.0, (1, 64, 255)
"""When a member claims it, while all hear the head, and under which terms."""
ALIKE = ("0.0", "0.4", "0.8")
"""Losses of all links."""
MEAN_GOAL, WORST_GOAL = 1.05, 1.10
Nodes = tuple[str, ...]


class Trip(NamedTuple):
    """A run to be made: its strategy, the nodes of its vehicles, how much is lost, its seed and further settings."""

    strategy: str
    nodes: Nodes
    loss: str
    seed: int
    settings: tuple[str, ...] = ()


class Came(NamedTuple):
    """What came of a run.

    Attributes:
        mission_s: how long the mission took; its whole duration where it is not complete.
        doubled: share of the time in which a job had two holders.
        recovery_s: how long the work of a lost vehicle waited for another; None without such.
    """

    mission_s: float
    doubled: float
    recovery_s: float | None


class Claim(NamedTuple):
    """A run in which somebody claims a group: the strategy, how much all links lose, the seed, and under which term."""

    strategy: str
    loss: str
    seed: int
    term: int = 1

    def settings(self, *more: str) -> list[tuple[str, str]]:
        """Of its scenario."""
        return [("--set", setting) for setting in (f"strategy.name={self.strategy}", f"channel.per={self.loss}", *more)]


def choices() -> list[Nodes]:
    """All ways to leave one node of the network out."""
    return list(combinations(sorted(network_of(NETWORK).nodes), len(VEHICLES)))


def settings_of(trip: Trip) -> Iterator[str]:
    """KEY=VALUE of what is lost: as measured between its nodes, or alike: as much as these on average, or so much."""
    per = network_of(NETWORK).per
    if trip.loss == "measured":
        yield "channel.name=network"
        yield f"channel.network={NETWORK}"
        yield from (f'channel.nodes.{name}="{node}"' for name, node in zip(VEHICLES, trip.nodes, strict=True))
    else:
        links = [per[link] for link in permutations(trip.nodes, 2)]
        yield "channel.name=bernoulli"
        yield f"channel.per={math.fsum(links) / len(links) if trip.loss == 'alike' else float(trip.loss)}"


def came(trip: Trip) -> Came:
    """Make a run."""
    settings = [f"strategy.name={trip.strategy}", *settings_of(trip), *trip.settings]
    finished = run(load(SCENARIO, [("--set", setting) for setting in settings]), trip.seed)
    figures = summary(finished)
    mission_s = figures["mission_time_s"] if finished.completed else finished.scenario.scenario.duration_s
    return Came(mission_s, figures["holder_conflict_fraction"], figures.get("recovery_time_s"))


def over_alike(strategies: Sequence[str], seeds: Sequence[int], pool: Any) -> Iterator[dict[str, Any]]:
    """How long missions take as measured, over how long they take where all links lose as much."""
    losses = "measured", "alike"
    for strategy in strategies:
        trips = [Trip(strategy, *of) for of in product(choices(), losses, seeds)]
        outcomes = dict(zip(trips, pool.map(came, trips, chunksize=4), strict=True))
        s = {trip[1:4]: came.mission_s for trip, came in outcomes.items()}
        means_s = {of: statistics.fmean(s[*of, seed] for seed in seeds) for of in product(choices(), losses)}
        ratios = {nodes: means_s[nodes, "measured"] / means_s[nodes, "alike"] for nodes in choices()}
        of_all_s = [statistics.fmean(means_s[nodes, loss] for nodes in choices()) for loss in losses]
        yield row(f"{strategy}, measured", of_all_s[0], "s", "alike", of_all_s[1], goal=f"<= {MEAN_GOAL} x")
        if len(seeds) > 1:
            later_s = [
                statistics.fmean(s[nodes, "measured", seed] - s[nodes, "alike", seed] for nodes in choices())
                for seed in seeds
            ]
            mean_s, half_s = statistics.fmean(later_s), t_half_width(later_s)
            yield row(f"{strategy}, later", mean_s, "s", "half of 95 %", half_s, mean_s / half_s if half_s else 0.0)
        worst = max(ratios, key=lambda nodes: ratios[nodes])
        worst_s = [means_s[worst, loss] for loss in losses]
        yield row(
            f"{strategy}, nodes {' '.join(worst)}", worst_s[0], "s", "alike", worst_s[1], goal=f"<= {WORST_GOAL} x"
        )
        doubled = statistics.fmean(100.0 * came.doubled for trip, came in outcomes.items() if trip.loss == "measured")
        yield row(f"{strategy}, two holders", doubled, "% time", "goal", 1.0, goal="<= 1 %")


def recoveries(strategies: Sequence[str], seeds: Sequence[int], pool: Any) -> Iterator[dict[str, Any]]:
    """How long the work of a vehicle that is lost waits for another, over what a lease takes."""
    fault = (f'fault=[{{kind="lost", vehicle="{LOST}", at_s={LOST_S}}}]',)
    lease_s = 40 * resolved(load(SCENARIO)).schedule.frame_s
    for loss in (*ALIKE, "measured"):
        for strategy in strategies:
            trips = [Trip(strategy, nodes, loss, seed, fault) for nodes, seed in product(choices()[-1:], seeds)]
            times_s = [outcome.recovery_s for outcome in pool.map(came, trips) if outcome.recovery_s is not None]
            if times_s:
                yield row(f"{strategy}, {LOST} lost, {loss}", statistics.fmean(times_s), "s", "lease", lease_s)


def obeyed(claim: Claim) -> bool:
    """True if any vehicle came to obey a member that claims to lead while the head is there."""
    fleet = assemble(resolved(load(SCENARIO, claim.settings())), claim.seed)
    facts, is_said, found = ((GROUP, "headedBy", LOST), (GROUP, "headTerm", claim.term)), False, False
    while fleet.running and not found:
        fleet.step()
        if not is_said and fleet.now_s >= CLAIMED_S:
            is_said = fleet.let_say(LOST, lambda beliefs: [beliefs.fact(*fact) for fact in facts])
        found = any(LOST in vehicle.social.organisation.heads(GROUP) for vehicle in fleet.vehicles)
    fleet.close()
    return found


def succeeded(claim: Claim) -> bool:
    """True if the mission is complete though the head is lost, and all that are left follow one and the same head."""
    fault = f'fault=[{{kind="lost", vehicle="{HEAD}", at_s={HEAD_LOST_S}}}]'
    fleet = assemble(resolved(load(SCENARIO, claim.settings(fault))), claim.seed)
    while fleet.running:
        fleet.step()
    heads = {vehicle.social.organisation.heads(GROUP) for vehicle in fleet.vehicles if vehicle.is_alive}
    fleet.close()
    return fleet.completed and len(heads) == 1 and HEAD not in heads.pop()


CLAIMS = (("claims obeyed", obeyed, TERMS, "claims", "<= 0 x"), ("heads succeeded", succeeded, (1,), "heads", ">= 1 x"))
"""What is counted, of which runs and terms, its unit, and which share of them is the goal."""


def claims(strategies: Sequence[str], seeds: Sequence[int], pool: Any) -> Iterator[dict[str, Any]]:
    """How many claims are obeyed while the head is heard, and how many lost heads are succeeded."""
    for strategy, loss, (what, came_true, terms, unit, goal) in product(strategies, ALIKE, CLAIMS):
        made = [Claim(strategy, loss, seed, term) for seed, term in product(seeds, terms)]
        yield row(f"{strategy}, {what}, {loss}", sum(pool.map(came_true, made)), unit, "of", len(made), goal=goal)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows, of all strategies that speak at sea."""
    return list(_rows(STRATEGIES, SEEDS))


def _rows(strategies: Sequence[str], seeds: Iterable[int]) -> Iterator[dict[str, Any]]:
    seeds = list(seeds)
    with ProcessPoolExecutor() as pool:
        for part in (over_alike, recoveries, claims):
            yield from part(strategies, seeds, pool)


if __name__ == "__main__":
    first, last = map(int, sys.argv[1].split(":"))
    for found in _rows(sys.argv[2:] or STRATEGIES, range(first, last + 1)):
        print(f"{found['name']:<42} {found['value']:>9.4g} {found['unit']:<7} {found['ratio']:>7.3f} x", flush=True)
