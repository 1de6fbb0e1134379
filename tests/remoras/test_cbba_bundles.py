"""Plain CBBA against sequential greedy (Choi, Brunet, How 2009), on fleets before their first job.

Bids may come at any time of a mission: a fleet that starts late divides its work as one that starts at once.
"""

import math
import random
from collections.abc import Mapping, Sequence

import pytest
from team import ROUND_S, Member, Team, never, surveys

from remoras.organisation import RoleSpecification
from remoras.strategies.cbba import Bidder, Cbba
from remoras.testing.sample_worlds import Visit
from remoras.work import Outlook, Work

N_INSTANCES = 40
STRATEGY = Cbba(plans_for_all=False, settle_rounds=1000)
"""Claims never stand for so long, so nobody begins."""
STARTS_S = (0.0, 600_000.0)
Paths = dict[str, tuple[str, ...]]


class Waiting(Team):
    """A team that stays where it is."""

    def _work(self, name: str, member: Member) -> Work:
        return Work(self.group, member.organisation, self.database, self.jobs)

    def begin(self, start_s: float) -> None:
        """Let bids begin at a time of the mission."""
        self._round = int(start_s / ROUND_S)

    def role_of(self, job: str) -> RoleSpecification:
        """The role whose holder does a job."""
        return next(role for role in self.group.roles if role.job == job)


def waiting(seed: int) -> Waiting:
    """Two to four vehicles, four or five jobs: surveys, or visits of unequal length."""
    draw = random.Random(seed)
    n_vehicles, n_jobs = draw.randint(2, 4), draw.randint(4, 5)
    starts_m = [(draw.uniform(-300, 300), draw.uniform(-300, 300)) for _ in range(n_vehicles)]
    places_m = [(draw.uniform(-600, 600), draw.uniform(-600, 600)) for _ in range(n_jobs)]
    of_visits = [Visit(f"job {n}", place_m, draw.uniform(30.0, 600.0)) for n, place_m in enumerate(places_m)]
    return Waiting(STRATEGY, starts_m, surveys(places_m) if draw.random() < 0.5 else of_visits, never)


def score(team: Waiting, vehicle: str, path: Sequence[str]) -> float:
    """Score of a path for a fleet that starts at 0."""
    outlook, total = Outlook(0.0, team.database[vehicle].start_m), 0.0
    for job in path:
        then = team.jobs[job].after(outlook, team.database[vehicle])
        outlook, total = then, total + math.exp(-then.free_s / STRATEGY.discount_s)
    return total


def sequential_greedy(team: Waiting) -> Paths:
    """Of all vehicles and jobs the pair that gains most is settled, one after another."""
    paths: Paths = dict.fromkeys(team.members, ())
    left = set(team.jobs)
    while left:
        gains = [
            (score(team, vehicle, longer) - score(team, vehicle, path), vehicle, job, longer)
            for vehicle, path in paths.items()
            for job in sorted(left)
            for n in range(len(path) + 1)
            for longer in [(*path[:n], job, *path[n:])]
        ]
        _, vehicle, job, paths[vehicle] = max(gains, key=lambda gain: gain[0])
        left.remove(job)
    return paths


def agreed(team: Waiting, start_s: float) -> Paths:
    """Agreed job sequence of each vehicle after all bids; asserts agreement."""
    team.begin(start_s)
    team.run(30)
    bidders: Mapping[str, Bidder] = {name: member.negotiator for name, member in team.members.items()}  # type: ignore[misc]
    divisions = [bidder.division() for bidder in bidders.values()]
    assert all(division == divisions[0] for division in divisions)
    assert set(divisions[0]) == {team.role_of(job).name for job in team.jobs}
    return {
        name: tuple(job for role in bidder._path for job in team.jobs if team.role_of(job).name == role)
        for name, bidder in bidders.items()
    }


@pytest.mark.parametrize("start_s", STARTS_S)
def test_cbba_bundles_equal_sequential_greedy_at_any_start_time(start_s: float) -> None:
    teams = [waiting(seed) for seed in range(N_INSTANCES)]
    differ = [seed for seed, team in enumerate(teams) if agreed(team, start_s) != sequential_greedy(team)]
    assert differ == []
