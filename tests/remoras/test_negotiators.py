"""What negotiators agree on among themselves, over an exchange that loses what a script says."""

from collections.abc import Sequence

import pytest
from exchange_of_statements import ROUND_S, Lost, Team, never
from hypothesis import given, settings
from hypothesis import strategies as st
from samples import auv, database

from remoras.organisation import Group, Organisation, RoleSpecification
from remoras.strategies import Evidence, configured, strategies
from remoras.strategies.cbba import Cbba
from remoras.strategies.contract_net import ContractNet
from remoras.strategies.status_broadcast import StatusBroadcast
from remoras.strategy import Heard, Move, Situation
from remoras.work import Point

SHIPPED = strategies()
ALLOCATING = ("cbba", "central", "contract-net", "rendezvous-sync", "status-broadcast")
TALKED_OVER = 2
"""Frames after which two at the same area have heard of each other, when nothing is lost."""

points_m = st.tuples(st.integers(-300, 300).map(float), st.integers(-300, 300).map(float))
starts = st.lists(points_m, min_size=2, max_size=4)
squares = st.lists(points_m, min_size=1, max_size=6, unique=True)


@pytest.mark.parametrize("name", ALLOCATING)
@settings(max_examples=25)
@given(starts_m=starts, squares_m=squares)
def test_without_loss_every_area_is_surveyed_by_exactly_one(
    name: str, starts_m: list[Point], squares_m: list[Point]
) -> None:
    team, together = Team(SHIPPED[name], starts_m, squares_m, never), 0
    for _ in range(600):
        team.round()
        together = together + 1 if team.at_one_area() else 0
        assert together <= TALKED_OVER
        if team.done:
            break
    assert team.mapped == dict.fromkeys([f"square {n}" for n in range(len(squares_m))], 1)


def lossy(lost: Sequence[bool], until: int) -> Lost:
    """Lose by a repeated script, and nothing any more after a round."""
    return lambda number, sender, receiver: (
        number <= until and lost[(7 * number + 3 * int(sender[-1]) + int(receiver[-1])) % len(lost)]
    )


scripts = st.lists(st.booleans(), min_size=5, max_size=40)


@settings(max_examples=40)
@given(starts_m=starts, squares_m=squares, lost=scripts, until=st.integers(5, 60))
def test_cbba_is_free_of_conflict_once_all_has_got_through(
    starts_m: list[Point], squares_m: list[Point], lost: list[bool], until: int
) -> None:
    """All is said again within ``repeat_rounds``; twice that time: once to be heard, once to give way."""
    team = Team(Cbba(), starts_m, squares_m, lossy(lost, until))
    team.run(until + 2 * Cbba().repeat_rounds)
    for _ in range(20):
        assert team.at_one_area() == 0
        team.round()


@pytest.mark.parametrize("name", ALLOCATING)
@settings(max_examples=15)
@given(starts_m=starts, squares_m=squares, lost=scripts)
def test_whatever_was_lost_all_is_surveyed_in_the_end(
    name: str, starts_m: list[Point], squares_m: list[Point], lost: list[bool]
) -> None:
    team = Team(SHIPPED[name], starts_m, squares_m, lossy(lost, 100))
    for _ in range(1500):
        team.round()
        if team.done:
            break
    assert team.done


def test_in_silence_cbba_surveys_everything_twice() -> None:
    """The script can break what the test of conflicts proves: two who never hear each other do all the work each."""
    team = Team(Cbba(), [(0.0, 0.0), (10.0, 0.0)], [(0.0, 0.0), (0.0, 200.0)], lambda *_: True)
    team.run(600)
    assert team.mapped == {"square 0": 2, "square 1": 2}


# One negotiator -----------------------------------------------------------------------------------

CORNERS_M = {
    name: ((x, 0.0), (x, 100.0), (x + 100.0, 100.0), (x + 100.0, 0.0)) for name, x in [("left", 0.0), ("right", 200.0)]
}
PAIR = Group(
    "Pair",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True),
        RoleSpecification("Hand", 1, founding=True),
        RoleSpecification("Left", 1, 1, area="left"),
        RoleSpecification("Right", 1, 1, area="right"),
    ),
)
ABLE = ("Left", "Right")


def situation(
    number: int, organisation: Organisation, evidence: Evidence, *heard: Heard, **changes: object
) -> Situation:
    values = {"rally_m": None, "heard": heard, "heard_s": {}} | changes
    return Situation(ROUND_S * number, number, organisation, evidence, **values)  # type: ignore[arg-type]


def stated(move: Move) -> list[tuple[str, str, object]]:
    return [fact for statement in move.statements for fact in statement.facts]


def test_a_contract_does_not_go_to_a_bidder_that_cannot_play_the_role() -> None:
    fleet = database(auv("AUV00", playable_roles=("Head",)), auv("AUV01", playable_roles=("Hand", "Left")))
    organisation = ContractNet().form(fleet, [PAIR])
    evidence = Evidence(fleet, {}, CORNERS_M, frozenset())
    head = ContractNet().negotiator("AUV00", PAIR)
    opened = stated(head.negotiate(situation(1, organisation, evidence)))
    assert {(subject, what) for subject, what, _ in opened} == {
        ("Pair.Left", "auctionEnds"),
        ("Pair.Right", "auctionEnds"),
    }
    bids = [Heard("AUV01", 15.0, (("Pair.Right", "bid", 1),)), Heard("AUV01", 15.0, (("Pair.Left", "bid", 900),))]
    head.negotiate(situation(2, organisation, evidence, *bids))
    awarded = stated(head.negotiate(situation(4, organisation, evidence)))
    assert ("AUV01", "playsRole", "Pair.Left") in awarded
    assert ("AUV01", "playsRole", "Pair.Right") not in awarded


@pytest.mark.parametrize("doubt_rounds", [0, 10, 40])
def test_the_area_of_a_silent_vehicle_is_done_again_when_it_is_overdue(doubt_rounds: int) -> None:
    """AUV01 was last heard at the right area: what is predicted for it, and the doubt, decide when it is begun."""
    strategy = configured(StatusBroadcast(), {"doubt_rounds": doubt_rounds})
    fleet = database(*(auv(f"AUV0{n}", playable_roles=(kind, *ABLE)) for n, kind in enumerate(("Head", "Hand"))))
    organisation = strategy.form(fleet, [PAIR])
    evidence = Evidence(fleet, {}, CORNERS_M, frozenset({"left"}))
    broadcaster = strategy.negotiator("AUV00", PAIR)
    heard = Heard("AUV01", ROUND_S, (("AUV01", "worksOn", "Pair.Right"),))
    begun = next(
        number
        for number in range(1, 400)
        if ("AUV00", "playsRole", "Pair.Right")
        in stated(broadcaster.negotiate(situation(number, organisation, evidence, *[heard][: number == 1])))
    )
    # 4 rows of 75 m and 3 steps of 25 m at 1.25 m/s, on top of the way from (0, 0) to (212.5, 12.5) at 2 m/s
    due_s = ROUND_S + 375.0 / 1.25 + (212.5**2 + 12.5**2) ** 0.5 / 2.0
    assert ROUND_S * (begun - 1 - doubt_rounds) < due_s <= ROUND_S * (begun - doubt_rounds)
