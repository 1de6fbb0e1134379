"""Adaptive strategies: reorganisation at run time after a deviation, given fresh information."""

from dataclasses import replace

import pytest
from team import KINDS_OF_JOBS, Team, never

from exchange.manager.peers import Link, PeerLinks
from remoras.strategies.reorganising import REORGANISING, Reorganiser, Reorganising, news_age_s
from remoras.strategy import Heard, Move, Situation
from remoras.work import Work

PLACES_M = ((0.0, 50.0), (200.0, -100.0), (-150.0, 0.0), (50.0, 250.0), (250.0, -150.0), (-200.0, -50.0))
STARTS_M = ((0.0, 0.0), (200.0, 0.0), (-200.0, 0.0))
NAMES = ("AUV00", "AUV01", "AUV02")
FRESH = PeerLinks(Link(0.1, 20, 0.1), Link(0.1, 20, 0.1))


def known(heard: tuple[Heard, ...] = (), number: int = 2, loss: float = 0.1, frame_s: float = 7.0) -> Situation:
    """Knowledge of the leader of three vehicles with assigned jobs."""
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


def test_the_leader_proposes_when_a_worker_is_lost_and_information_fresh() -> None:
    assert said_numbers(made().negotiate(known())) == []
    assert said_numbers(made().negotiate(lacking(known(), "AUV01"))) == [1]
    assert said_numbers(made("AUV01").negotiate(lacking(known(), "AUV02"))) == []  # it leads nobody
    assert said_numbers(made().negotiate(lacking(known(loss=0.9), "AUV01"))) == []  # 7 s / 0.1 is above 30 s
    assert said_numbers(made().negotiate(lacking(known(frame_s=33.0), "AUV01"))) == []


def test_age_of_information_is_frame_over_delivery_rate_or_time_since_reception() -> None:
    assert news_age_s(known(loss=0.5)) == pytest.approx(14.0)
    assert news_age_s(replace(known(), heard_s=dict.fromkeys(NAMES[1:], -26.0))) == pytest.approx(40.0)
    alone = known().work
    assert news_age_s(replace(known(), work=replace(alone, unavailable=frozenset(NAMES[1:])))) == float("inf")


def test_the_leader_proposes_only_when_a_job_is_late() -> None:
    late = known(number=10_000)
    assert said_numbers(made().negotiate(late)) == [1]
    assert said_numbers(Reorganising(share=1e3).negotiator("AUV00", late.work.group).negotiate(late)) == []
