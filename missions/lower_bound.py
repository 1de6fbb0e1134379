"""Lower bound on mission time, for any division of the work among a fleet.

A vehicle leaves its start, visits every job of which it does a part, and ends at the rendezvous. Its *round* is the
shortest path over these jobs, without turns; the remaining time is work. The total work has a fixed length. A time T is
therefore feasible only if the working vehicles together have enough time beside their rounds:

    sum over them of work_mps (T - round_s) >= work_m

Some vehicle also visits the farthest job. ``least_time_s`` is the least T over all sets of working vehicles and all
divisions of the jobs. A vehicle without a job
of its own helps at the nearest, which covers shared and resumed jobs. The search is exact: shortest rounds by Held and
Karp (1962), divisions by all subsets of jobs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

MOST_JOBS = 14  # limit of jobs: time and memory grow as 3 to the power of their number

Times = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Rounder:
    """A vehicle that may work; ``out_m`` leads from its start to jobs, ``home_m`` from there to the rendezvous."""

    out_m: tuple[float, ...]
    home_m: tuple[float, ...]
    transit_mps: float
    work_mps: float


@dataclass(frozen=True)
class Rounds:
    """Work of a mission for the bound; ``legs_m`` are least paths between jobs."""

    legs_m: tuple[tuple[float, ...], ...]
    work_m: float
    vehicles: tuple[Rounder, ...]


def least_time_s(rounds: Rounds) -> float:
    """Least time (s) of the work; raises ValueError without vehicles or jobs, or for more than ``MOST_JOBS``.

    >>> alone = Rounder((100.0,), (50.0,), 2.0, 1.0)
    >>> least_time_s(Rounds(((0.0,),), 300.0, (alone,)))
    375.0
    >>> least_time_s(Rounds(((0.0,),), 300.0, (alone, alone)))
    225.0
    """
    n_jobs = len(rounds.legs_m)
    if not rounds.vehicles or not 1 <= n_jobs <= MOST_JOBS:
        raise ValueError(f"{len(rounds.vehicles)} vehicles, {n_jobs} jobs; allowed: vehicles, 1 to {MOST_JOBS} jobs")
    legs_m = shortest_m(rounds.legs_m)
    rounds_s = [_round_times_s(vehicle, legs_m) for vehicle in rounds.vehicles]
    farthest_s = max(float(min(of_one[1 << job] for of_one in rounds_s)) for job in range(n_jobs))
    costs = [vehicle.work_mps * of_one for vehicle, of_one in zip(rounds.vehicles, rounds_s, strict=True)]  # lost (m)
    best_s = math.inf
    for working in _sets(len(costs)):
        work_mps = math.fsum(rounds.vehicles[number].work_mps for number in working)
        # Bound of the set by the cheapest rounds, which need not cover all jobs: it spares most searches.
        least_m = math.fsum(float(costs[number][1:].min()) for number in working)
        if (rounds.work_m + least_m) / work_mps < best_s:
            lost_m = _least_sum([costs[number] for number in working])
            best_s = min(best_s, (rounds.work_m + lost_m) / work_mps)
    return max(best_s, farthest_s)


def shortest_m(legs_m: Sequence[Sequence[float]]) -> Times:
    """Shortest paths between all jobs via others (Floyd 1962)."""
    paths_m: Times = np.array(legs_m, dtype=np.float64)
    for by in range(len(paths_m)):
        paths_m = np.minimum(paths_m, paths_m[:, by : by + 1] + paths_m[by : by + 1, :])
    return paths_m


def _sets(n: int) -> Iterator[tuple[int, ...]]:
    # Largest first: smaller sets rarely improve the bound.
    numbered = sorted(range(1, 1 << n), key=lambda bits: (-bits.bit_count(), bits))
    return (tuple(number for number in range(n) if bits >> number & 1) for bits in numbered)


def _round_times_s(vehicle: Rounder, legs_m: Times) -> Times:
    n = len(legs_m)
    way_m: Times = np.full((1 << n, n), np.inf)
    for job in range(n):
        way_m[1 << job, job] = vehicle.out_m[job]
    # Held and Karp: each set of jobs has a greater number than its subsets.
    for jobs in range(1, 1 << n):
        here = way_m[jobs]
        for job in range(n):
            if not jobs >> job & 1:
                way_m[jobs | 1 << job, job] = (here + legs_m[:, job]).min()
    round_m: Times = (way_m + np.array(vehicle.home_m)).min(axis=1)
    # Without a job of its own, a vehicle still goes to the nearest to help there.
    round_m[0] = min(round_m[1 << job] for job in range(n))
    return round_m / vehicle.transit_mps


def _least_sum(costs: Sequence[Times]) -> float:
    every = np.arange(len(costs[0]))
    least = costs[0].copy()
    for own in costs[1:]:
        before, least = least, least + own[0]
        for jobs in range(1, len(every)):
            # Disjoint sets suffice: a job of two vehicles lengthens a round without need.
            rest = every[(every & jobs) == 0]
            least[rest | jobs] = np.minimum(least[rest | jobs], before[rest] + own[jobs])
    return float(least[-1])
