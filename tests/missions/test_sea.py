"""Current, navigation errors and missed detections: off by default, keys and axes of studies, refusals."""

import math
from functools import partial
from pathlib import Path

import pytest
from recorded import flown, point, said
from small_mission import SMALL, faults_of, line_of

from missions.mapping import MappingMission
from missions.runs.results import summary
from missions.runs.run import Run
from missions.scenarios import load

finished = partial(flown, "mapping-rendezvous")


# Current ------------------------------------------------------------------------------------------


def test_current_as_fast_as_a_vehicle_is_refused_with_line_and_limit(tmp_path: Path) -> None:
    """Both go at 1.5 m/s. At the 5 m of Diver a current that ends at 20 m has three quarters of its speed."""
    sea = "[current]\neast_mps = 0.5\nnorth_mps = -1.5\n"
    [fault] = faults_of(tmp_path, sea + SMALL)
    assert (fault.key, fault.given, fault.line) == ("current.north_mps", "-1.5", line_of(sea, "north_mps"))
    assert "1.58 m/s at the 0 m of Boat" in fault.allowed
    assert fault.allowed.endswith("allowed: less than 1.5 m/s, its survey_speed_mps")
    [fault] = faults_of(tmp_path, "[uncertainty]\nspeed_spread = 0.1\n[current]\neast_mps = 1.4\n" + SMALL)
    assert fault.allowed.endswith("less than 1.35 m/s, its survey_speed_mps less the uncertainty.speed_spread of 0.1")


# Navigation ---------------------------------------------------------------------------------------


def errors_m(run: Run, vehicle: str) -> list[tuple[float, float]]:
    """(time, distance between reported and true position of a vehicle), slot by slot."""
    at_m = {row[0]: row[2:4] for row in run.recorder.trajectories if row[1] == vehicle}
    told = [(at_s, point(value)) for at_s, who, _, value in said(run, "position") if who == vehicle]
    return [(at_s, math.dist(at_m[int(at_s)], told_m)) for at_s, told_m in told if int(at_s) in at_m]


RALLY = 'beacon=[{name="buoy",position_m=[450.0,450.0],range_m=150.0}]'


def believed(run: Run) -> set[str]:
    """Cells that some vehicle believes mapped: area and index."""
    return {row[4] + row[6] for row in run.recorder.items if row[5] == "mappedCell"}


def covered(run: Run) -> set[str]:
    """Truly covered cells: area and index."""
    cells = run.mission.world(run.seed).cells
    return {f"{area}{float(index)}" for area, index in (cells[row[2], row[3]] for row in run.recorder.rows("coverage"))}


LONG = ("navigation.drift=0.02", "scenario.duration_s=4000")


@pytest.mark.slow
def test_vehicles_with_drift_get_fixes_before_they_mismap() -> None:
    """2 % of some 2.5 km of survey is 50 m, the swath 25 m: each vehicle goes up, and maps at its depth alone."""
    run = finished(*LONG)
    found = summary(run)
    assert found["completed"]
    assert found["conflicts"] == 0
    assert believed(run) <= covered(run)
    assert found["believed_fraction"] >= found["coverage_fraction"] - 0.05
    assert found["n_fixes"] >= 9
    assert found["fixing_s"] > 90.0 * found["n_fixes"]
    depths_m = {name: {row[7] for row in run.recorder.trajectories if row[1] == name} for name in ("ASV00", "AUV01")}
    assert depths_m["ASV00"] == {0.0}
    assert {0.0, 20.0} <= depths_m["AUV01"]
    mapped = {row[0] for row in run.recorder.rows("coverage") if row[1] == "AUV01"}
    deep = {row[0] for row in run.recorder.trajectories if row[1] == "AUV01" and row[7] == 20.0}
    assert mapped <= deep


def test_vehicles_near_a_beacon_meet_without_surfacing() -> None:
    with_beacon = finished("navigation.drift=0.01", "scenario.duration_s=3000", RALLY)
    late = [error_m for time_s, error_m in errors_m(with_beacon, "AUV01") if time_s > with_beacon.end_s - 60.0]
    assert with_beacon.completed
    assert late
    assert max(late) < 5.0  # a position is told as of the tick before, up to 2.57 m ago
    assert max(error_m for _, error_m in errors_m(with_beacon, "ASV00")) < 5.0  # it is at the surface


def test_rows_overlap_where_cells_leave_no_room_for_error() -> None:
    """Cells of 10 m lie up to 10 m beside rows 25 m apart: of half the swath 2.5 m is left, with closer rows more."""
    mission = load("mapping-rendezvous", [("--set", "world.cell_m=10"), ("--set", "navigation.drift=0.01")])
    exact = load("mapping-rendezvous", [("--set", "world.cell_m=10")])
    surveys = [MappingMission.from_scenario(one).jobs["left"].on.survey(25.0) for one in (mission, exact)]
    assert len(surveys[1].rows) == 10
    assert 10 < len(surveys[0].rows) <= 20
    assert surveys[0].slack_m > surveys[1].slack_m


@pytest.mark.slow
@pytest.mark.parametrize(("strategy", "drift"), [("central", 0.002), ("cbba", 0.05)])
def test_strategies_complete_without_false_beliefs_under_drift(strategy: str, drift: float) -> None:
    """Two corners of the table in docs/howto/uncertainty.md."""
    run = finished(f"navigation.drift={drift}", "current.north_mps=0.4", f"strategy.name={strategy}")
    assert run.completed
    assert believed(run) <= covered(run)
    assert summary(run)["malformed_s"] == 0.0


# Sensors ------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_missed_detections_reduce_coverage() -> None:
    """A square is in sight for some 20 ticks: a miss in three of ten costs nothing, in 98 of 100 two thirds remain."""
    some, most = (
        summary(finished("scenario.duration_s=1900", f"uncertainty.p_miss={p_miss}"))["coverage_fraction"]
        for p_miss in (0.3, 0.98)
    )
    assert most < some - 0.1


# Off by default, and axes of studies --------------------------------------------------------------


def test_sea_settings_without_effect_change_no_rows() -> None:
    short = "scenario.duration_s=300"
    plain, beacons = finished(short), finished(short, "navigation.fix_s=1.0", RALLY)
    for name in plain.recorder.tables:
        assert plain.recorder.rows(name) == beacons.recorder.rows(name)
