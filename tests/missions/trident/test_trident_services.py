"""Matching of services, sensing modules, and the site."""

import math
from dataclasses import replace
from typing import Any

import pytest
from intervening import module, tables

from missions.scenarios.fleet import database_of
from missions.trident.behaviours import survey_lanes
from missions.trident.conclusions import WithMembers
from missions.trident.mission import TridentMission
from missions.trident.scenario import TransponderTable, TridentScenario
from missions.trident.services import (
    APART_M,
    CHOOSE,
    FIND,
    FIX,
    HANDLE,
    HOLD,
    RIM_M,
    EffectorSettings,
    FinderSettings,
    FixerSettings,
    Lying,
    Matching,
    ModuleSettings,
    SeabedBlock,
    Site,
    SurveyorSettings,
    lying,
)
from remoras.beliefs import Beliefs
from remoras.organisation import Organisation
from remoras.sensor import Pose
from tests.sample_vehicles import AUV
from worldmodel import Instance, WorldModel, core_ontology_paths, read_tbox

TBOX = read_tbox(*core_ontology_paths(), *TridentMission.vocabulary)
BOTH = frozenset({"ASV00", "IAUV00"})


def scenario(**keys: Any) -> TridentScenario:
    raw = tables()
    raw["mission"] |= keys
    return TridentScenario.model_validate(raw)


class Known:
    """Services of the shipped scenario, and a world model for their facts."""

    def __init__(self, **keys: Any) -> None:
        of = scenario(**keys)
        self.matching = Matching.of(of, database_of(of, TridentMission).values())
        named = [("ASV", "ASV00"), ("AUV", "IAUV00")]
        named += [(one.settings.capability, name) for name, one in self.matching.services.items()]
        instances = [Instance(uid, TBOX.class_named(kind).uid, name) for uid, (kind, name) in enumerate(named)]
        self.beliefs = Beliefs(WorldModel(TBOX, 0, instances, n_origins=2))
        self.facts = WithMembers(self.beliefs, Organisation({}, frozenset()))
        self._now_s = 0.0
        for name, one in self.matching.services.items():
            self.say(name, "providedBy", one.vehicle)
            self.say(name, "serviceStatus", "available")

    def say(self, subject: str, attribute: str, value: Any) -> None:
        self._now_s += 1.0
        self.beliefs.model.record([self.beliefs.fact(subject, attribute, value)], self._now_s, False)

    def ways(self, activity: str, me: str = "IAUV00", there: frozenset[str] = BOTH) -> tuple[str, ...]:
        return self.matching.ways(activity, me, self.facts, there)

    def block(self, name: str, me: str, there: frozenset[str] = BOTH) -> tuple[str, ...]:
        return self.matching.for_block(me, name, self.facts, there)


def test_service_of_a_subclass_matches() -> None:
    """Stereo survey is optical survey is seabed survey; an own service stands before a cheaper one elsewhere."""
    assert Known().block("east", "IAUV00") == ("IAUV00 stereo", "IAUV00 sidescan", "ASV00 multibeam")
    assert Known().block("east", "ASV00") == ("ASV00 multibeam", "IAUV00 stereo", "IAUV00 sidescan")


def test_service_matches_a_defined_class_by_its_facts() -> None:
    """Reacquisition is imaging by a submerged vehicle: it is inferred from the provider, not advertised."""
    known = Known()
    assert known.ways(FIND) == ("IAUV00 camera", "IAUV00 forward sonar")
    known.say("IAUV00 camera", "providedBy", "ASV00")
    assert known.ways(FIND) == ("IAUV00 forward sonar",)


def test_matching_without_inference_is_by_equal_names() -> None:
    known = Known(inference=False)
    assert [known.ways(one) for one in (FIND, FIX, HOLD, HANDLE, CHOOSE)] == [()] * 5
    assert known.block("east", "IAUV00") == ()
    raw = tables()
    raw["mission"]["inference"] = False
    module(raw, "IAUV00 arm")["capability"] = "Manipulation"
    of = TridentScenario.model_validate(raw)
    known.matching = Matching.of(of, database_of(of, TridentMission).values())
    assert known.ways(HANDLE) == ("IAUV00 arm",)
    known.say("IAUV00 arm", "serviceStatus", "failed")
    assert known.ways(HANDLE) == ()


def test_failed_service_is_skipped_and_the_next_one_used() -> None:
    known = Known()
    known.say("IAUV00 arm", "serviceStatus", "failed")
    assert known.ways(HANDLE) == ("IAUV00 gripper",)
    known.say("IAUV00 arm", "serviceStatus", "available")
    assert known.ways(HANDLE) == ("IAUV00 arm", "IAUV00 gripper")
    assert known.ways(CHOOSE)[0] == known.ways(CHOOSE, "ASV00")[0] == "ASV00 console"
    known.say("ASV00 console", "serviceStatus", "failed")
    assert known.ways(CHOOSE) == known.ways(CHOOSE, "ASV00") == ("IAUV00 recogniser",)
    assert known.ways(FIX)[0] == "ASV00 usbl"
    known.say("ASV00 usbl", "serviceStatus", "failed")
    assert known.ways(FIX) == ("IAUV00 ranging",)


@pytest.mark.parametrize(
    ("response", "found"), [("fixed", ("IAUV00 arm",)), ("repair", ("IAUV00 arm", "IAUV00 gripper"))]
)
def test_plan_without_matching_uses_listed_services_whatever_their_status(
    response: str, found: tuple[str, ...]
) -> None:
    known = Known(response=response)
    known.say("IAUV00 arm", "serviceStatus", "failed")
    assert known.ways(HANDLE) == found


BLOCK = SeabedBlock("west", (0.0, 100.0), (0.0, 100.0), 20.0)
TARGET, DECOY = Lying("target", (50.0, 50.0)), Lying("decoy 1", (90.0, 90.0))


def site(seed: int = 1, *objects: Lying) -> Site:
    return Site((BLOCK,), objects or (TARGET,), TransponderTable(position_m=(0.0, 0.0), range_m=30.0), seed)


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


def test_survey_claims_believed_tiles_and_charts_true_ones() -> None:
    found = surveyor().sense(pose(10.0, 10.0, 1.0, (40.0, 0.0)), site(), 0.0)
    assert [one.facts for one in found if one.facts] == [(("west", "chartedTile", 2),)]  # believed at (50, 10)
    assert [one.row for one in found if one.row] == [(0, 0)]


def test_tile_is_charted_once_and_only_below_the_speed_limit() -> None:
    module = surveyor()
    assert module.sense(pose(10.0, 10.0, 1.1), site(), 0.0) == []
    assert len(module.sense(pose(10.0, 10.0, 1.0), site(), 1.0)) == 2  # the claim and the truth
    assert module.sense(pose(10.0, 10.0, 1.0), site(), 2.0) == []


def test_survey_rates_the_target_above_decoys_with_the_stated_error() -> None:
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


def test_looks_of_a_finder_are_independent_at_the_stated_rate() -> None:
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


def test_the_speed_limit_of_a_finder_scales_with_the_true_speed() -> None:
    settings = FinderSettings(name="camera", capability="OpticalImaging", range_m=8.0, sigma_m=0.5, p_right=0.8)
    fast, as_known = settings.make(replace(AUV, speed_factor=1.5)), settings.make(AUV)
    moving = pose(50.0, 55.0)._replace(speed_mps=1.0)  # the limit is 0.8 m/s
    assert fast.sense(moving, site(1), 0.0)
    assert not as_known.sense(moving, site(1), 0.0)


@pytest.mark.parametrize("off_m", [0.0, 0.5, 1.0, 2.0])
def test_success_of_an_attempt_falls_with_distance(off_m: float) -> None:
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


def test_attempt_needs_a_vehicle_at_rest_with_the_module_on() -> None:
    module = effector()
    for s in range(8):
        assert module.sense(pose(50.0, 50.0), site(), float(s)) == []
    assert module.sense(pose(50.0, 50.0, 0.5), site(), 8.0) == []  # it moved: begin anew
    assert not any(module.sense(pose(50.0, 50.0), site(), float(s)) for s in range(9, 19))
    assert module.sense(pose(50.0, 50.0), site(), 19.0)
    assert module.sense(pose(50.0, 50.0), site(), 40.0) == []  # it was off meanwhile
    assert not effector().sense(pose(57.0, 50.0), site(), 100.0)  # out of reach


def test_fix_occupies_the_transponder_for_its_duration() -> None:
    module = made(FixerSettings(name="ranging", capability="TransponderRanging", stay_s=5.0))
    assert not any(module.sense(pose(40.0, 0.0), site(), float(s)) for s in range(10))  # 40 m away, range 30 m
    ticks = [module.sense(pose(10.0, 0.0), site(), float(s)) for s in range(20, 40)]
    assert [one[0].facts[0][1:] for one in ticks if one] == [("fixedOn", True)]
    assert ticks.index(next(one for one in ticks if one)) == 5


WEST = SeabedBlock("west", (0.0, 100.0), (100.0, 200.0), 20.0)
EAST = SeabedBlock("east", (150.0, 250.0), (100.0, 200.0), 20.0)


def test_block_has_the_tiles_whose_centre_is_inside() -> None:
    assert len(WEST.tiles) == 5 * 5
    assert all(0.0 < (c + 0.5) * 20.0 < 100.0 and 100.0 < (r + 0.5) * 20.0 < 200.0 for c, r in WEST.tiles)
    assert SeabedBlock("off", (5.0, 45.0), (5.0, 25.0), 20.0).tiles == (
        (0, 0),
        (1, 0),
    )  # centres at 10 and 30, and at 10
    assert WEST.centre_of(0) == (10.0, 110.0)


def test_tiles_in_reach_are_those_with_the_centre_within_range() -> None:
    site = Site((WEST, EAST))
    assert site.below((10.0, 110.0), 19.9) == [(0, 5)]  # the next centres are 20 m away, rows begin at 100 m
    assert sorted(site.below((10.0, 110.0), 20.0)) == [(0, 5), (0, 6), (1, 5)]
    assert site.below((125.0, 150.0), 20.0) == []  # between the blocks


@pytest.mark.parametrize("reach_m", [8.0, 14.0, 20.0, 60.0])
@pytest.mark.parametrize(
    "block", [WEST, SeabedBlock("tall", (0.0, 40.0), (0.0, 120.0), 20.0)], ids=lambda one: one.name
)
def test_lanes_pass_every_tile_in_reach(block: SeabedBlock, reach_m: float) -> None:
    found = list(survey_lanes(block, reach_m))
    assert frozenset().union(*(lane.tiles for lane in found)) == frozenset(range(len(block.tiles)))
    for lane in found:
        (x_m, y_m), (to_x_m, _) = lane.begin_m, lane.end_m
        for number in lane.tiles:
            at_m = block.centre_of(number)
            across_m = abs(at_m[1] - y_m) if to_x_m != x_m else abs(at_m[0] - x_m)
            assert across_m <= reach_m + 1e-9


def test_objects_lie_inside_blocks_and_apart() -> None:
    for seed in range(50):
        found = lying((WEST, EAST), None, 2, seed)
        assert [one.name for one in found] == ["target", "decoy 1", "decoy 2"]
        for one in found:
            assert any(
                block.x_m[0] + RIM_M <= one.position_m[0] <= block.x_m[1] - RIM_M
                and block.y_m[0] + RIM_M <= one.position_m[1] <= block.y_m[1] - RIM_M
                for block in (WEST, EAST)
            )
        gaps = [math.dist(a.position_m, b.position_m) for a in found for b in found if a is not b]
        assert min(gaps) >= APART_M
    assert lying((WEST,), (33.0, 144.0), 1, 3)[0] == Lying("target", (33.0, 144.0))  # its place may be given
