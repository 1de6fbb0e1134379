"""GRAPE: a coalition game that reaches a stable partition in any order of reception."""

from team import KINDS_OF_JOBS, Team, never

from remoras.strategies.grape import GRAPE
from remoras.strategy import Strategy

PLACES_M = tuple((300.0 * x, 200.0 * y) for x in range(2) for y in range(3))
STARTS_M = ((0.0, 0.0), (250.0, 0.0), (0.0, 350.0))


def team(strategy: Strategy = GRAPE) -> Team:
    return Team(strategy, STARTS_M, next(iter(KINDS_OF_JOBS.values()))(PLACES_M), never)


def test_without_loss_grape_agrees_within_the_bound_of_the_paper() -> None:
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
