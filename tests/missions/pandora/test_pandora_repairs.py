"""Each fault kind on a little structure: what the levels make of it, and that it is for the reason claimed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import pytest
from servicing import fault, flown, found, little, raw

from missions.pandora import PandoraMission
from missions.pandora.assessment import ActionMonitor
from missions.pandora.metrics import n_false_alarms, n_false_claims, n_lost, n_missed, n_repairs
from missions.pandora.structure import job_of
from missions.runs.run import Run, run
from remoras.current import Surge

MOVED = {"upset": [{"kind": "moved", "part": "valve A1", "distance_m": 12.0}]}
NEAR = {"upset": [{"kind": "moved", "part": "valve A1", "distance_m": 2.0}]}
STUCK = {"upset": [{"kind": "stuck", "part": "valve A1"}]}
TURNED = {"upset": [{"kind": "turned", "part": "valve A1"}]}
DRIFTS = {"fault": [{**fault("biased", sensor="camera", attribute="seenAt", offset=[1.5, 1.0]), "vehicle": "AUV00"}]}


def serviced(done: Run) -> set[str]:
    return {row[2] for row in done.recorder.rows("serviced")}


def failed(done: Run) -> set[str]:
    return {row[4] for row in done.recorder.items if row[5:7] == ("outcome", "failed")}


@pytest.mark.parametrize("adaptation", ["none", "tactical", "all"])
def test_where_nothing_befalls_every_level_does_all(tmp_path: Path, adaptation: str) -> None:
    done = flown(tmp_path, adaptation)
    assert done.completed, done.reason
    assert (found(done), n_false_claims(done), n_repairs(done)) == ([], 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("upset", "finding", "by_tactics"),
    [(MOVED, "missing", False), (NEAR, "displaced", True), (STUCK, "resists", False), (TURNED, "turned", True)],
)
def test_a_valve_is_not_where_or_as_it_should_be(
    tmp_path: Path, upset: Mapping[str, Any], finding: str, by_tactics: bool
) -> None:
    """Without assessment it is falsely taken for done; assessment finds it, and repair brings it to its end."""
    blind, tactical, repaired = (flown(tmp_path, level, **upset) for level in ("none", "tactical", "all"))
    assert (n_false_claims(blind), n_missed(blind)) == (1, 1)
    assert ("valve A1", finding) in found(tactical)
    assert n_missed(tactical) == n_false_claims(tactical) == n_false_alarms(tactical) == 0
    assert tactical.completed is by_tactics
    assert failed(tactical) == (set() if by_tactics else {"valve A1"})
    assert repaired.completed, repaired.reason
    assert n_repairs(repaired) == (0 if by_tactics else 1)


def test_without_a_focus_area_nobody_looks_there(tmp_path: Path) -> None:
    """It directs the camera: with one that is too little, no vehicle finds the part, and all say so and come home."""
    small = flown(tmp_path, mission={"adaptation": "all", "focus_radius_m": 4.0}, **MOVED)
    assert failed(small) == {"valve A1"}
    assert not small.completed
    areas = {row[1]: row[6] for row in small.recorder.items if row[5] == "focusArea"}
    assert sorted(areas) == ["AUV00", "AUV01"]
    facts = {(row[4], row[5], row[6]) for row in small.recorder.items}
    assert {(area, "radius", "4.0") for area in areas.values()} <= facts
    assert {(name, "unableTo", job_of("valve A1")) for name in areas} <= facts
    assert "impossible" in small.reason


class WithoutInference(PandoraMission):
    """Knows all words, and draws no conclusion from them."""

    vocabulary: ClassVar[tuple[Path, ...]] = ()


@pytest.mark.parametrize("upset", [MOVED, STUCK], ids=["moved", "stuck"])
def test_without_inference_the_plan_is_not_repaired(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, upset: Mapping[str, Any]
) -> None:
    """The definitions of HiddenPart and StuckValve are what leads from what was asserted to the other way."""
    shipped, abilities = PandoraMission.vocabulary
    text = shipped.read_text(encoding="utf-8")
    for word in ("missing", "resists"):
        before, _, after = text.partition(f'owl:hasValue "{word}" ] ) ] .')
        text = before[: before.rindex(";\n    owl:equivalentClass")] + "." + after
    words = tmp_path / "words.ttl"
    words.write_text(text, encoding="utf-8")
    monkeypatch.setattr(WithoutInference, "vocabulary", (words, abilities))
    scenario = little(tmp_path, "all", **upset)
    about = scenario.scenario.model_copy(update={"mission": f"{__name__}:WithoutInference"})
    done = run(scenario.model_copy(update={"scenario": about}), 1)
    assert n_repairs(done) == 0
    assert "valve A1" not in serviced(done)
    assert n_missed(done) == 0


def test_what_is_done_is_kept_by_a_repair(tmp_path: Path) -> None:
    """The valve was found before it resisted: nobody looks for it again, and nothing outside the branch is planned."""
    done = flown(tmp_path, **STUCK)
    plans = [row for row in done.recorder.plans if row[5] == job_of("valve A1")]
    tasks = [(row[8].split("(")[0], row[10]) for row in plans]
    assert tasks.count(("Looking", "running")) == 1
    assert ("Turning", "failed") in tasks
    assert ("Wrenching", "done") in tasks
    assert ("Looking", "dropped") not in tasks


@pytest.mark.parametrize("adaptation", ["none", "tactical"])
def test_a_camera_that_drifts_is_corrected_by_panels(tmp_path: Path, adaptation: str) -> None:
    """Seen 1.8 m off, valves are out of reach until the offset is learnt; without looking nobody is led astray."""
    done = flown(tmp_path, adaptation, **DRIFTS)
    assert done.completed, done.reason
    if adaptation == "tactical":
        assert ("AUV00", "camera drifts") in found(done)
        learnt = [row[6] for row in done.recorder.items if row[5] == "cameraOffset"]
        east_m, north_m = map(float, learnt[-1].removeprefix("POINT (").removesuffix(")").split())
        assert (east_m, north_m) == pytest.approx((1.5, 1.0), abs=0.4)


def test_without_learning_the_offset_a_drifting_camera_leads_astray(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ActionMonitor, "corrected", lambda self, facts, seen_m: seen_m)
    assert not flown(tmp_path, "tactical", **DRIFTS).completed


def test_a_dead_camera_is_found_and_others_take_over(tmp_path: Path) -> None:
    died = {"fault": [fault("sensor", sensor="camera")]}
    blind, aware = (flown(tmp_path, level, **died) for level in ("none", "all"))
    assert ("AUV01", "camera dead") in found(aware)
    assert n_false_claims(aware) == 0
    assert aware.completed, aware.reason
    assert n_missed(blind) == 1


def test_a_weak_thruster_is_learnt_and_asked_for_more(tmp_path: Path) -> None:
    """At 0.3 of its speed 0.35 m/s are 0.1 m/s, and the current runs at 0.16 m/s: that takes asking for more."""
    weak = {"fault": [{**fault("slow", factor=0.3), "vehicle": one} for one in ("AUV00", "AUV01")]}
    blind, tactical = (flown(tmp_path, level, **weak) for level in ("none", "tactical"))
    assert n_false_claims(blind) > 0
    assert tactical.completed, tactical.reason
    assert {("AUV00", "thruster"), ("AUV01", "thruster")} == set(found(tactical))
    learnt = {row[1]: float(row[6]) for row in tactical.recorder.items if row[5] == "thrustShare"}
    assert learnt == {"AUV00": pytest.approx(0.3, abs=0.05), "AUV01": pytest.approx(0.3, abs=0.05)}


def test_a_current_that_rises_is_held_against(tmp_path: Path) -> None:
    rises = {"surge": [{"between_s": [30.0, 30.0], "lasts_s": 6000.0, "east_mps": 0.3, "north_mps": -0.2}]}
    blind, tactical = (flown(tmp_path, level, **rises) for level in ("none", "tactical"))
    assert n_false_claims(blind) > 0
    assert tactical.completed, tactical.reason
    assert {finding for _, finding in found(tactical)} == {"current"}
    flows = [row[6] for row in tactical.recorder.items if row[5] == "flow"]
    east_mps, north_mps = map(float, flows[-1].removeprefix("POINT (").removesuffix(")").split())
    assert (east_mps, north_mps) == pytest.approx((0.3, -0.2), abs=0.05)


def test_a_vehicle_that_loses_energy_is_not_lost(tmp_path: Path) -> None:
    drains = {"fault": [fault("drains", drain_w=250.0)]}
    scenario = {"vehicle": [{**one, "energy_j": 120_000.0} for one in raw()["vehicle"]], **drains}
    blind, tactical = (flown(tmp_path, level, **scenario) for level in ("none", "tactical"))
    assert ("AUV01", "energy") in found(tactical)
    assert (n_lost(blind), n_lost(tactical)) == (1, 0)


def test_surges_come_when_the_seed_says(tmp_path: Path) -> None:
    table = {"between_s": [100.0, 900.0], "lasts_s": 60.0, "east_mps": 0.1}
    current = little(tmp_path, surge=[table, table]).current
    drawn = [current.water(seed) for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1] != drawn[2]
    assert drawn[0] is not None
    first, second = drawn[0].surges
    assert isinstance(first, Surge)
    assert first.from_s != second.from_s
    calm, rough = drawn[0].at(20.0, first.from_s - 1.0), drawn[0].at(20.0, first.from_s)
    assert rough[0] == pytest.approx(calm[0] + 0.1)
    assert drawn[0].at(20.0, first.until_s)[0] <= calm[0] + 0.1
