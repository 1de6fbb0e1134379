"""Fewer able vehicles than a lift needs: it is reported, the rest is done, no vehicle waits forever."""

from types import SimpleNamespace

import pytest
from sample_vehicles import AUV
from varied import Varied

from missions.fieldwork.assistance import Help
from missions.fieldwork.jobs import Helping, Lift
from missions.runs.run import Run
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.truth import within_reach

flown = Varied("recovery-field", "field.toml").flown
LIFTS = ["lift 1", "lift 2", "lift 3", "lift 4"]


def fault(*vehicles: str, kind: str = "lost", at_s: float = 200.0) -> str:
    return "fault=[" + ", ".join(f"{{vehicle='{name}', kind='{kind}', at_s={at_s}}}" for name in vehicles) + "]"


def ends_as_impossible(run: Run) -> bool:
    """True if all sites are surveyed, all lifts declared impossible, and the run then ends."""
    said = {row[4] for row in run.recorder.items if row[5] == "isImpossible" and row[6] == "true"}
    assert said == set(LIFTS)
    assert run.goal_fraction == run.reachable_fraction == 0.75  # twelve of sixteen jobs
    assert "no vehicle left that is able to do lift 1, lift 2, lift 3, lift 4" in run.reason
    return run.recorder.trajectories[-1][0] < run.scenario.scenario.duration_s


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ((fault("AUV01", "AUV02", "AUV03"),), "takes 2 vehicles at once"),
        pytest.param(("lifts.vehicles=4", fault("AUV01", kind="deaf")), "takes 4 vehicles at once",
                     marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_lifts_that_need_more_vehicles_than_are_left_are_impossible(keys: tuple[str, ...], why: str) -> None:
    """Before, a holder waited at a lift to the end and sites stayed open: goal 0.25 and 0.56, reachable 1."""
    run = flown(1, *keys)
    assert ends_as_impossible(run)
    assert {row[3] for row in run.recorder.faults if row[2] == "impossible"} == {f"{lift}: {why}" for lift in LIFTS}


@pytest.mark.slow
def test_holder_that_waits_too_long_leaves_its_lift_to_help() -> None:
    """Nobody calls under ``central``: each held a lift and waited for the others, to the end."""
    keys = "strategy.name=central", "lifts.lift_s=400.0", "scenario.duration_s=6000"
    waiting = flown(2, *keys, "mission.wait_s=6000")
    assert "waits for others at lift" in waiting.reason
    assert flown(2, *keys).completed


def test_job_is_impossible_with_fewer_vehicles_in_contact_than_it_takes() -> None:
    lift = Lift("lift 1", 60.0, n_vehicles=2, length_m=10.0)
    one, deaf, away = (
        SimpleNamespace(able_data=AUV, is_in_contact=contact, will_return=back, can_play=lambda *of: True)
        for contact, back in ((True, False), (False, False), (False, True))
    )
    for fleet, found in (([one], set()), ([one, deaf], set()), ([one, one], {"lift 1"}), ([one, away], {"lift 1"})):
        assert within_reach({"lift 1": lift}, (), SimpleNamespace(vehicles=fleet), ()) == found


def test_helper_waits_no_longer_than_its_stated_limit() -> None:
    """Three are needed, one holds the lift and one helps: that one had no limit, and was named with none."""
    help = Help("lift 1", "Crew", ("AUV01",), AUV.name, 2, "helps", ("lift 1",))
    behaviour = Helping(Lift("lift 1", 60.0, n_vehicles=3, length_m=10.0), help, AUV, 100.0)
    lift = Lift("lift 1", 60.0, n_vehicles=3, length_m=10.0)
    picture = Picture(facts={("lyingAt", "lift 1"): (0.0, 0.0)})
    at = Motion(*lift.ends_m((0.0, 0.0))[0])
    for now_s, until_s in ((0.0, 100.0), (100.0, 100.0), (102.0, None), (104.0, None)):
        picture.body.now_s = now_s
        waits = behaviour.perceive(at, picture, True).waits
        assert (None if waits is None else waits.until_s) == until_s
    assert behaviour.perceive(at, picture, True).stimulus == 0.0


def test_reason_names_lifts_of_unknown_position() -> None:
    """A short sonar on all, and dead from the start on: the objects of no lift are seen."""
    run = flown(1, fault("AUV00", "AUV01", "AUV02", "AUV03", kind="sensor", at_s=1.0), "scenario.duration_s=60")
    assert "positions unknown to the vehicles: lift 1, lift 2, lift 3, lift 4" in run.reason
