"""Tools that only some vehicles have, or that die: work goes to who has them, and what nobody can do is said."""

import random
from pathlib import Path
from typing import Any

import pytest
from servicing import fault, flown, little, raw, written

from missions.errors import ConfigurationError
from missions.meeting.truth import MeetingTruth
from missions.pandora.structure import PlannedPart, job_of
from missions.runs.run import Run
from missions.scenarios import load
from remoras.work import Work

STUCK = {"upset": [{"kind": "stuck", "part": "valve A1"}, {"kind": "stuck", "part": "valve A3"}]}
HOME_S = 1800.0


def vehicles(**tools: tuple[int, ...]) -> list[dict[str, Any]]:
    """The tables of three vehicles, of which each tool is on those of these numbers alone."""
    tables = raw()["vehicle"]
    third = {**tables[1], "name": "AUV02", "slot": 2, "start_m": [10.0, -10.0], "depth_m": 40.0}
    for number, table in enumerate(tables := [*tables, third]):
        table["sensor"] = [one for one in table["sensor"] if number in tools.get(one["type"], (0, 1, 2))]
    return tables


def ended_s(done: Run) -> float:
    return float(done.recorder.rows("trajectories")[-1][0])


def cannot(done: Run, kind: str = "cannot") -> list[tuple[str, str]]:
    """Vehicle, and what it said."""
    return [(row[1], row[3]) for row in done.recorder.rows("faults") if row[2] == kind]


@pytest.mark.parametrize("tool", ["wrench", "arm", "camera"])
@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_tool_on_any_one_vehicle_does_for_all(tmp_path: Path, tool: str, number: int) -> None:
    done = flown(tmp_path, vehicle=vehicles(**{tool: (number,)}), seed=11 + number, **STUCK)
    assert done.completed, done.reason


def test_arm_and_wrench_on_different_vehicles_do_it_one_after_the_other(tmp_path: Path) -> None:
    """Who has the arm finds out that a valve is stuck; who has the wrench turns it, and could not have begun it."""
    done = flown(tmp_path, vehicle=vehicles(arm=(1,), wrench=(2,)), **STUCK)
    assert done.completed, done.reason
    turned = {row[2]: row[1] for row in done.recorder.rows("serviced")}
    assert (turned["valve A1"], turned["valve A2"]) == ("AUV02", "AUV01")
    assert ("AUV01", f"{job_of('valve A1')}: valve A1 resists, it takes a wrench") in cannot(done)


def test_what_nobody_can_do_is_said_with_its_reason_and_everybody_comes_home(tmp_path: Path) -> None:
    done = flown(tmp_path, vehicle=vehicles(wrench=()), **STUCK)
    assert not done.completed
    assert ended_s(done) <= HOME_S
    reasons = {f"{job_of(part)}: {part} resists, it takes a wrench" for part in ("valve A1", "valve A3")}
    assert {what for _, what in cannot(done, "impossible")} == reasons
    assert "service valve A1 impossible, as vehicles say since" in done.reason
    last = {row[1]: row[2:4] for row in done.recorder.rows("trajectories")[-3:]}
    radius_m, dock_m = done.scenario.mission.arrival_radius_m, done.scenario.rally_point[0].position_m
    assert all(abs(x - dock_m[0]) + abs(y - dock_m[1]) <= 2.0 * radius_m for x, y in last.values())
    serviced = {row[2] for row in done.recorder.rows("serviced")}
    assert len(serviced) == len(done.mission.jobs) - 2  # all else is done


def met_s(tmp_path: Path) -> float:
    """When the head first took the crew for gathered, where nobody but the vehicles ends the run; none has a wrench."""
    of = {"scenario": {**raw()["scenario"], "duration_s": 2400.0}, "vehicle": vehicles(wrench=())}
    done = flown(tmp_path, **of, **STUCK)
    return min(row[3] for row in done.recorder.items if row[5] == "gatheredAt")


def test_who_does_not_see_what_is_impossible_waits_for_it_to_the_deadline(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All come home in any case, for those who are not able leave the work; but the meeting waits for it to be done."""
    monkeypatch.setattr(MeetingTruth, "_is_hopeless", lambda self, fleet, alive: False)
    said_s = met_s(tmp_path)
    monkeypatch.setattr(Work, "impossible", frozenset())
    assert met_s(tmp_path) - said_s > 0.9 * raw()["mission"].get("meeting_deadline_s", 900.0)


def test_without_knowing_what_a_valve_takes_nobody_hands_it_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The cause taken out: a part takes what was planned, whatever was found out."""
    monkeypatch.setattr(PlannedPart, "left", lambda self, facts: self)
    done = flown(tmp_path, vehicle=vehicles(arm=(1,), wrench=(2,)), **STUCK)
    assert not done.completed


@pytest.mark.parametrize("draw", range(6))
def test_a_tool_that_dies_at_a_drawn_time_costs_no_part(tmp_path: Path, draw: int) -> None:
    rng = random.Random(draw)
    tool, number, at_s = rng.choice(["arm", "wrench", "camera"]), rng.randrange(3), rng.uniform(0.0, 1200.0)
    died = {**fault("sensor", sensor=tool), "vehicle": f"AUV0{number}", "at_s": at_s}
    done = flown(tmp_path, vehicle=vehicles(), seed=100 + draw, fault=[died], **STUCK)
    assert done.completed, (tool, number, at_s, done.reason)


def test_a_dead_arm_is_noticed_by_what_it_does_not_feel(tmp_path: Path) -> None:
    done = flown(tmp_path, vehicle=vehicles(), fault=[{**fault("sensor", sensor="arm"), "at_s": 0.0}])
    told = [(row[1], row[4], row[6]) for row in done.recorder.items if row[5] == "toolDead"]
    assert told == [("AUV01", "AUV01", "arm")]
    assert done.completed, done.reason


@pytest.mark.parametrize("at_s", [200.0, 300.0])
def test_a_wrench_that_dies_at_work_is_noticed_though_something_was_felt_before(tmp_path: Path, at_s: float) -> None:
    """At 200 s the arm has felt that the valve resists, at 300 s the wrench has turned a quarter: both counted."""
    died = {**fault("sensor", sensor="wrench"), "vehicle": "AUV00", "at_s": at_s}
    done = flown(tmp_path, vehicle=vehicles(wrench=(0, 1)), fault=[died], **STUCK)
    told = [(row[1], row[4], row[6]) for row in done.recorder.items if row[5] == "toolDead"]
    assert told == [("AUV00", "AUV00", "wrench")]
    assert done.completed, done.reason


@pytest.mark.parametrize("upset", [{}, STUCK], ids=["nothing", "stuck"])
def test_one_vehicle_does_it_alone(tmp_path: Path, upset: dict[str, Any]) -> None:
    assert flown(tmp_path, vehicle=vehicles()[:1], **upset).completed


@pytest.mark.parametrize(("tool", "part"), [("arm", "valve A1"), ("camera", "panel A")])
def test_a_tool_that_the_plan_demands_and_nobody_has_is_refused_in_one_line(
    tmp_path: Path, tool: str, part: str
) -> None:
    """A wrench is not planned for, so want of one is no fault of the scenario."""
    tables = {**raw(), "vehicle": vehicles(**{tool: ()})}
    with pytest.raises(ConfigurationError) as refused:
        load(str(written(tmp_path, tables)))
    (line,) = str(refused.value).splitlines()
    assert f"vehicle.sensor = {tool}: no vehicle has one, and the plan demands it for {part}" in line
    assert little(tmp_path, vehicle=vehicles(wrench=()))
