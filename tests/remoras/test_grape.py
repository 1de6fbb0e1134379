"""GRAPE: a game of coalitions that ends where nobody wants to leave, whatever is heard first."""

import itertools

import pytest

from missions.benchmark.suite import suite_named
from missions.runs.run import run_of
from missions.runs.setup import resolved
from remoras.strategies import configured
from remoras.strategies.grape import GRAPE, Grape
from remoras.strategy import Strategy
from remoras.testing.sample_worlds import KINDS_OF_JOBS, Team, never
from remoras.testing.strategies import CHECKS, check_deterministic

PLACES_M = tuple((300.0 * x, 200.0 * y) for x in range(2) for y in range(3))
STARTS_M = ((0.0, 0.0), (250.0, 0.0), (0.0, 350.0))


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_it_conforms(check: object) -> None:
    assert callable(check)
    check(GRAPE)


@pytest.mark.slow
def test_it_is_deterministic() -> None:
    check_deterministic("remoras.strategies.grape:GRAPE")


def team(strategy: Strategy = GRAPE) -> Team:
    return Team(strategy, STARTS_M, next(iter(KINDS_OF_JOBS.values()))(PLACES_M), never)


def test_without_loss_all_come_to_one_partition_within_the_bound_of_the_paper() -> None:
    """Theorem 1: n (n + 1) / 2 evolutions at most; here three vehicles and as many jobs at the least, so 6."""
    of = team()
    players = [member.negotiator for member in of.members.values()]
    for number in range(1, 8):
        of.round()
        if number >= 2 and len({str(sorted(p._partition.items())) for p in players}) == 1:
            break
    assert [len(p._partition) for p in players] == [3, 3, 3]
    assert len({tuple(sorted(p._partition.items())) for p in players}) == 1
    assert len(set(players[0]._partition.values())) == 3
    assert max(p._age[0] for p in players) <= 6


def test_which_of_two_partitions_counts_does_not_depend_on_who_hears_first() -> None:
    """The one that has evolved more often, of equals the one of the later stamp."""
    from remoras.strategy import Heard

    of = team()
    group = of.group
    told = [
        Heard(name, 9.0, ((name, "claimsOf", evolved), (name, "worksSince", stamp), (name, "worksOn", f"Team.Role{n}")))
        for n, (name, evolved, stamp) in enumerate([("AUV00", 4, 9), ("AUV01", 4, 11), ("AUV02", 3, 99)])
    ]
    ends = set()
    for order in itertools.permutations(told):
        player = Grape().negotiator("AUV02", group)
        for heard in order:
            player._hear(heard)
        ends.add((tuple(player._partition.items()), player._age))
    assert ends == {((("AUV01", "Role1"),), (4, 11))}


@pytest.mark.slow
def test_it_completes_a_mission_and_waits_as_long_as_a_coalition_has_to_stand() -> None:
    """40 frames of 7 s before each job are in the time of the mission."""
    scenario = suite_named("fathom-1").study(("remoras",)).configurations[0].scenario
    ends_s = {}
    for strategy in (GRAPE, configured(GRAPE, {"settle_rounds": 40})):
        run = run_of(resolved(scenario, strategy), 1)
        assert run.completed
        ends_s[strategy.settle_rounds] = run.end_s
    assert ends_s[1] < ends_s[40]
