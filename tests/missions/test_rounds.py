"""Lower bound of the mission time, against exhaustive search."""

import itertools
import math
import random

import pytest

from missions.lower_bound import MOST_JOBS, Rounder, Rounds, least_time_s


def drawn(draws: random.Random, n_jobs: int, n_vehicles: int) -> Rounds:
    """Jobs and vehicles at random places of a square of 1 km."""
    places = [(draws.uniform(0.0, 1000.0), draws.uniform(0.0, 1000.0)) for _ in range(n_jobs + n_vehicles + 1)]
    jobs, starts, rally = places[:n_jobs], places[n_jobs:-1], places[-1]
    return Rounds(
        tuple(tuple(max(0.0, math.dist(a, b) - 150.0) for b in jobs) for a in jobs),
        draws.uniform(0.0, 8000.0),
        tuple(
            Rounder(
                tuple(math.dist(start, job) for job in jobs),
                tuple(math.dist(job, rally) for job in jobs),
                draws.uniform(1.0, 3.0),
                draws.uniform(0.5, 2.0),
            )
            for start in starts
        ),
    )


def by_brute_force(found: Rounds) -> float:
    """All sets of vehicles that work, all divisions of the jobs, all orders of each."""
    n = len(found.legs_m)
    legs = [list(row) for row in found.legs_m]
    for by, a, b in itertools.product(range(n), repeat=3):
        legs[a][b] = min(legs[a][b], legs[a][by] + legs[by][b])

    def round_s(vehicle: Rounder, jobs: tuple[int, ...]) -> float:
        ways = (
            vehicle.out_m[order[0]] + sum(legs[a][b] for a, b in itertools.pairwise(order)) + vehicle.home_m[order[-1]]
            for order in itertools.permutations(jobs)
        )
        return min(ways) / vehicle.transit_mps

    costs = [
        {
            jobs: vehicle.work_mps * round_s(vehicle, jobs)
            for size in range(1, n + 1)
            for jobs in itertools.combinations(range(n), size)
        }
        for vehicle in found.vehicles
    ]
    best_s = math.inf
    for size in range(1, len(costs) + 1):
        for working in itertools.combinations(range(len(costs)), size):
            work_mps = sum(found.vehicles[number].work_mps for number in working)
            for owners in itertools.product(working, repeat=n):
                lost_m = 0.0
                for number in working:
                    own = tuple(job for job in range(n) if owners[job] == number)
                    lost_m += costs[number][own] if own else min(costs[number][(job,)] for job in range(n))
                best_s = min(best_s, (found.work_m + lost_m) / work_mps)
    return max(best_s, *(min(round_s(vehicle, (job,)) for vehicle in found.vehicles) for job in range(n)))


@pytest.mark.slow
def test_search_equals_exhaustive_enumeration() -> None:
    draws = random.Random(0)
    for _ in range(100):
        found = drawn(draws, draws.randint(1, 5), draws.randint(1, 3))
        assert least_time_s(found) == pytest.approx(by_brute_force(found), rel=1e-12)


def test_more_vehicles_less_work_and_greater_speeds_take_no_more_time() -> None:
    draws = random.Random(5)
    for _ in range(20):
        found = drawn(draws, 4, 2)
        least_s = least_time_s(found)
        more = drawn(draws, 4, 1).vehicles
        assert least_time_s(Rounds(found.legs_m, found.work_m, (*found.vehicles, *more))) <= least_s
        assert least_time_s(Rounds(found.legs_m, 0.9 * found.work_m, found.vehicles)) <= least_s


def test_empty_or_too_large_search_is_refused() -> None:
    with pytest.raises(ValueError, match=f"allowed: vehicles, 1 to {MOST_JOBS} jobs"):
        least_time_s(Rounds((), 100.0, ()))
