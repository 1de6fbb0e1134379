"""What negotiators agree on among themselves, over an exchange that loses what a script says."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from samples import auv, database

from missions.mapping.jobs import SurveyJob
from remoras.organisation import Group, RoleSpecification
from remoras.strategies import configured, strategies
from remoras.strategies.cbba import Cbba
from remoras.strategies.central import Central
from remoras.strategies.contract_net import ContractNet
from remoras.strategies.remoras import Remoras
from remoras.strategies.rendezvous_sync import RendezvousSync
from remoras.strategies.status_broadcast import StatusBroadcast
from remoras.strategy import Heard, Move, Situation, Strategy
from remoras.testing.sample_worlds import (
    KINDS_OF_JOBS,
    ROUND_S,
    Lost,
    Team,
    Visit,
    never,
    ordered_visits,
    surveys,
    visits,
)
from remoras.work import Job, Point, Work

SHIPPED = strategies()
ALLOCATING = ("cbba", "central", "contract-net", "rendezvous-sync", "status-broadcast")
TALKED_OVER = 2
"""Frames after which two at the same job have heard of each other, when nothing is lost."""

points_m = st.tuples(st.integers(-300, 300).map(float), st.integers(-300, 300).map(float))
starts = st.lists(points_m, min_size=2, max_size=4)
places = st.lists(points_m, min_size=1, max_size=6, unique=True)
Kind = Callable[[Sequence[Point]], list[Job]]

# One negotiator

JOBS = {
    name: SurveyJob(name, ((x, 0.0), (x, 100.0), (x + 100.0, 100.0), (x + 100.0, 0.0)))
    for name, x in [("left", 0.0), ("right", 200.0)]
}
PAIR = Group(
    "Pair",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True),
        RoleSpecification("Hand", 1, founding=True),
        RoleSpecification("Left", 1, 1, job="left"),
        RoleSpecification("Right", 1, 1, job="right"),
    ),
)
ABLE = ("Left", "Right")


def situation(number: int, work: Work, *heard: Heard) -> Situation:
    return Situation(ROUND_S * number, number, work, None, heard, {})


def stated(move: Move) -> list[tuple[str, str, object]]:
    return [fact for statement in move.statements for fact in statement.facts]


def test_a_contract_does_not_go_to_a_bidder_that_cannot_play_the_role() -> None:
    fleet = database(auv("AUV00", playable_roles=("Head",)), auv("AUV01", playable_roles=("Hand", "Left")))
    organisation = ContractNet().form(fleet, [PAIR])
    work = Work(PAIR, organisation, fleet, JOBS)
    head = ContractNet().negotiator("AUV00", PAIR)
    opened = stated(head.negotiate(situation(1, work)))
    ends_s = ROUND_S * (1 + ContractNet().bidding_rounds)
    assert set(opened) == {(f"Pair.{role}", "auctionEnds", ends_s) for role in ABLE}
    bids = [Heard("AUV01", 15.0, (("Pair.Right", "bid", 1),)), Heard("AUV01", 15.0, (("Pair.Left", "bid", 900),))]
    head.negotiate(situation(2, work, *bids))
    awarded = stated(head.negotiate(situation(4, work)))
    assert ("AUV01", "playsRole", "Pair.Left") in awarded
    assert ("AUV01", "playsRole", "Pair.Right") not in awarded


def test_what_is_not_accepted_is_taken_back_in_time() -> None:
    fleet = database(auv("AUV00", playable_roles=("Head",)), auv("AUV01", playable_roles=("Hand", "Left")))
    work = Work(PAIR, ContractNet().form(fleet, [PAIR]), fleet, JOBS)
    head = configured(ContractNet(), {"accept_rounds": 5}).negotiator("AUV00", PAIR)
    bid = Heard("AUV01", 15.0, (("Pair.Left", "bid", 900),))
    said = [stated(head.negotiate(situation(number, work, *[bid][: number == 2]))) for number in range(1, 10)]
    assert [number for number, facts in enumerate(said, 1) if ("AUV01", "playsRole", "Pair.Left") in facts] == [4]
    assert [number for number, facts in enumerate(said, 1) if ("AUV01", "leftRole", "Pair.Left") in facts] == [9]


TWO_HANDS = database(
    auv("AUV00", playable_roles=("Head",)), *(auv(f"AUV0{n}", playable_roles=("Hand", *ABLE)) for n in (1, 2))
)


def two_hands(strategy: Strategy, *held: tuple[str, str]) -> Work:
    """Work of a head that does no jobs and two hands, who hold roles (role, vehicle)."""
    organisation = strategy.form(TWO_HANDS, [PAIR])
    for role, vehicle in held:
        organisation, _ = organisation.assign(vehicle, "Pair", role)
    return Work(PAIR, organisation, TWO_HANDS, JOBS)


def test_a_job_that_changes_hands_is_left_and_taken_in_one_block() -> None:
    """AUV02 has nothing, AUV01 both jobs: who hears half of the exchange would find no room, or leave it to nobody."""
    head = Central().negotiator("AUV00", PAIR)
    move = head.negotiate(situation(1, two_hands(Central(), ("Left", "AUV01"), ("Right", "AUV01"))))
    moved = [statement.facts for statement in move.statements]
    role = next(value for _, attribute, value in moved[0] if attribute == "leftRole")
    assert moved == [(("AUV01", "leftRole", role), ("AUV02", "playsRole", role))]


def test_whoever_has_no_job_says_so_and_is_not_waited_for() -> None:
    """AUV01 was at the left one, left it without a word, or began anew; AUV02 hears all its packets."""
    told, watching = (StatusBroadcast().negotiator(name, PAIR) for name in ("AUV01", "AUV02"))
    free = two_hands(StatusBroadcast())
    state = told._state(free)
    assert [fact for one in state for fact in one.facts] == [("AUV01", "worksOn", "Pair.Hand")]
    at_left = Heard("AUV01", 1.0, (("AUV01", "worksOn", "Pair.Left"), ("AUV01", "worksSince", 1.0)))
    watching._hear(at_left, free)
    assert watching._at["AUV01"].role == "Left"
    watching._hear(Heard("AUV01", 1.0, (("Pair.Right", "knownDone", True),)), free)
    assert "AUV01" in watching._at, "a part of the state that says nothing of it"
    watching._hear(Heard("AUV01", 9.0, state[-1].facts), free)
    assert watching._at == {}


def test_a_job_planned_for_another_that_never_claims_it_is_claimed_after_two_repeats() -> None:
    """AUV01 does the left one, and expects AUV02, which it does not hear, to do the right one."""
    bidder = Cbba().negotiator("AUV01", PAIR)
    work = two_hands(Cbba(), ("Left", "AUV01"))
    rounds = range(1, 4 * Cbba().repeat_rounds)
    said = [{fact[:2] for fact in stated(bidder.negotiate(situation(number, work)))} for number in rounds]
    first = next(number for number, facts in zip(rounds, said, strict=True) if ("Pair.Right", "claim") in facts)
    assert first == 1 + 2 * Cbba().repeat_rounds


def test_who_is_away_is_expected_until_its_leg_should_be_over() -> None:
    """A visit takes 100 m at 2 m/s and 60 s, and the way from there to the meeting 100 s; all that times 1.3."""
    fleet = database(*(auv(f"AUV0{n}", playable_roles=(role, *ABLE)) for n, role in enumerate(("Head", "Hand"))))
    organisation, _ = RendezvousSync().form(fleet, [PAIR]).assign("AUV01", "Pair", "Left")
    jobs = {name: Visit(name, (100.0, 0.0)) for name in JOBS}
    work = Work(PAIR, organisation, fleet, jobs, positions_m={"AUV00": (300.0, 0.0)})
    head = RendezvousSync().negotiator("AUV00", PAIR)
    until_s = ROUND_S + 1.3 * 210.0
    times_s = (ROUND_S, until_s - 0.1, until_s + 0.1)
    moves = [head.negotiate(Situation(now_s, 1, work, (300.0, 0.0), (), {})) for now_s in times_s]
    assert ["AUV01" in move.expected for move in moves] == [True, True, False]


@pytest.mark.parametrize("is_able", [True, False])
def test_a_queued_job_is_offered_only_to_who_is_able_to_do_it(is_able: bool) -> None:
    """AUV01 has both jobs and takes days; AUV02 would have done the right one, to which it turns last, earlier."""
    slow = auv("AUV01", playable_roles=("Hand", *ABLE), transit_speed_mps=0.0005)
    idle = auv("AUV02", playable_roles=("Hand", *(ABLE if is_able else ABLE[:1])))
    fleet = database(TWO_HANDS["AUV00"], slow, idle)
    organisation = ContractNet().form(fleet, [PAIR])
    for role in ABLE:
        organisation, _ = organisation.assign("AUV01", "Pair", role)
    given = Heard("AUV00", ROUND_S, tuple(("AUV01", "playsRole", f"Pair.{role}") for role in ABLE))
    hand = ContractNet().negotiator("AUV01", PAIR)
    said = [what for _, what, _ in stated(hand.negotiate(situation(1, Work(PAIR, organisation, fleet, JOBS), given)))]
    assert ("auctionEnds" in said) is is_able


@pytest.mark.parametrize("is_heard", [True, False])
def test_a_job_that_is_not_acknowledged_goes_to_another(is_heard: bool) -> None:
    work = two_hands(Central(), ("Left", "AUV01"), ("Right", "AUV02"))
    head = configured(Central(), {"acknowledge_rounds": 10}).negotiator("AUV00", PAIR)
    unheard = {} if is_heard else {"AUV01": {"Pair.Left"}}
    said = [stated(head.negotiate(replace(situation(number, work), unheard=unheard))) for number in range(1, 12)]
    assert not any(said[:-1])
    assert said[-1] == ([] if is_heard else [("AUV01", "leftRole", "Pair.Left"), ("AUV02", "playsRole", "Pair.Left")])


@pytest.mark.parametrize(("is_heard", "holds"), [(True, False), (False, True)])
def test_a_job_of_which_its_vehicle_has_not_heard_is_waited_for(is_heard: bool, holds: bool) -> None:
    """Others may have begun a job and given way; who has never heard of it comes to the meeting and waits."""
    work = two_hands(Remoras(), ("Left", "AUV01"), ("Right", "AUV02"))
    head = configured(Remoras(), {"acknowledge_rounds": 1000}).negotiator("AUV00", PAIR)
    unheard = {} if is_heard else {"AUV01": {"Pair.Left"}}
    moves = [head.negotiate(replace(situation(number, work), unheard=unheard)) for number in (1, 2, 100)]
    assert [move.holding for move in moves] == [True, True, holds]  # 1000 s later both jobs should have been done


def test_who_works_says_so_once_a_period() -> None:
    strategy = configured(StatusBroadcast(), {"period_rounds": 3})
    broadcaster = strategy.negotiator("AUV01", PAIR)
    work = two_hands(strategy, ("Left", "AUV01"))
    heard = Heard("AUV01", ROUND_S, (("AUV01", "worksOn", "Pair.Left"),))
    said = [stated(broadcaster.negotiate(situation(number, work, *[heard][: number == 1]))) for number in range(1, 8)]
    assert [number for number, facts in enumerate(said, 1) if ("AUV01", "worksOn", "Pair.Left") in facts] == [3, 6]


@pytest.mark.parametrize("doubt_rounds", [0, 10, 40])
def test_the_job_of_a_silent_vehicle_is_done_again_when_it_is_overdue(doubt_rounds: int) -> None:
    """AUV01 was last heard at the right area: what is predicted for it, and the doubt, decide when it is begun."""
    strategy = configured(StatusBroadcast(), {"doubt_rounds": doubt_rounds})
    fleet = database(*(auv(f"AUV0{n}", playable_roles=(kind, *ABLE)) for n, kind in enumerate(("Head", "Hand"))))
    organisation = strategy.form(fleet, [PAIR])
    work = Work(PAIR, organisation, fleet, JOBS, frozenset({"left"}))
    broadcaster = strategy.negotiator("AUV00", PAIR)
    heard = Heard("AUV01", ROUND_S, (("AUV01", "worksOn", "Pair.Right"),))
    begun = next(
        number
        for number in range(1, 400)
        if ("AUV00", "playsRole", "Pair.Right")
        in stated(broadcaster.negotiate(situation(number, work, *[heard][: number == 1])))
    )
    # 4 rows of 75 m and 3 steps of 25 m at 1.25 m/s, on top of the way from (0, 0) to (212.5, 12.5) at 2 m/s
    due_s = ROUND_S + 375.0 / 1.25 + (212.5**2 + 12.5**2) ** 0.5 / 2.0
    assert ROUND_S * (begun - 1 - doubt_rounds) < due_s <= ROUND_S * (begun - doubt_rounds)


# Many


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS_OF_JOBS.values(), ids=KINDS_OF_JOBS)
@pytest.mark.parametrize("name", SHIPPED)
@settings(max_examples=25)
@given(starts_m=starts, places_m=places)
@example(starts_m=[(-290.0, 248.0), (-296.0, 234.0)], places_m=[(300.0, 0.0)])  # far: a long way to be predicted
def test_without_loss_every_job_is_done_by_exactly_one_in_order(
    name: str, kind: Kind, starts_m: list[Point], places_m: list[Point]
) -> None:
    team, together = Team(SHIPPED[name], starts_m, kind(places_m), never), 0
    for _ in range(600):
        team.round()
        together = together + 1 if team.at_one_job() else 0
        assert together <= TALKED_OVER
        if team.done:
            break
    assert team.finished == dict.fromkeys(team.jobs, 1)
    assert not team.too_early


def lossy(lost: Sequence[bool], until: int) -> Lost:
    """Lose by a repeated script, and nothing any more after a round."""
    return lambda number, sender, receiver: (
        number <= until and lost[(7 * number + 3 * int(sender[-1]) + int(receiver[-1])) % len(lost)]
    )


scripts = st.lists(st.booleans(), min_size=5, max_size=40)


@settings(max_examples=40)
@given(starts_m=starts, places_m=places, lost=scripts, until=st.integers(5, 60))
def test_cbba_is_free_of_conflict_once_all_has_got_through(
    starts_m: list[Point], places_m: list[Point], lost: list[bool], until: int
) -> None:
    """All is said again within ``repeat_rounds``; twice that time: once to be heard, once to give way."""
    team = Team(Cbba(), starts_m, surveys(places_m), lossy(lost, until))
    team.run(until + 2 * Cbba().repeat_rounds)
    for _ in range(20):
        assert team.at_one_job() == 0
        team.round()


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS_OF_JOBS.values(), ids=KINDS_OF_JOBS)
@pytest.mark.parametrize("name", SHIPPED)
@settings(max_examples=15)
@given(starts_m=starts, places_m=places, lost=scripts)
def test_whatever_was_lost_all_is_done_in_the_end_and_in_order(
    name: str, kind: Kind, starts_m: list[Point], places_m: list[Point], lost: list[bool]
) -> None:
    team = Team(SHIPPED[name], starts_m, kind(places_m), lossy(lost, 100))
    for _ in range(1500):
        team.round()
        if team.done:
            break
    assert team.done
    assert not team.too_early


def test_a_job_that_each_expects_another_to_do_is_done() -> None:
    """In silence each of four plans the second job for another one; nothing they hear later makes them plan anew."""
    starts_m = [(1.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 1.0)]
    team = Team(Cbba(), starts_m, ordered_visits([(1.0, 0.0), (0.0, 0.0)]), lambda number, *_: number <= 100)
    team.run(200)
    assert team.done


def test_in_silence_cbba_does_everything_twice() -> None:
    """The script can break what the test of conflicts proves: two who never hear each other do all the work each.

    They bid for their own gain: with a plan for all each would leave a part to the other, until its lease has run out.
    """
    team = Team(
        Cbba(plans_for_all=False), [(0.0, 0.0), (10.0, 0.0)], surveys([(0.0, 0.0), (0.0, 200.0)]), lambda *_: True
    )
    team.run(600)
    assert team.finished == {"job 0": 2, "job 1": 2}


def test_without_a_word_jobs_that_need_each_other_are_done_by_one() -> None:
    """The fixed partition gives the chain 0, 1, 2 to one vehicle and what stands alone to the other."""
    jobs = ordered_visits([(0.0, 50.0), (0.0, 100.0), (0.0, 150.0)]) + visits([(0.0, -50.0)] * 4)[3:]
    team = Team(SHIPPED["fixed-partition"], [(0.0, 0.0), (10.0, 0.0)], jobs, never)
    team.run(100)
    assert sorted(len(member.finished) for member in team.members.values()) == [1, 3]
    assert not team.too_early
