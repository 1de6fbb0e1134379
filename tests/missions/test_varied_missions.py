"""The shipped scenario with other fleets, areas, seas and modems: it completes, or says why not."""

import math
from collections.abc import Callable
from itertools import cycle
from pathlib import Path

import pytest
from small_mission import Raw, named, pond, run_varied

from exchange.channel.modems import modems
from exchange.policy.policies import POLICIES
from missions.runs.run import Run
from missions.runs.run import run as run_scenario


def is_sound(run: Run) -> None:
    """What holds for every run, whatever became of it."""
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


# Fleets -------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("n_auvs", [1, 2, 7])
def test_two_to_eight_vehicles_complete(tmp_path: Path, n_auvs: int):

    def vary(raw: Raw) -> None:
        raw["vehicle"][n_auvs + 1 :] = []
        if n_auvs == 1:
            raw["vehicle"][1]["playable_roles"].append("Performer")

    more = ("fleet.size=8", "fleet.copies_of=AUV02") if n_auvs == 7 else ()
    run = run_varied(tmp_path, vary, *more)
    is_sound(run)
    assert run.completed, run.reason
    assert names_at(run, "gathered")[-1] == "Coordination"
    if n_auvs >= 4:  # three of them have an area each, and the fourth has none to wait for
        assert len(names_at(run, "mapping_done")) == 3
        assert coverage(run, 300) == 1.0


# Areas --------------------------------------------------------------------------------------------


def with_areas(corners: list[list[list[float]]]) -> Callable[[Raw], None]:
    """As many areas, each with a role of its own that every AUV can play."""

    def vary(raw: Raw) -> None:
        raw["area"] = [{"name": f"area {number}", "corners_m": each} for number, each in enumerate(corners)]
        wings = [{"name": f"Wing{number}", "maximum": 1, "job": f"area {number}"} for number in range(len(corners))]
        group = named(raw["group"], "Operational")
        group["role"] = [role for role in group["role"] if "job" not in role] + wings
        for vehicle in raw["vehicle"][1:]:
            kept = [role for role in vehicle["playable_roles"] if role not in ("LeftWinger", "Midfield", "RightWinger")]
            vehicle["playable_roles"] = kept + [wing["name"] for wing in wings]
        if not corners:
            del raw["area"]

    return vary


def square(x_m: float, y_m: float, side_m: float) -> list[list[float]]:
    return [[x_m, y_m], [x_m + side_m, y_m], [x_m + side_m, y_m + side_m], [x_m, y_m + side_m]]


def ring(n_corners: int, x_m: float, y_m: float, radius_m: float) -> list[list[float]]:
    angles = [2.0 * math.pi * corner / n_corners for corner in range(n_corners)]
    return [[x_m + radius_m * math.cos(angle), y_m + radius_m * math.sin(angle)] for angle in angles]


SHAPES = {
    "none": [],
    "clockwise": [square(100, 100, 100)[::-1]],
    "hexagons": [ring(6, 225, 225, 100), ring(6, 475, 225, 100), ring(6, 225, 475, 100)],
    "as many as a fleet cannot share": [square(100 + 100 * (n % 4), 100 + 100 * (n // 4), 100) for n in range(10)],
    "around the origin": [square(-90, -90, 150)],
}


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_areas_of_any_shape_and_number(tmp_path: Path, shape: str):
    run = run_varied(tmp_path, with_areas(SHAPES[shape]))
    is_sound(run)
    assert run.completed, run.reason
    if not SHAPES[shape]:
        assert run.recorder.rows("coverage") == []
        assert names_at(run, "gathered") == ["Operational", "Coordination"]


# Seas and modems ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("modem", "policy"), tuple(zip(sorted(modems()), cycle(sorted(POLICIES)))))
def test_every_modem_and_every_policy_carries_the_mission_without_carrier_evidence(
    tmp_path: Path, modem: str, policy: str
):
    settings = (
        f"communication.modem={modem}",
        f"communication.policy={policy}",
        "communication.carrier_evidence=false",
    )
    run = run_varied(tmp_path, id, "channel.per=0.2", *settings, seed=7)
    is_sound(run)
    assert run.completed, run.reason


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


def test_a_fleet_out_of_earshot_says_that_consultation_never_ended(tmp_path: Path):
    def vary(raw: Raw) -> None:
        raw["scenario"]["duration_s"] = 300.0
        raw["communication"]["range_m"] = 50.0
        named(raw["vehicle"], "AUV02")["start_m"] = [700.0, 0.0]

    run = run_varied(tmp_path, vary)
    is_sound(run)
    assert run.reason.startswith("consultation had not ended after 300 s; under way: AUV00 Mapping")
    assert any("AUV02" in row[7] for row in run.recorder.packets)


def test_the_dead_hear_nothing_and_lie_still(tmp_path: Path):
    """20 kJ last ASV00 some minutes, and it is not told to go home for so short a way."""

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
