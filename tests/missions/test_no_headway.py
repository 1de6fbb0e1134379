"""A vehicle that makes no headway gives up and withdraws; others do the rest, and the run ends."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from watched import JETTY_M, TEAM, seen

from missions.meeting import Meeting
from missions.meeting.truth import JOBS, JobTruth
from missions.runs.run import Run, run
from missions.scenarios import load
from remoras.recorder import Recorder

SLOWED = "fault=[{vehicle='AUV01', kind='slow', factor=0.3, at_s=300.0}]"


def flown(name: str, seed: int, *keys: str) -> Run:
    return run(load(name, [("--set", key) for key in keys]), seed)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_slowed_vehicle_that_is_swept_off_is_succeeded_though_others_receive_it(seed: int) -> None:
    """0.3 of 1 m/s against 0.4 m/s. Before, its two parts stayed open and all waited for it until 14,400 s."""
    finished = flown("pandora-inspection", seed, "current={east_mps=0.4}", SLOWED)
    assert finished.completed, finished.reason
    cannot = [(row[1], row[3].partition(":")[0]) for row in finished.recorder.faults if row[2] == "cannot"]
    assert [who for who, _ in cannot] == ["AUV01", "AUV01"]  # its job, then its way
    assert "AUV01" not in {row[1] for row in finished.recorder.rows("serviced") if row[0] > 700.0}


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.slow), 2])
@pytest.mark.parametrize("east_mps", [0.35, pytest.param(0.5, marks=pytest.mark.slow)])
def test_a_vehicle_holds_its_place_at_an_object_in_a_current_faster_than_it_creeps(seed: int, east_mps: float) -> None:
    """It creeps at 0.3 m/s over ground; as fast through the water it was carried off, and nothing was recovered."""
    finished = flown("trident-intervention", seed, f"current={{east_mps={east_mps}}}")
    assert finished.completed, finished.reason


def test_the_wait_of_a_head_goes_on_while_others_push_it_out_of_the_radius() -> None:
    """Two have no room within 3 m of the rally point: each is out for every other minute."""
    meeting = Meeting({"Team": TEAM}, {"jetty": JETTY_M}, 3.0, 20.0, 60.0, 900.0, {})
    truth, (x_m, y_m) = JobTruth(meeting, "Surveying", Recorder([JOBS])), JETTY_M

    def observed(minute: int, has_met: bool) -> bool:
        off_m = (1.0, 6.0) if minute % 2 else (6.0, 1.0)
        vehicles = [seen(name, position_m=(x_m + m, y_m), met=has_met) for name, m in zip("AB", off_m, strict=True)]
        return truth.observe(SimpleNamespace(vehicles=tuple(vehicles)), 60.0 * minute)

    assert not any(observed(minute, False) for minute in range(1, 17))
    assert observed(17, True)
    assert [one.name for one in truth.milestones][-1] == "mission_complete"
