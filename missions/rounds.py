"""Rounds: a time in which no fleet can do a mission's work, however it divides it among its vehicles.

A vehicle leaves its start, comes to every job of which it does a part, and ends where the fleet meets. What it needs
for that at least is its *round*: the shortest way over these jobs, without turning. In what is left of the time it
works. The work of a fleet has a length, and whatever part of a job a vehicle does, all of that length is done by
somebody. So a time T is enough only if the vehicles that work have together, beside their rounds, the time for it:

    sum over them of work_mps (T - round_s) >= work_m

``least_time_s`` is the least T of all sets of vehicles that work, and of all divisions of the jobs. A vehicle of such
a set that is the only one at no job helps at the nearest, so shared jobs and jobs that are taken over are covered. The
search is exact: the shortest rounds by Held and Karp (1962), the divisions by all subsets of the jobs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

MOST_JOBS = 14
"""The search takes the time and memory of 3 to the power of the jobs."""

Times = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Rounder:
    """One vehicle that may work.

    Attributes:
        out_m: least way from its start to each job.
        home_m: least way from each job to where it counts as having met; 0 if it need not come there.
        transit_mps, work_mps: its greatest speeds on the way and at work.
    """

    out_m: tuple[float, ...]
    home_m: tuple[float, ...]
    transit_mps: float
    work_mps: float


@dataclass(frozen=True)
class Rounds:
    """The work of a mission, as far as a bound needs it.

    Attributes:
        legs_m: least way from each job to each.
        work_m: length of all the work.
        vehicles: those that may work.
    """

    legs_m: tuple[tuple[float, ...], ...]
    work_m: float
    vehicles: tuple[Rounder, ...]


def least_time_s(rounds: Rounds) -> float:
    """The time (s) that the work takes at least; see the module's text.

    Raises:
        ValueError: there are no vehicles, no jobs, or more than ``MOST_JOBS``.

    >>> alone = Rounder((100.0,), (50.0,), 2.0, 1.0)
    >>> least_time_s(Rounds(((0.0,),), 300.0, (alone,)))
    375.0
    >>> least_time_s(Rounds(((0.0,),), 300.0, (alone, alone)))
    225.0
    """
    n_jobs = len(rounds.legs_m)
    if not rounds.vehicles or not 1 <= n_jobs <= MOST_JOBS:
        raise ValueError(f"{len(rounds.vehicles)} vehicles, {n_jobs} jobs; allowed: 1 or more, and 1 to {MOST_JOBS}")
    legs_m = shortest_m(rounds.legs_m)
    costs = [vehicle.work_mps * _round_times_s(vehicle, legs_m) for vehicle in rounds.vehicles]  # metres of work lost
    best_s = math.inf
    for working in _sets(len(costs)):
        work_mps = math.fsum(rounds.vehicles[number].work_mps for number in working)
        least_m = math.fsum(float(costs[number][1:].min()) for number in working)
        if (rounds.work_m + least_m) / work_mps < best_s:
            lost_m = _least_sum([costs[number] for number in working])
            best_s = min(best_s, (rounds.work_m + lost_m) / work_mps)
    return best_s


def shortest_m(legs_m: Sequence[Sequence[float]]) -> Times:
    """Least ways between all jobs by way of any others, which cross these for nothing (Floyd 1962)."""
    found: Times = np.array(legs_m, dtype=np.float64)
    for by in range(len(found)):
        found = np.minimum(found, found[:, by : by + 1] + found[by : by + 1, :])
    return found


def _sets(n: int) -> Iterator[tuple[int, ...]]:
    """All sets of so many vehicles but the empty one, the largest first: the others are then seldom looked at."""
    numbered = sorted(range(1, 1 << n), key=lambda bits: (-bits.bit_count(), bits))
    return (tuple(number for number in range(n) if bits >> number & 1) for bits in numbered)


def _round_times_s(vehicle: Rounder, legs_m: Times) -> Times:
    """Time of the shortest round over each set of jobs, by its bits; of the empty set that of the nearest job."""
    n = len(legs_m)
    way_m: Times = np.full((1 << n, n), np.inf)
    for job in range(n):
        way_m[1 << job, job] = vehicle.out_m[job]
    for jobs in range(1, 1 << n):
        here = way_m[jobs]
        for job in range(n):
            if not jobs >> job & 1:
                way_m[jobs | 1 << job, job] = (here + legs_m[:, job]).min()
    round_m: Times = (way_m + np.array(vehicle.home_m)).min(axis=1)
    round_m[0] = min(round_m[1 << job] for job in range(n))
    return round_m / vehicle.transit_mps


def _least_sum(costs: Sequence[Times]) -> float:
    """Least sum of the costs of sets of jobs, one for each vehicle, that together are all jobs."""
    every = np.arange(len(costs[0]))
    least = costs[0].copy()
    for own in costs[1:]:
        before, least = least, least + own[0]
        for jobs in range(1, len(every)):
            rest = every[(every & jobs) == 0]
            least[rest | jobs] = np.minimum(least[rest | jobs], before[rest] + own[jobs])
    return float(least[-1])
