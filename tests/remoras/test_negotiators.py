"""Agreement of negotiators over an exchange with scripted losses."""

from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from samples import auv, database
from team import KINDS_OF_JOBS, ROUND_S, Lost, Team, never, ordered_visits, surveys

from missions.mapping.jobs import SurveyJob
from remoras.organisation import Group, RoleSpecification
from remoras.strategies import configured, strategies
from remoras.strategies.cbba import Cbba
from remoras.strategies.central import Central
from remoras.strategies.contract_net import ContractNet
from remoras.strategies.remoras import Remoras
from remoras.strategy import Heard, Move, Situation, Strategy
from remoras.work import Work

SHIPPED = strategies()
TALKED_OVER = 2
"""Frames after which two at the same job have heard of each other, when nothing is lost."""

points_m = st.tuples(st.integers(-300, 300).map(float), st.integers(-300, 300).map(float))
starts = st.lists(points_m, min_size=2, max_size=4)
places = st.lists(points_m, min_size=1, max_size=6, unique=True)
kinds = st.sampled_from(list(KINDS_OF_JOBS))

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


def test_an_order_without_acceptance_is_withdrawn_in_time() -> None:
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


def test_a_reassigned_job_is_released_and_taken_in_one_block() -> None:
    """AUV02 has nothing, AUV01 both jobs: who hears half of the exchange would find no room, or leave it to nobody."""
    head = Central().negotiator("AUV00", PAIR)
    move = head.negotiate(situation(1, two_hands(Central(), ("Left", "AUV01"), ("Right", "AUV01"))))
    moved = [statement.facts for statement in move.statements]
    role = next(value for _, attribute, value in moved[0] if attribute == "leftRole")
    assert moved == [(("AUV01", "leftRole", role), ("AUV02", "playsRole", role))]


def test_a_job_its_planned_vehicle_never_bids_for_is_taken_after_two_repeats() -> None:
    """AUV01 does the left one, and expects AUV02, which it does not hear, to do the right one."""
    bidder = Cbba().negotiator("AUV01", PAIR)
    work = two_hands(Cbba(), ("Left", "AUV01"))
    rounds = range(1, 4 * Cbba().repeat_rounds)
    said = [{fact[:2] for fact in stated(bidder.negotiate(situation(number, work)))} for number in rounds]
    first = next(number for number, facts in zip(rounds, said, strict=True) if ("Pair.Right", "claim") in facts)
    assert first == 1 + 2 * Cbba().repeat_rounds


@pytest.mark.parametrize("is_heard", [True, False])
def test_an_unacknowledged_job_is_reassigned(is_heard: bool) -> None:
    work = two_hands(Central(), ("Left", "AUV01"), ("Right", "AUV02"))
    head = configured(Central(), {"acknowledge_rounds": 10}).negotiator("AUV00", PAIR)
    unheard = {} if is_heard else {"AUV01": {"Pair.Left"}}
    said = [stated(head.negotiate(replace(situation(number, work), unheard=unheard))) for number in range(1, 12)]
    assert not any(said[:-1])
    assert said[-1] == ([] if is_heard else [("AUV01", "leftRole", "Pair.Left"), ("AUV02", "playsRole", "Pair.Left")])


@pytest.mark.parametrize(("is_heard", "holds"), [(True, False), (False, True)])
def test_a_job_whose_order_is_undelivered_is_not_reassigned(is_heard: bool, holds: bool) -> None:
    """Others may have begun a job and given way; who has never heard of it comes to the meeting and waits."""
    work = two_hands(Remoras(), ("Left", "AUV01"), ("Right", "AUV02"))
    head = configured(Remoras(), {"acknowledge_rounds": 1000}).negotiator("AUV00", PAIR)
    unheard = {} if is_heard else {"AUV01": {"Pair.Left"}}
    moves = [head.negotiate(replace(situation(number, work), unheard=unheard)) for number in (1, 2, 100)]
    assert [move.holding for move in moves] == [True, True, holds]  # 1000 s later both jobs should have been done


# Many


def share_a_job(team: Team) -> bool:
    """True if two vehicles are at one job."""
    at = [member.at[0] for member in team.members.values() if member.at is not None]
    return len(set(at)) < len(at)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
@settings(max_examples=25)
@given(starts_m=starts, places_m=places, kind=kinds)
@example(starts_m=[(-290.0, 248.0), (-296.0, 234.0)], places_m=[(300.0, 0.0)], kind="surveys")  # a long way to predict
def test_without_loss_every_job_is_done_by_exactly_one_in_order(name, starts_m, places_m, kind) -> None:
    team, together = Team(SHIPPED[name], starts_m, KINDS_OF_JOBS[kind](places_m), never), 0
    for _ in range(600):
        team.round()
        together = together + 1 if share_a_job(team) else 0
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
def test_cbba_is_conflict_free_after_all_bids_are_delivered(starts_m, places_m, lost, until) -> None:
    """All is said again within ``repeat_rounds``; twice that time: once to be heard, once to give way."""
    team = Team(Cbba(), starts_m, surveys(places_m), lossy(lost, until))
    team.run(until + 2 * Cbba().repeat_rounds)
    for _ in range(20):
        assert not share_a_job(team)
        team.round()


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
@settings(max_examples=15)
@given(starts_m=starts, places_m=places, kind=kinds, lost=scripts)
def test_all_jobs_are_done_in_order_whatever_was_lost(name, starts_m, places_m, kind, lost) -> None:
    team = Team(SHIPPED[name], starts_m, KINDS_OF_JOBS[kind](places_m), lossy(lost, 100))
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
