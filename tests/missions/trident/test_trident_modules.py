"""Modules: what they perceive where they are, what they report where they take themselves to be, and how often."""

import math
from typing import Any

import pytest

from missions.trident.services import (
    ATTEMPTS,
    CHARTED,
    EffectorSettings,
    FinderSettings,
    FixerSettings,
    ModuleSettings,
    SurveyorSettings,
)
from missions.trident.site import Lying, SeabedBlock, Site
from remoras.sensor import Pose
from tests.sample_vehicles import AUV

BLOCK = SeabedBlock("west", 0.0, 0.0, 100.0, 100.0, 20.0)
TARGET, DECOY = Lying("target", (50.0, 50.0), True), Lying("decoy 1", (90.0, 90.0), False)


def site(seed: int = 1, *objects: Lying) -> Site:
    return Site((BLOCK,), objects or (TARGET,), (0.0, 0.0), 30.0, seed)


def pose(x_m: float, y_m: float, speed_mps: float = 0.0, error_m: tuple[float, float] = (0.0, 0.0)) -> Pose:
    return Pose(x_m, y_m, 20.0, 0.0, speed_mps, error_m)


def made(settings: ModuleSettings) -> Any:
    return settings.make(AUV)


def surveyor(**keys: Any) -> Any:
    of = {"name": "stereo", "capability": "StereoSurvey", "reach_m": 12.0, "speed_limit_mps": 1.0, "sigma_m": 1.0}
    return made(SurveyorSettings(**{**of, **keys}))


def effector(does: str = "handle", tolerance_m: float = 1.0, attempt_s: float = 10.0) -> Any:
    return made(
        EffectorSettings(
            name="arm", capability="ArmManipulation", does=does, tolerance_m=tolerance_m, attempt_s=attempt_s
        )  # type: ignore[arg-type]
    )


def test_a_survey_claims_tiles_where_the_vehicle_takes_itself_to_be_and_charts_where_it_is() -> None:
    found = surveyor().sense(pose(10.0, 10.0, 1.0, (40.0, 0.0)), site(), 0.0)
    assert [one.facts for one in found if one.facts] == [(("west", "chartedTile", 2),)]  # believed at (50, 10)
    assert [one.row for one in found if one.row] == [(0, 0)]


def test_who_is_too_fast_charts_nothing_and_a_tile_is_charted_once() -> None:
    module = surveyor()
    assert module.sense(pose(10.0, 10.0, 1.1), site(), 0.0) == []
    assert len(module.sense(pose(10.0, 10.0, 1.0), site(), 1.0)) == 2  # the claim and the truth
    assert module.sense(pose(10.0, 10.0, 1.0), site(), 2.0) == []


def test_a_survey_shows_the_target_more_like_itself_than_a_decoy_and_with_the_error_that_it_states() -> None:
    shown: dict[str, list[float]] = {"target": [], "decoy 1": []}
    off_m = []
    for seed in range(300):
        for one in (TARGET, DECOY):
            here = pose(*one.position_m, 1.0)
            for seen in surveyor(p_seen=1.0).sense(here, site(seed, TARGET, DECOY), 0.0):
                if seen.found:
                    (_, _, place, sigma_m), (_, _, likeness, _) = seen.facts
                    shown[one.name].append(likeness)
                    off_m.append((place[0] - one.position_m[0], sigma_m))
    assert len(shown["target"]) == 300
    # means 0.70 and 0.45, cut off at 0 and 1, sigma 0.125: the standard error of 300 is 0.007
    assert sum(shown["target"]) / 300 == pytest.approx(0.70, abs=0.03)
    assert sum(shown["decoy 1"]) / 300 == pytest.approx(0.45, abs=0.03)
    assert math.sqrt(sum(x**2 for x, _ in off_m) / len(off_m)) == pytest.approx(1.0, rel=0.1)
    assert {sigma_m for _, sigma_m in off_m} == {1.0}


def test_a_pass_misses_as_often_as_it_says() -> None:
    here = pose(*TARGET.position_m, 1.0)
    n = sum(any(one.found for one in surveyor(p_seen=0.8).sense(here, site(seed), 0.0)) for seed in range(400))
    assert n / 400 == pytest.approx(0.8, abs=0.06)  # three standard errors of 0.02


def test_what_a_look_shows_does_not_depend_on_the_looks_at_others() -> None:
    alone, both = surveyor(p_seen=1.0), surveyor(p_seen=1.0)
    both.sense(pose(*DECOY.position_m, 1.0), site(3, TARGET, DECOY), 0.0)
    here = pose(*TARGET.position_m, 1.0)
    first = [one for one in alone.sense(here, site(3, TARGET, DECOY), 90.0) if one.found]
    assert first == [one for one in both.sense(here, site(3, TARGET, DECOY), 90.0) if one.found]


def test_each_look_of_a_finder_is_right_as_often_as_it_says_whatever_the_one_before_was() -> None:
    both = {(first, second): 0 for first in (True, False) for second in (True, False)}
    for seed in range(400):
        module = made(FinderSettings(name="camera", capability="OpticalImaging", range_m=8.0, sigma_m=0.5, p_right=0.8))
        assert module.sense(pose(50.0, 59.0), site(seed), 0.0) == []  # 9 m away
        (first,) = module.sense(pose(50.0, 55.0), site(seed), 1.0)
        assert module.sense(pose(50.0, 55.0), site(seed), 5.0) == []
        (again,) = module.sense(pose(50.0, 55.0), site(seed), 12.0)
        assert {look.facts[1][1] for look in (first, again)} == {"looksLike"}
        assert {look.facts[1][3] for look in (first, again)} == {0.8}
        both[first.facts[1][2] == "target", again.facts[1][2] == "target"] += 1
    right, wrong = both[True, True] + both[True, False], both[False, True] + both[False, False]
    assert right / 400 == pytest.approx(0.8, abs=0.06)  # three standard errors of 0.02
    assert both[True, True] / right == pytest.approx(0.8, abs=0.07)
    assert both[False, True] / wrong == pytest.approx(0.8, abs=0.14)


@pytest.mark.parametrize("off_m", [0.0, 0.5, 1.0, 2.0])
def test_an_attempt_succeeds_the_less_the_farther_off_it_is(off_m: float) -> None:
    n = 0
    for seed in range(400):
        module = effector()
        ticks = [module.sense(pose(50.0 + off_m, 50.0), site(seed), float(s)) for s in range(11)]
        (outcome,) = ticks[-1]
        assert not any(ticks[:-1])
        assert outcome.row[:3] == ("arm", "handle", "target")
        assert outcome.row[3] == pytest.approx(off_m)
        n += outcome.row[4]
        assert bool(outcome.facts) == outcome.row[4]
    share = math.exp(-(off_m**2))  # tolerance 1 m
    assert n / 400 == pytest.approx(share, abs=3.0 * math.sqrt(share * (1.0 - share) / 400) + 1e-9)


def test_an_attempt_takes_a_vehicle_that_stays_at_rest_with_the_module_on() -> None:
    module = effector()
    for s in range(8):
        assert module.sense(pose(50.0, 50.0), site(), float(s)) == []
    assert module.sense(pose(50.0, 50.0, 0.5), site(), 8.0) == []  # it moved: begin anew
    assert not any(module.sense(pose(50.0, 50.0), site(), float(s)) for s in range(9, 19))
    assert module.sense(pose(50.0, 50.0), site(), 19.0)
    assert module.sense(pose(50.0, 50.0), site(), 40.0) == []  # it was off meanwhile
    assert not effector().sense(pose(57.0, 50.0), site(), 100.0)  # out of reach


def test_what_holds_says_so_of_the_candidate_with_the_place_in_the_vehicles_own_frame() -> None:
    module = effector("hold", tolerance_m=50.0)
    ticks = [module.sense(pose(50.0, 50.0, 0.0, (3.0, -2.0)), site(), float(s)) for s in range(11)]
    ((place, held),) = [one.facts for one in ticks[-1]]
    assert place[1:] == ("location", (53.0, 48.0), 0.5)
    assert held[1:] == ("heldBy", AUV.name)


def test_a_fix_takes_the_transponder_for_a_while() -> None:
    module = made(FixerSettings(name="ranging", capability="TransponderRanging", stay_s=5.0))
    assert not any(module.sense(pose(40.0, 0.0), site(), float(s)) for s in range(10))  # 40 m away, range 30 m
    ticks = [module.sense(pose(10.0, 0.0), site(), float(s)) for s in range(20, 40)]
    assert [one[0].facts[0][1:] for one in ticks if one] == [("fixedOn", True)]
    assert ticks.index(next(one for one in ticks if one)) == 5


def test_modules_tell_their_state_unless_they_have_no_self_test() -> None:
    assert ModuleSettings(name="console", capability="OperatorSelection").tells_state
    assert not ModuleSettings(name="console", capability="OperatorSelection", self_test=False).tells_state
    assert made(ModuleSettings(name="console", capability="OperatorSelection")).sense(pose(0.0, 0.0), site(), 0.0) == []
    assert (CHARTED.name, ATTEMPTS.name) == ("charted", "attempts")
