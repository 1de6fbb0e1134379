"""Missions on a measured network over missions whose links lose alike, with what membership and succession do there.

``python -m benchmarks seas`` takes all five choices of four of the nodes of ``mission-2012`` for the four vehicles of
``mapping-patches``, with the seeds of ``SEEDS``; ``python -m benchmarks.seas 1:10 remoras cbba`` others, of these
strategies alone.
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
from exchange.acoustics.network import network_of
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.runs.summary import summary
from missions.scenarios import load

SCENARIO, NETWORK = "mapping-patches", "mission-2012"
VEHICLES = ("ASV00", "AUV00", "AUV01", "AUV02")
STRATEGIES = (
    "plan-and-dispatch", "central", "remoras", "remoras-planned", "contract-net", "cbba", "status-broadcast",
    "rendezvous-sync",
)  # fmt: skip
SEEDS = range(1, 4)
LOST, LOST_S = "AUV01", 600.0
"""The vehicle whose work others take up, and when it is lost."""
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


def over_alike(strategies: Sequence[str], seeds: Iterable[int], pool: Any) -> Iterator[dict[str, Any]]:
    """How long missions take as measured, over how long they take where all links lose as much."""
    seeds, losses = list(seeds), ("measured", "alike")
    trips = [Trip(*of) for of in product(strategies, choices(), losses, seeds)]
    found = dict(zip(trips, pool.map(came, trips, chunksize=4), strict=True))
    for strategy in strategies:
        means_s = {
            (nodes, loss): statistics.fmean(found[Trip(strategy, nodes, loss, seed)].mission_s for seed in seeds)
            for nodes, loss in product(choices(), losses)
        }
        ratios = {nodes: means_s[nodes, "measured"] / means_s[nodes, "alike"] for nodes in choices()}
        of_all_s = [statistics.fmean(means_s[nodes, loss] for nodes in choices()) for loss in losses]
        yield row(f"{strategy}, measured", of_all_s[0], "s", "alike", of_all_s[1], goal=f"<= {MEAN_GOAL} x")
        worst = max(ratios, key=lambda nodes: ratios[nodes])
        worst_s = [means_s[worst, loss] for loss in losses]
        yield row(
            f"{strategy}, nodes {' '.join(worst)}", worst_s[0], "s", "alike", worst_s[1], goal=f"<= {WORST_GOAL} x"
        )
        shares = [100.0 * came.doubled for trip, came in found.items() if trip[0] == strategy and trip[2] == "measured"]
        doubled = statistics.fmean(shares)
        yield row(f"{strategy}, two holders", doubled, "% time", "goal", 1.0, goal="<= 1 %")


def recoveries(strategies: Sequence[str], seeds: Iterable[int], pool: Any) -> Iterator[dict[str, Any]]:
    """How long the work of a vehicle that is lost waits for another, over what a lease takes."""
    fault = (f'fault=[{{kind="lost", vehicle="{LOST}", at_s={LOST_S}}}]',)
    lease_s = 40 * resolved(load(SCENARIO)).schedule.frame_s
    for loss in ("0.0", "0.4", "0.8", "measured"):
        for strategy in strategies:
            trips = [Trip(strategy, nodes, loss, seed, fault) for nodes, seed in product(choices()[-1:], seeds)]
            times_s = [one.recovery_s for one in pool.map(came, trips) if one.recovery_s is not None]
            if times_s:
                yield row(f"{strategy}, {LOST} lost, {loss}", statistics.fmean(times_s), "s", "lease", lease_s)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows, of all strategies that speak at sea."""
    return _rows(STRATEGIES, SEEDS)


def _rows(strategies: Sequence[str], seeds: Iterable[int]) -> list[dict[str, Any]]:
    seeds = list(seeds)
    with ProcessPoolExecutor() as pool:
        return [*over_alike(strategies, seeds, pool), *recoveries(strategies, seeds, pool)]


if __name__ == "__main__":
    first, last = map(int, sys.argv[1].split(":"))
    for found in _rows(sys.argv[2:] or STRATEGIES, range(first, last + 1)):
        print(f"{found['name']:<42} {found['value']:>9.4g} {found['unit']:<7} {found['ratio']:>7.3f} x", flush=True)
