"""Faults, upsets and tools on a small structure: effect of each level of adaptation, and figures."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import pytest
from matplotlib.figure import Figure as Sheet
from plain_style import PlainStyle
from recorded import faults, point, said
from servicing import fault, flown, found, little, raw, written

from missions.errors import ConfigurationError
from missions.figure import Mark
from missions.pandora import PandoraMission
from missions.pandora.assessment import ActionMonitor
from missions.pandora.structure import PlannedPart, job_of
from missions.pandora.truth import FIGURES, n_false_alarms, n_false_claims, n_lost, n_missed, n_repairs
from missions.runs.results import MemoryResults, summary
from missions.runs.run import Run, run
from missions.scenarios import load

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
def test_run_without_faults_completes_at_every_level_of_adaptation(tmp_path: Path, adaptation: str) -> None:
    done = flown(tmp_path, adaptation)
    assert done.completed, done.reason
    assert (found(done), n_false_claims(done), n_repairs(done)) == ([], 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("upset", "finding", "by_tactics"),
    [(MOVED, "missing", False), (NEAR, "displaced", True), (STUCK, "resists", False), (TURNED, "turned", True)],
)
def test_misplaced_or_changed_valve_is_detected_and_repaired(
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


def test_repair_keeps_completed_tasks(tmp_path: Path) -> None:
    """The valve is found before it resists: it is not searched again, and only its branch is replanned."""
    done = flown(tmp_path, **STUCK)
    plans = [row for row in done.recorder.plans if row[5] == job_of("valve A1")]
    tasks = [(row[8].split("(")[0], row[10]) for row in plans]
    assert tasks.count(("Looking", "running")) == 1
    assert ("Turning", "failed") in tasks
    assert ("Wrenching", "done") in tasks
    assert ("Looking", "dropped") not in tasks


def test_drifting_camera_is_corrected_by_panels(tmp_path: Path) -> None:
    """Seen 1.8 m off, valves are out of reach until the offset is learnt."""
    done = flown(tmp_path, "tactical", **DRIFTS)
    assert done.completed, done.reason
    assert ("AUV00", "camera drifts") in found(done)
    learnt = [value for *_, value in said(done, "cameraOffset")]
    assert point(learnt[-1]) == pytest.approx((1.5, 1.0), abs=0.4)


def test_drifting_camera_fails_without_learning_its_offset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ActionMonitor, "corrected", lambda self, facts, seen_m: seen_m)
    assert not flown(tmp_path, "tactical", **DRIFTS).completed


def test_weak_thruster_is_learnt_and_compensated(tmp_path: Path) -> None:
    """At 0.3 of its speed 0.35 m/s are 0.1 m/s, and the current runs at 0.16 m/s: that takes asking for more."""
    weak = {"fault": [{**fault("slow", factor=0.3), "vehicle": one} for one in ("AUV00", "AUV01")]}
    blind, tactical = (flown(tmp_path, level, **weak) for level in ("none", "tactical"))
    assert n_false_claims(blind) > 0
    assert tactical.completed, tactical.reason
    assert {("AUV00", "thruster"), ("AUV01", "thruster")} == set(found(tactical))
    learnt = {row[1]: float(row[6]) for row in tactical.recorder.items if row[5] == "thrustShare"}
    assert learnt == {"AUV00": pytest.approx(0.3, abs=0.05), "AUV01": pytest.approx(0.3, abs=0.05)}


def test_rising_current_is_detected_and_compensated(tmp_path: Path) -> None:
    rises = {"surge": [{"between_s": [30.0, 30.0], "lasts_s": 6000.0, "east_mps": 0.3, "north_mps": -0.2}]}
    blind, tactical = (flown(tmp_path, level, **rises) for level in ("none", "tactical"))
    assert n_false_claims(blind) > 0
    assert tactical.completed, tactical.reason
    assert {finding for _, finding in found(tactical)} == {"current"}
    assert point(said(tactical, "flow")[-1][-1]) == pytest.approx((0.3, -0.2), abs=0.05)


def test_vehicle_that_drains_returns_before_it_is_empty(tmp_path: Path) -> None:
    drains = {"fault": [fault("drains", drain_w=250.0)]}
    scenario = {"vehicle": [{**one, "energy_j": 120_000.0} for one in raw()["vehicle"]], **drains}
    blind, tactical = (flown(tmp_path, level, **scenario) for level in ("none", "tactical"))
    assert ("AUV01", "energy") in found(tactical)
    assert (n_lost(blind), n_lost(tactical)) == (1, 0)


BOTH_STUCK = {"upset": [{"kind": "stuck", "part": "valve A1"}, {"kind": "stuck", "part": "valve A3"}]}


def vehicles(**tools: tuple[int, ...]) -> list[dict[str, Any]]:
    """The tables of three vehicles, of which each tool is on those of these numbers alone."""
    tables = raw()["vehicle"]
    third = {**tables[1], "name": "AUV02", "slot": 2, "start_m": [10.0, -10.0], "depth_m": 40.0}
    for number, table in enumerate(tables := [*tables, third]):
        table["sensor"] = [one for one in table["sensor"] if number in tools.get(one["type"], (0, 1, 2))]
    return tables


def test_tool_on_one_vehicle_suffices(tmp_path: Path) -> None:
    done = flown(tmp_path, vehicle=vehicles(camera=(2,)), seed=13, **BOTH_STUCK)
    assert done.completed, done.reason


def test_arm_and_wrench_on_different_vehicles_are_used_in_turn(tmp_path: Path) -> None:
    """The vehicle with the arm finds the valve stuck; the one with the wrench, which could not have begun, turns it."""
    done = flown(tmp_path, vehicle=vehicles(arm=(1,), wrench=(2,)), **BOTH_STUCK)
    assert done.completed, done.reason
    turned = {row[2]: row[1] for row in done.recorder.rows("serviced")}
    assert (turned["valve A1"], turned["valve A2"]) == ("AUV02", "AUV01")
    assert ("AUV01", f"{job_of('valve A1')}: valve A1 resists, it takes a wrench") in faults(done, "cannot")


def test_impossible_parts_are_named_with_reason_and_all_return(tmp_path: Path) -> None:
    done = flown(tmp_path, vehicle=vehicles(wrench=()), **BOTH_STUCK)
    assert not done.completed
    assert done.recorder.trajectories[-1][0] <= 1800.0
    reasons = {f"{job_of(part)}: {part} resists, it takes a wrench" for part in ("valve A1", "valve A3")}
    assert {what for _, what in faults(done, "impossible")} == reasons
    assert "service valve A1 declared impossible at" in done.reason
    last = {row[1]: row[2:4] for row in done.recorder.rows("trajectories")[-3:]}
    radius_m, dock_m = done.scenario.mission.arrival_radius_m, done.scenario.rally_point[0].position_m
    assert all(abs(x - dock_m[0]) + abs(y - dock_m[1]) <= 2.0 * radius_m for x, y in last.values())
    serviced = {row[2] for row in done.recorder.rows("serviced")}
    assert len(serviced) == len(done.mission.jobs) - 2  # all else is done


@pytest.mark.parametrize(("tool", "vehicle", "at_s"), [("arm", "AUV01", 0.0), ("wrench", "AUV00", 300.0)])
def test_dead_tool_is_detected_by_missing_response(tmp_path: Path, tool: str, vehicle: str, at_s: float) -> None:
    """At 300 s the arm has felt that the valve resists, and the wrench has turned a quarter: both counted."""
    died = {**fault("sensor", sensor=tool), "vehicle": vehicle, "at_s": at_s}
    done = flown(tmp_path, vehicle=vehicles(wrench=(0, 1)), fault=[died], **BOTH_STUCK)
    assert [row[1:] for row in said(done, "toolDead")] == [(vehicle, vehicle, tool)]
    assert done.completed, done.reason


@pytest.mark.parametrize(("tool", "part"), [("arm", "valve A1"), ("camera", "panel A")])
def test_missing_tool_that_the_plan_needs_is_refused_in_one_line(tmp_path: Path, tool: str, part: str) -> None:
    """A wrench is not planned for, so want of one is no fault of the scenario."""
    tables = {**raw(), "vehicle": vehicles(**{tool: ()})}
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(tmp_path, tables)))
    (line,) = str(refused.value).splitlines()
    assert f"vehicle.sensor = {tool}: no vehicle has one, and the plan demands it for {part}" in line
    assert little(tmp_path, vehicle=vehicles(wrench=()))


def test_vehicles_work_and_return_with_all_packets_lost(tmp_path: Path) -> None:
    done = flown(tmp_path, channel={"per": 0.999999})
    assert summary(done)["delivery_ratio"] == 0.0
    assert len(done.recorder.rows("serviced")) == 5
    (dock,) = done.scenario.rally_point
    for row in done.recorder.trajectories[-2:]:
        assert abs(row[2] - dock.position_m[0]) <= 25.0
        assert abs(row[3] - dock.position_m[1]) <= 25.0


STYLE = PlainStyle(AUV00="red", AUV01="red")


def test_figures_show_claimed_and_true_services_and_findings(tmp_path: Path) -> None:
    done = flown(tmp_path, "tactical", **STUCK)
    drawn = {one.name: Sheet().subplots() for one in FIGURES if not isinstance(one, Mark)}
    results = MemoryResults(done)
    captions = {one.name: one.draw(drawn[one.name], results, STYLE) for one in FIGURES if not isinstance(one, Mark)}
    claimed, serviced = (line.get_ydata() for line in drawn["serviced"].get_lines())
    assert (max(claimed), max(serviced)) == (5, 4)
    assert [label.get_text() for label in drawn["findings"].get_yticklabels()] == ["stuck: valve A1", "resists"]
    assert captions["structure"] == "Parts that were not serviced: 1."


@pytest.mark.slow
def test_part_outside_the_focus_area_is_not_found(tmp_path: Path) -> None:
    """It directs the camera: with a too small one no vehicle finds the part; all report this and return."""
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


@pytest.mark.slow
def test_without_inference_the_plan_is_not_repaired(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The definitions of HiddenPart and StuckValve lead from recorded facts to the alternative."""
    shipped, abilities = PandoraMission.vocabulary
    text = shipped.read_text(encoding="utf-8")
    for word in ("missing", "resists"):
        before, _, after = text.partition(f'owl:hasValue "{word}" ] ) ] .')
        text = before[: before.rindex(";\n    owl:equivalentClass")] + "." + after
    words = tmp_path / "words.ttl"
    words.write_text(text, encoding="utf-8")
    monkeypatch.setattr(WithoutInference, "vocabulary", (words, abilities))
    scenario = little(tmp_path, "all", **STUCK)
    about = scenario.scenario.model_copy(update={"mission": f"{__name__}:WithoutInference"})
    done = run(scenario.model_copy(update={"scenario": about}), 1)
    assert n_repairs(done) == 0
    assert "valve A1" not in serviced(done)
    assert n_missed(done) == 0


@pytest.mark.slow
def test_valve_is_not_handed_over_without_its_reported_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Control: parts keep their planned needs, whatever is reported."""
    monkeypatch.setattr(PlannedPart, "left", lambda self, facts: self)
    done = flown(tmp_path, vehicle=vehicles(arm=(1,), wrench=(2,)), **BOTH_STUCK)
    assert not done.completed


def test_assignment_is_recorded_once_per_time() -> None:
    """At 1927.7 s the head's plan and the negotiation both assigned the job of valve B2 to AUV01, in two items."""
    finished = run(load("pandora-inspection", [("--set", "strategy.name=remoras-planned")]), 1)
    told = Counter(row[1:7] for row in finished.recorder.items if row[5] in ("playsRole", "leftRole"))
    assert told
    assert max(told.values()) == 1
