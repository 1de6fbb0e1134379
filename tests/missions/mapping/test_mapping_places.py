"""Stated uncertainties of object positions are correct for any navigation error."""

import math
from typing import Any

import numpy as np
import pytest

import remoras
from missions.mapping.metrics import REGION
from missions.mapping.sensors import Classifier, ClassifierSettings, ObjectTable, Seabed
from remoras.sensor import Pose
from worldmodel import Block, Estimate, Observation, PropertyValue, core_ontology_paths, fused, read_tbox

LOCATION = read_tbox(*core_ontology_paths()).attribute_named("location")
WRECK_M = 10.0, 0.0


def looked(seed: int, errors_m: list[tuple[float, float]], sigmas_m: list[float]) -> list[tuple[Any, ...]]:
    """Facts of looks at a wreck, a minute apart, by a vehicle with these position errors and known deviations."""
    sensor = Classifier(ClassifierSettings(), 1)
    lies = ObjectTable(name="it", position_m=WRECK_M, classification="wreck")
    world = Seabed(25.0, {}, objects=(lies,), seed=seed)
    found = []
    for look, (error_m, sigma_m) in enumerate(zip(errors_m, sigmas_m, strict=True)):
        pose = Pose(0.0, 0.0, 20.0, 0.0, 1.0, error_m=error_m, sigma_m=sigma_m)
        found += [one.facts[0] for one in sensor.sense(pose, world, 60.0 * look)]
    return found


def place_of(facts: list[tuple[Any, ...]]) -> Estimate:
    told = [
        Observation(Block(1, number, float(number), (PropertyValue(7, LOCATION.uid, *fact[2:]),)), 0)
        for number, fact in enumerate(facts)
    ]
    found = fused(LOCATION, told)
    assert found is not None
    return found


@pytest.mark.parametrize("drifting_m", [0.0, 0.5, 1.5, 4.0])
def test_region_of_95_percent_covers_95_percent_of_objects(drifting_m: float) -> None:
    """Two dives with five looks each, one error of navigation in each; 1000 trials, +- four times 0.7 %."""
    draw, n_in, n = np.random.default_rng(3), 0, 1000
    for seed in range(n):
        dives = [tuple(map(float, drifting_m * draw.normal(size=2))) for _ in range(2)]
        errors_m = [dives[0]] * 5 + [(0.0, 0.0)] + [dives[1]] * 5
        sigmas_m = [drifting_m] * 5 + [0.0] + [drifting_m] * 5
        facts = looked(seed, errors_m, sigmas_m)
        place = place_of([fact for number, fact in enumerate(facts) if number != 5])  # between dives it knew its place
        n_in += math.dist(place.value, WRECK_M) <= REGION * place.uncertainty
    assert 0.95 - 0.028 <= n_in / n <= 0.95 + 0.028


def test_repeated_looks_do_not_reduce_the_shared_error_of_a_dive() -> None:
    """Fused variance: sigma^2 / n plus that of the position, 4 / n + 9; another dive has an independent error."""
    nine = looked(1, [(0.0, 0.0)] * 9, [3.0] * 9)
    assert nine[0][3] == pytest.approx(13.0**0.5)
    for n in (1, 2, 3):
        assert place_of(nine[:n]).uncertainty == pytest.approx((4.0 / n + 9.0) ** 0.5)
    assert all(len(fact) == 3 for fact in nine[7:])  # what adds next to nothing states nothing
    two = looked(1, [(0.0, 0.0)] * 3, [3.0, 1.4, 3.0])
    assert [fact[3] for fact in two[:2]] == pytest.approx([13.0**0.5, (4.0 + 1.96) ** 0.5])
    at_rest = looked(1, [(0.0, 0.0)] * 9, [0.0] * 9)
    assert [fact[3] for fact in at_rest] == [2.0] * 9


def test_summary_has_the_share_of_objects_within_their_regions() -> None:
    run = remoras.run("mapping-objects", per=0.4, seed=2, set={"navigation.drift": 0.02})
    known = run.known("ASV00", run.summary["mission_time_s"])
    lies_m = [one.position_m for one in run.scenario.object]
    is_in = []
    for belief in [one for one in known.beliefs if one.attribute == "location"]:
        place = known.fused(belief.subject, "location")
        is_in.append(min(math.dist(place.value, at_m) for at_m in lies_m) <= REGION * place.uncertainty)
    assert run.summary["within_region_fraction"] == pytest.approx(sum(is_in) / len(is_in))
    assert run.summary["n_doubted"] == len(known.doubted)
    drifting, later = (
        run.known("ASV00", at_s).fused(belief.subject, "location", drift=1.0)
        for at_s in (known.at_s - 300.0, known.at_s)
    )
    assert drifting.time_s == later.time_s
    assert later.uncertainty**2 - drifting.uncertainty**2 == pytest.approx(300.0)  # as sure as at the time asked for
    assert f"{sum(is_in)} of {len(is_in)} objects after the last observation" in run.plot("places").caption
    without = remoras.run("mapping-rendezvous", set={"scenario.duration_s": 60.0})
    assert "within_region_fraction" not in without.summary


@pytest.mark.thorough
@pytest.mark.parametrize("drift", [0.0, 0.01, 0.02, 0.05])
def test_region_covers_the_object_at_each_drift(drift: float) -> None:
    """Of the places of 40 runs; without the error of navigation it was 10 to 44 % of them where there is drift."""
    given = {"navigation.drift": drift}
    runs = [remoras.run("mapping-objects", per=0.4, seed=seed, set=given) for seed in range(1, 41)]
    assert 0.9 <= sum(run.summary["within_region_fraction"] for run in runs) / 40 <= 0.98
