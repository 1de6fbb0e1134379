"""The sea in missions: off by default, as keys and axes of studies, and what is refused."""

from pathlib import Path

import pytest
from small_mission import SMALL, line_of

from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.runs.summary import summary
from missions.scenarios import load


def finished(*settings: str, seed: int = 1) -> Run:
    return run_scenario(load("mapping-rendezvous", [("--set", one) for one in settings]), seed)


def faults_of(folder: Path, sea: str) -> tuple[ConfigurationFault, ...]:
    (folder / "pond.toml").write_text(sea + "\n" + SMALL, encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        load(str(folder / "pond.toml"))
    return caught.value.faults


# Current ------------------------------------------------------------------------------------------


def test_a_current_as_fast_as_a_vehicle_is_refused_with_line_and_what_is_allowed(tmp_path: Path) -> None:
    """Both go at 1.5 m/s. At the 5 m of Diver a current that ends at 20 m has three quarters of its speed."""
    sea = "[current]\neast_mps = 0.5\nnorth_mps = -1.5\n"
    [fault] = faults_of(tmp_path, sea)
    assert (fault.key, fault.given, fault.line) == ("current.north_mps", "-1.5", line_of(sea, "north_mps"))
    assert "1.58 m/s at the 0 m of Boat" in fault.allowed
    assert fault.allowed.endswith("allowed: less than 1.5 m/s, its survey_speed_mps")
    [fault] = faults_of(tmp_path, "[uncertainty]\nspeed_spread = 0.1\n[current]\neast_mps = 1.4\n")
    assert fault.allowed.endswith("less than 1.35 m/s, its survey_speed_mps less the uncertainty.speed_spread of 0.1")


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("east_mps = 9.0", "less than or equal to 5"),
        ("shear_depth_m = 0.0", "greater than 0"),
        ("tide_period_h = -1.0", "greater than 0"),
        ("tide_phase = 1.5", "less than or equal to 1"),
        ("west_mps = 1.0", "did you mean 'east_mps'"),
        ('north_mps = "strong"', "number"),
    ],
)
def test_currents_that_are_none_are_refused(tmp_path: Path, given: str, says: str) -> None:
    faults = faults_of(tmp_path, f"[current]\n{given}\n")
    assert any(says in fault.allowed for fault in faults)
    assert all(fault.line == 2 for fault in faults)


def test_water_that_stands_changes_nothing() -> None:
    short = "scenario.duration_s=300"
    plain = finished(short)
    still = finished(short, "current.east_mps=0.0", "current.tide_period_h=12.42", "current.shear_depth_m=50.0")
    assert still.recorder.trajectories == plain.recorder.trajectories
    assert finished(short, "current.east_mps=0.1").recorder.trajectories != plain.recorder.trajectories


def test_the_mission_completes_in_a_current_and_takes_longer() -> None:
    """0.5 m/s to the north; rows of the survey lie east and west, so that each takes longer on the whole."""
    against = finished("current.north_mps=0.5")
    found = summary(against)
    assert found["completed"]
    assert found["conflicts"] == 0
    done_s = {m.vehicle: m.time_s for m in against.milestones if m.name == "mapping_done"}
    usual_s = {m.vehicle: m.time_s for m in finished().milestones if m.name == "mapping_done"}
    assert all(done_s[name] > usual_s[name] for name in done_s)
