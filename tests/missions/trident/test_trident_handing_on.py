"""A vehicle whose modules have failed leaves the recovery to one that has what it takes, whichever that is."""

import math
import random
from dataclasses import replace
from typing import Any

import pytest
from intervening import Run, metric, run, said

from missions.trident import mission as trident_mission
from missions.trident.jobs import RecoveryJob
from missions.trident.tasks import HANDLING, HOLDING, REACQUIRING, activity_domain
from remoras.htn import ANY, Domain
from remoras.social.layer import SocialLayer
from remoras.work import Work

SOUND = 3
"""Seed of runs in which no finder takes a decoy for the target, or the target for a decoy."""
SHIFTED = 10
"""Seed of a run in which the two divers err apart about their places, as nobody keeps near to give them fixes."""
ALONE = "fleet.size=3", "mission.escort_m=0"
MISSED = 1
"""Seed of a run in which no survey shows the target at first."""


def recovered_by(of: Run) -> str:
    return next((stone.vehicle for stone in of.milestones if stone.name == "recovered"), "")


def rows(of: Run, kind: str) -> list[tuple[str, str]]:
    return [(row[1], row[3]) for row in of.recorder.rows("faults") if row[2] == kind]


def two(*failing: str, at_s: float, seed: int = SOUND, until_s: float = 3600.0) -> Run:
    return run("fleet.size=3", failing=failing, at_s=at_s, seed=seed, until_s=until_s)


def test_without_fault_the_first_of_two_recovers_it() -> None:
    assert recovered_by(two(at_s=0.0)) == "IAUV00"


@pytest.mark.parametrize("failing", ["arm gripper", "clamp hover", "camera forward_sonar"])
@pytest.mark.parametrize("dead", ["IAUV00", "IAUV01"])
def test_who_lacks_all_ways_of_one_step_is_not_given_the_recovery(dead: str, failing: str) -> None:
    services = [f"{dead} {module.replace('_', ' ')}" for module in failing.split()]
    done = two(*services, at_s=100.0)
    assert done.completed, done.reason
    assert recovered_by(done) != dead


def test_who_has_it_already_leaves_it_with_the_reason() -> None:
    """Both fail while it is on its way: the head gives it to the other vehicle in the next round."""
    done = two("IAUV00 arm", "IAUV00 gripper", at_s=1400.0)
    assert rows(done, "cannot") == [("IAUV00", "recovery: IAUV00 arm has failed; IAUV00 gripper has failed")]
    assert recovered_by(done) == "IAUV01"


@pytest.mark.parametrize("draw", range(4))
def test_drawn_times_and_vehicles(draw: int) -> None:
    rng = random.Random(draw)
    dead, at_s = f"IAUV0{rng.randrange(2)}", round(rng.uniform(0.0, 1500.0))
    done = two(f"{dead} arm", f"{dead} gripper", at_s=at_s)
    assert done.completed, (dead, at_s, done.reason)


def test_without_asking_what_has_failed_it_is_given_to_who_has_no_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who is able is what was so at the start; a vehicle finds out by its plan, says so, and leaves it to the other."""
    monkeypatch.setattr(RecoveryJob, "rests_on", ())
    monkeypatch.setattr(RecoveryJob, "left", lambda self, facts: self)
    done = two("IAUV00 arm", "IAUV00 gripper", at_s=101.0)
    assert rows(done, "cannot")[0] == ("IAUV00", "recovery: no way left")
    assert [(vehicle, job) for _, vehicle, _, job in said(done, "unableTo")] == [("IAUV00", "recovery")]
    assert recovered_by(done) == "IAUV01"


def test_without_leaving_what_it_has_no_way_for_the_recovery_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cause taken out: it keeps the role, and nobody else gets it."""
    monkeypatch.setattr(SocialLayer, "leave", lambda self: [])
    done = two("IAUV00 arm", "IAUV00 gripper", at_s=1402.0)
    assert not done.completed
    assert recovered_by(done) == ""


def test_what_nobody_is_able_to_do_is_said_and_all_come_home() -> None:
    done = run(failing=("IAUV00 arm", "IAUV00 gripper"), at_s=100.0, until_s=7200.0)
    assert rows(done, "impossible") == [("ASV00", "recovery: IAUV00 arm has failed; IAUV00 gripper has failed")]
    assert not done.completed
    assert done.recorder.rows("trajectories")[-1][0] < 1800.0
    assert metric(done, "charted_fraction") == 1.0  # what could be done was
    assert "recovery impossible, as vehicles say since" in done.reason


def test_a_module_that_fails_for_a_while_makes_it_possible_again() -> None:
    settings = [
        f'{{kind="sensor",vehicle="IAUV00",sensor="{one}",at_s=100.0,until_s=700.0}}' for one in ("arm", "gripper")
    ]
    done = run(f"fault=[{','.join(settings)}]")
    told = [value for _, _, _, value in said(done, "isImpossible")]
    assert told == ["true", "false"]
    assert done.completed, done.reason
    assert metric(done, "target_recovered_s") < math.inf


# What another vehicle has found and held


def test_who_takes_over_finds_it_again_and_holds_on_itself() -> None:
    """The first has found it again and holds on when arm and gripper die; where it lies is so by its own error."""
    done = run(*ALONE, failing=("IAUV00 arm", "IAUV00 gripper"), at_s=1600.0, seed=SHIFTED)
    assert [stone.vehicle for stone in done.milestones if stone.name == "held"] == ["IAUV00", "IAUV01"]
    assert [(vehicle, by) for _, vehicle, _, by in said(done, "reacquiredBy")] == [(name, name) for name in BOTH]
    assert recovered_by(done) == "IAUV01"
    assert done.completed, done.reason


BOTH = ("IAUV00", "IAUV01")


def of_anybody(*args: Any) -> Domain:
    """The tasks with the cause taken out: whoever has found it again, and holds it, counts."""
    domain = activity_domain(*args)
    changed = {
        REACQUIRING: {"effects": lambda facts, job, candidate, *of: {("verdict", candidate): "target"}},
        HOLDING: {
            "applicable": lambda facts, job, candidate, *of: facts.get(("verdict", candidate)) == "target",
            "effects": lambda facts, job, candidate, *of: {("heldBy", candidate): ANY},
        },
        HANDLING: {"applicable": lambda facts, job, candidate, *of: facts.get(("heldBy", candidate)) is not None},
    }
    operators = [replace(one, **changed.get(name, {})) for name, one in domain.operators.items()]
    return Domain.of(operators, domain.methods)


def test_where_anybody_s_hold_counts_who_takes_over_handles_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trident_mission, "activity_domain", of_anybody)
    done = run.__wrapped__(*ALONE, failing=("IAUV00 arm", "IAUV00 gripper"), at_s=1600.0, seed=SHIFTED)
    assert [stone.vehicle for stone in done.milestones if stone.name == "held"] == ["IAUV00"]
    assert recovered_by(done) == ""


# What is left to be looked at


@pytest.mark.slow
def test_what_no_survey_showed_is_found_by_another_one() -> None:
    done = run("fleet.size=3", seed=MISSED, until_s=7200.0)
    assert [value for _, _, _, value in said(done, "surveysAgain")] == ["1.0"]
    assert {subject for _, _, subject, _ in said(done, "surveyedAgain")} == {"east", "west"}
    assert done.completed, done.reason
    assert metric(done, "n_violations") == 0


def test_without_another_survey_nothing_is_left_and_that_is_said() -> None:
    """The cause taken out: all candidates are looked at as often as they may be, then all come home."""
    done = run("fleet.size=3", "mission.surveys_again=0", seed=MISSED, until_s=7200.0)
    assert not done.completed
    assert recovered_by(done) == ""
    assert [value for _, _, _, value in said(done, "isExhausted")] == ["true"]
    assert {what for _, what in rows(done, "impossible")} == {
        "recovery: no candidate is left that may be the target, or nobody to choose it"
    }
    assert done.recorder.rows("trajectories")[-1][0] < 4200.0
    assert metric(done, "n_violations") == 0


@pytest.mark.slow
def test_who_does_not_see_that_it_is_impossible_goes_on_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cause taken out: nothing is left and that is known, but nobody concludes from it that nobody is able."""
    monkeypatch.setattr(Work, "impossible", frozenset())
    done = run.__wrapped__("mission.surveys_again=0", "recovery.target_m=[190.0,-20.0]", until_s=4400.0)
    assert [value for _, _, _, value in said(done, "isExhausted")] == ["true"]
    assert rows(done, "impossible") == []
    assert done.recorder.rows("trajectories")[-1][0] == 4400.0


@pytest.mark.slow
def test_a_target_that_lies_outside_is_looked_for_twice_and_given_up() -> None:
    done = run("recovery.target_m=[190.0,-20.0]", until_s=7200.0)
    assert [value for _, _, _, value in said(done, "isExhausted")] == ["true"]
    assert not done.completed
    assert done.recorder.rows("trajectories")[-1][0] < 5600.0
    assert "recovery impossible, as vehicles say since" in done.reason


VAGUE = ("vehicle.ASV00.sensor.multibeam.sigma_m=32", "vehicle.IAUV00.sensor.stereo.sigma_m=32", "mission.search_m=6")
"""What surveys find lies far from where they say, and nobody searches far around."""


def test_what_is_not_there_is_absent_and_says_nothing_of_who_searched() -> None:
    done = run(*VAGUE, seed=3)
    assert "absent" in [value for _, _, _, value in said(done, "verdict")]
    assert said(done, "unableTo") == []
    assert metric(done, "target_recovered_s") < math.inf


def test_who_does_not_know_whether_its_finders_work_says_that_it_is_unable() -> None:
    silent = [f"vehicle.IAUV00.sensor.{one}.self_test=false" for one in ("camera", "forward sonar")]
    done = run(*VAGUE, *silent, seed=3)
    assert [(vehicle, job) for _, vehicle, _, job in said(done, "unableTo")] == [("IAUV00", "recovery")]


# What nobody is left to do


@pytest.mark.parametrize(
    ("failing", "why", "latest_s"),
    [
        (("ASV00 console", "IAUV00 recogniser"), "nobody to choose it", 1500.0),
        (("ASV00 multibeam", "IAUV00 stereo", "IAUV00 sidescan"), "IAUV00 stereo has failed", 1000.0),
    ],
)
def test_what_nobody_is_left_to_choose_or_survey_is_said_to_be_impossible(
    failing: tuple[str, ...], why: str, latest_s: float
) -> None:
    """All come home. A diver whose survey on request failed left the role by which it is called home."""
    done = run(failing=failing, at_s=200.0, until_s=7200.0)
    assert not done.completed
    assert any(why in what for _, what in rows(done, "impossible"))
    tracks = done.recorder.rows("trajectories")
    assert tracks[-1][0] < latest_s
    last = {row[1]: row for row in tracks}
    assert all(math.dist(row[2:4], (190.0, 60.0)) <= 25.0 for row in last.values())
