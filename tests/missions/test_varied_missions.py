"""Shipped scenario in extreme settings: it completes, or gives its reason."""

import re
from pathlib import Path

import pytest
from small_mission import Raw, named, pond, run_varied

from exchange.channel.modems import modems
from missions.runs.run import Run
from missions.runs.run import run as run_scenario


def is_sound(run: Run) -> None:
    """Assert invariants of every run."""
    assert run.n_false_beliefs == 0
    assert run.completed == (run.reason == "")
    assert [milestone.time_s for milestone in run.milestones] == sorted(m.time_s for m in run.milestones)
    assert [milestone.name for milestone in run.milestones].count("mission_complete") == int(run.completed)
    assert not [row for row in run.recorder.faults if "refused" in row[2] or row[2] == "bad packet"]
    payload_bits = modems()[run.scenario.communication.modem].payload_bits
    assert all(0 < row[3] <= payload_bits for row in run.recorder.packets)


def names_at(run: Run, milestone: str) -> list[str]:
    return [m.vehicle or m.group for m in run.milestones if m.name == milestone]


def coverage(run: Run, n_cells: int) -> float:
    return len({(row[2], row[3]) for row in run.recorder.rows("coverage")}) / n_cells


@pytest.mark.slow
def test_a_mission_without_areas_is_complete_once_all_have_met(tmp_path: Path) -> None:
    def vary(raw: Raw) -> None:
        del raw["area"]
        group = named(raw["group"], "Operational")
        wings = {role["name"] for role in group["role"] if "job" in role}
        group["role"] = [role for role in group["role"] if "job" not in role]
        for vehicle in raw["vehicle"]:
            vehicle["playable_roles"] = [name for name in vehicle["playable_roles"] if name not in wings]

    run = run_varied(tmp_path, vary)
    is_sound(run)
    assert run.completed, run.reason
    assert run.recorder.rows("coverage") == []
    assert names_at(run, "gathered") == ["Operational", "Coordination"]


def test_the_small_scenario_runs(tmp_path: Path):
    """100 m by 50 m at 10 m: 10 by 5 cells, five rows of 90 m and four turns of 10 m. At 1.5 m/s that is 327 s, and
    62 m of way at 2 m/s come first; the consultation takes a frame or two of 2.1 s."""
    run = run_scenario(pond(tmp_path), seed=1)
    is_sound(run)
    assert run.completed, run.reason
    assert coverage(run, 50) == 1.0
    (done_s,) = [m.time_s for m in run.milestones if m.name == "mapping_done"]
    assert 490 / 1.5 + 62 / 2.0 <= done_s <= (490 / 1.5 + 62 / 2.0) * 1.1 + 5.0


# What does not complete says why ------------------------------------------------------------------


def test_fleet_out_of_range_names_the_vehicles_that_lack_assignments(tmp_path: Path):
    def vary(raw: Raw) -> None:
        raw["scenario"]["duration_s"] = 300.0
        raw["communication"]["range_m"] = 50.0
        named(raw["vehicle"], "AUV02")["start_m"] = [700.0, 0.0]

    run = run_varied(tmp_path, vary)
    is_sound(run)
    assert re.match(
        r"time is up: \d+ % of the goal .*; not all assignments to ASV00, AUV02 had taken effect after", run.reason
    )
    assert "under way: AUV00 Mapping" in run.reason
    assert any("AUV02" in row[7] for row in run.recorder.packets)


def test_empty_vehicle_receives_nothing_and_stays_in_place(tmp_path: Path):
    """20 kJ last ASV00 some minutes; it is so near that it gets no call home."""

    def vary(raw: Raw) -> None:
        next(v for v in raw["vehicle"] if v["name"] == "ASV00")["energy_j"] = 2.0e4

    run = run_varied(tmp_path, vary, "scenario.duration_s=1000")
    died_s = next(row[0] for row in run.recorder.faults if row[3] == "battery exhausted")
    later = [row for row in run.recorder.packets if row[1] > died_s]
    assert later
    assert not [row for row in later if "ASV00" in (*row[6], *row[7])]
    track = [row for row in run.recorder.trajectories if row[1] == "ASV00" and row[0] > died_s]
    assert {row[5] for row in track} == {0.0}
    assert {row[6] for row in track} == {2.0e4}
