"""Reorganising: an organisation that changes itself at sea, when something is not as foreseen and news is fresh."""

import itertools
from dataclasses import replace
from functools import cache

import pytest

from exchange.peering.peers import Link, PeerLinks
from missions.benchmark.suite import suite_named
from missions.runs.run import Run, run_of
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.strategies.reorganising import REORGANISING, Reorganiser, Reorganising, news_age_s
from remoras.strategy import Heard, Move, Situation
from remoras.testing.sample_worlds import KINDS_OF_JOBS, Team, Watched, never
from remoras.testing.strategies import CHECKS
from remoras.work import Work

PLACES_M = ((0.0, 50.0), (200.0, -100.0), (-150.0, 0.0), (50.0, 250.0), (250.0, -150.0), (-200.0, -50.0))
STARTS_M = ((0.0, 0.0), (200.0, 0.0), (-200.0, 0.0))
NAMES = ("AUV00", "AUV01", "AUV02")
FRESH = PeerLinks(Link(0.1, 20, 0.1), Link(0.1, 20, 0.1))


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_it_conforms(check: object) -> None:
    assert callable(check)
    check(REORGANISING)


def known(heard: tuple[Heard, ...] = (), number: int = 2, loss: float = 0.1, frame_s: float = 7.0) -> Situation:
    """What the head of three knows, of jobs that were given out before."""
    jobs = {job.name: job for job in next(iter(KINDS_OF_JOBS.values()))(PLACES_M)}
    team = Team(REORGANISING, STARTS_M, list(jobs.values()), never)
    organisation = next(iter(team.members.values())).organisation
    work = Work(team.group, organisation, team.database, jobs, frozenset(), {})
    links = dict.fromkeys(NAMES[1:], FRESH._replace(incoming=Link(loss, 20, loss)))
    now_s = frame_s * number
    return Situation(now_s, number, work, None, heard, dict.fromkeys(NAMES[1:], now_s), links=links)


def lacking(situation: Situation, vehicle: str) -> Situation:
    """The same once a vehicle takes no jobs any more."""
    return replace(situation, work=replace(situation.work, unavailable=frozenset({vehicle})))


def said_numbers(move: Move) -> list[object]:
    return [value for said in move.statements for _, word, value in said.facts if word == "claimsOf"]


def made(me: str = "AUV00") -> Reorganiser:
    """One that has had its first round."""
    reorganiser = REORGANISING.negotiator(me, known().work.group)
    assert said_numbers(reorganiser.negotiate(known(number=1))) == []
    return reorganiser


def test_the_head_proposes_when_a_worker_is_gone_and_news_is_fresh() -> None:
    assert said_numbers(made().negotiate(known())) == []
    assert said_numbers(made().negotiate(lacking(known(), "AUV01"))) == [1]
    assert said_numbers(made("AUV01").negotiate(lacking(known(), "AUV02"))) == []  # it leads nobody
    assert said_numbers(made().negotiate(lacking(known(loss=0.9), "AUV01"))) == []  # 7 s / 0.1 is above 30 s
    assert said_numbers(made().negotiate(lacking(known(frame_s=33.0), "AUV01"))) == []


def test_news_is_as_old_as_a_frame_over_the_share_that_is_heard_or_as_the_last_word() -> None:
    assert news_age_s(known(loss=0.5)) == pytest.approx(14.0)
    assert news_age_s(replace(known(), heard_s=dict.fromkeys(NAMES[1:], -26.0))) == pytest.approx(40.0)
    alone = known().work
    assert news_age_s(replace(known(), work=replace(alone, unavailable=frozenset(NAMES[1:])))) == float("inf")


def test_the_head_proposes_when_a_job_is_late_and_not_before() -> None:
    late = known(number=10_000)
    assert said_numbers(made().negotiate(late)) == [1]
    assert said_numbers(Reorganising(share=1e3).negotiator("AUV00", late.work.group).negotiate(late)) == []


def test_who_has_heard_the_same_goes_by_the_same_whatever_came_first() -> None:
    """The greatest number of a member counts; what others say of it, or who is no member, does not."""
    told = [
        Heard("AUV00", 7.0, (("AUV00", "claimsOf", 1),)),
        Heard("AUV02", 7.0, (("AUV02", "claimsOf", 2),)),
        Heard("AUV02", 7.0, (("AUV00", "claimsOf", 9),)),
    ]
    numbers = set()
    for order in itertools.permutations(told):
        one = made("AUV01")
        for number, heard in enumerate(order, 2):
            one.negotiate(known((heard,), number))
        numbers.add(one.number)
    assert numbers == {2}


def test_who_changes_keeps_the_job_that_it_is_at_and_tells_that_it_leaves_the_others() -> None:
    one = made("AUV01")
    heard = known((Heard("AUV00", 14.0, (("AUV00", "claimsOf", 1),)),))
    held = heard.work.held_by("AUV01")
    assert len(held) == 2
    move = one.negotiate(heard)
    left = [value for said in move.statements for _, word, value in said.facts if word == "leftRole" and said.told]
    at = [value for said in move.statements for _, word, value in said.facts if word == "worksOn"]
    assert sorted([*left, *at]) == sorted(f"Team.{role.name}" for role in held)
    assert len(left) == 1


@cache
def flown(strategy: Reorganising, *settings: str) -> tuple[Run, Watched]:
    """The case of the suite in which four finds come up, under losses that are alike on all links."""
    found = "scenario.duration_s=7200.0", "channel.per=0.42", "finds.number=4"
    watched = Watched(strategy)
    scenario = load("mapping-patches", [("--set", one) for one in (*found, *settings)])
    return run_of(resolved(scenario, watched), suite_named("fathom-1").seed(0)), watched


@pytest.mark.slow
def test_it_ends_sooner_for_having_changed_where_work_is_found() -> None:
    """Cause taken out: with ``news_s`` 0 nobody ever proposes, and the fleet ends as under the plan alone."""
    changing, watched = flown(Reorganising())
    staying, never_said = flown(Reorganising(news_s=0.0))
    assert any(said_numbers(move) for *_, move in watched.moves)
    assert not any(said_numbers(move) for *_, move in never_said.moves)
    assert changing.end_s < 0.97 * staying.end_s


@pytest.mark.slow
@pytest.mark.parametrize("after_s", [1.0, 20.0])
def test_a_head_that_is_lost_in_the_midst_of_a_change_leaves_a_group_that_agrees(after_s: float) -> None:
    """It is gone before anybody can have heard of the change, or when some may have; the mission is completed."""
    _, watched = flown(Reorganising())
    proposed_s = next(situation.now_s for *_, situation, move in watched.moves if said_numbers(move))
    run, watched = flown(Reorganising(), f'fault=[{{vehicle="AUV00", kind="lost", at_s={proposed_s + after_s}}}]')
    assert run.completed
    last = {vehicle: said_numbers(move) for vehicle, *_, move in watched.moves if said_numbers(move)}
    assert set(last) >= {"AUV01", "AUV02"}
    assert last["AUV01"] == last["AUV02"]
