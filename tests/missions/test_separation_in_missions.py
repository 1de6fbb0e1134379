"""Separation in missions: starts, conflicts in summary, table and warning, shipped missions."""

import math
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
from recorded import flown
from small_mission import SMALL, faults_of, line_of

from missions.runs.results import summary
from missions.runs.run import Run
from missions.scenarios import load
from remoras.functional import guidance


def conflicts_of(run: Run) -> list[tuple[Any, ...]]:
    return [row for row in run.recorder.faults if row[2] == "conflict"]


# Starts -------------------------------------------------------------------------------------------


def test_start_too_close_moves_to_the_nearest_free_position() -> None:
    """Three at one point, as from a ship: the second and third move 10 m aside, which keeps the separation."""
    names = ("AUV00", "AUV01", "AUV02")
    scenario = load("mapping-rendezvous", [("--set", f"vehicle.{name}.start_m=[400, 400]") for name in names])
    starts_m = [vehicle.start_m for vehicle in scenario.vehicle if vehicle.name in names]
    assert starts_m[0] == (400.0, 400.0)
    assert [max(abs(x - 400.0), abs(y - 400.0)) for x, y in starts_m[1:]] == [10.0, 10.0]
    assert min(math.dist(one, other) for one, other in combinations(starts_m, 2)) >= scenario.guidance.separation_m


def test_overlapping_starts_without_room_are_refused(tmp_path: Path) -> None:
    """The rest of the scenario does not fit this world either, which is also reported."""
    near = SMALL.replace("start_m = [10.0, 0.0]", "start_m = [4.5, 0.0]").replace("depth_m = 5.0", "depth_m = 2.0")
    found = faults_of(tmp_path, near, "world.x_m=[-1, 6]", "world.y_m=[-1, 6]")
    [fault] = [one for one in found if one.key == "vehicle.Diver.start_m"]
    assert (fault.key, fault.given) == ("vehicle.Diver.start_m", "[4.5, 0.0]")
    assert fault.line == line_of(SMALL, "start_m", 2)
    assert fault.allowed.startswith(
        "4.5 m from the start of Boat, in the same depth layer, and no place is free; allowed: guidance.separation"
    )
    assert "= 5 m or more, or a depth_m that differs by more than 3 m" in fault.allowed


# Conflicts ----------------------------------------------------------------------------------------


IN_THE_WAY = (
    'fault=[{kind="slow",vehicle="AUV01",at_s=0.0,factor=0.01}]',
    "vehicle.AUV01.start_m=[60.0,60.0]",
    "scenario.duration_s=90",
)
"""AUV01 hardly moves, on the way of AUV00 from (0, 0) to (112.5, 112.5)."""


@pytest.mark.parametrize("is_kept", [True, False])
def test_conflicts_are_counted_and_written(is_kept: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the separation rule vehicles come too near; summary and table agree on it."""
    if not is_kept:
        monkeypatch.setattr(guidance, "clear_velocity", lambda *_: None)
    run = flown("mapping-rendezvous", *IN_THE_WAY)
    found = summary(run)
    rows = conflicts_of(run)
    assert found["conflicts"] == len({(row[1], row[3]) for row in rows}) == (0 if is_kept else 1)
    assert (found["closest_approach_m"] >= 5.0) is is_kept
    if rows:
        time_s, one, _, other = rows[0]
        at_m = [row[2:4] for row in run.recorder.trajectories if row[0] == time_s and row[1] in (one, other)]
        assert math.dist(*at_m) < 5.0
