"""Separation in missions: starts, conflicts in summary, table and warning, and 16 vehicles in one depth layer."""

import math
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
from cli.invoked import remoras
from small_mission import SMALL, line_of

from missions.errors import ConfigurationError, ConfigurationFault
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.runs.summary import summary
from missions.scenarios import load
from remoras.functional import guidance

ONE_LAYER = ("fleet.layers=false", "fleet.size=16")


def finished(name: str, *settings: str, seed: int = 1) -> Run:
    return run_scenario(load(name, [("--set", one) for one in settings]), seed)


def conflicts_of(run: Run) -> list[tuple[Any, ...]]:
    return [row for row in run.recorder.faults if row[2] == "conflict"]


# Starts -------------------------------------------------------------------------------------------


def start_faults(folder: Path, *settings: str, depth_m: float = 2.0) -> tuple[ConfigurationFault, ...]:
    """Diver starts 4.5 m from Boat."""
    text = SMALL.replace("start_m = [10.0, 0.0]", "start_m = [4.5, 0.0]").replace(
        "depth_m = 5.0", f"depth_m = {depth_m}"
    )
    (folder / "pond.toml").write_text(text, encoding="utf-8")
    try:
        load(str(folder / "pond.toml"), [("--set", one) for one in settings])
    except ConfigurationError as error:
        return error.faults
    return ()


def test_who_would_start_too_near_starts_at_the_nearest_free_place() -> None:
    """Three at one point, as from a ship: the second and third 10 m aside, so nobody is nearer than the separation."""
    names = ("AUV00", "AUV01", "AUV02")
    scenario = load("mapping-rendezvous", [("--set", f"vehicle.{name}.start_m=[400, 400]") for name in names])
    starts_m = [vehicle.start_m for vehicle in scenario.vehicle if vehicle.name in names]
    assert starts_m[0] == (400.0, 400.0)
    assert [max(abs(x - 400.0), abs(y - 400.0)) for x, y in starts_m[1:]] == [10.0, 10.0]
    assert min(math.dist(one, other) for one, other in combinations(starts_m, 2)) >= scenario.guidance.separation_m


def test_starts_that_overlap_are_refused_where_there_is_no_room(tmp_path: Path) -> None:
    """The rest of the scenario does not fit this world either, and is said beside it."""
    found = start_faults(tmp_path, "world.x_m=[-1, 6]", "world.y_m=[-1, 6]")
    [fault] = [one for one in found if one.key == "vehicle.Diver.start_m"]
    assert (fault.key, fault.given) == ("vehicle.Diver.start_m", "[4.5, 0.0]")
    assert fault.line == line_of(SMALL, "start_m", 2)
    assert fault.allowed.startswith(
        "4.5 m from the start of Boat, in the same depth layer, and no place is free; allowed: guidance.separation"
    )
    assert "= 5 m or more, or a depth_m that differs by more than 3 m" in fault.allowed


def test_starts_as_far_apart_as_vehicles_have_to_be_are_allowed(tmp_path: Path) -> None:
    assert start_faults(tmp_path, "guidance.separation_m=4.5") == ()
    assert start_faults(tmp_path, depth_m=3.5) == ()


@pytest.mark.parametrize("given", ["0.5", "25", '"far"', "nan"])
def test_a_separation_that_nobody_can_keep_is_refused(tmp_path: Path, given: str) -> None:
    [fault] = [one for one in start_faults(tmp_path, f"guidance.separation_m={given}") if "guidance" in one.key]
    assert fault.key == "--set (guidance.separation_m)"


# Conflicts ----------------------------------------------------------------------------------------


IN_THE_WAY = (
    'fault=[{kind="slow",vehicle="AUV01",at_s=0.0,factor=0.01}]',
    "vehicle.AUV01.start_m=[60.0,60.0]",
    "scenario.duration_s=90",
)
"""AUV01 hardly moves, on the way of AUV00 from (0, 0) to (112.5, 112.5)."""


@pytest.mark.parametrize("is_kept", [True, False])
def test_conflicts_are_counted_written_and_warned_about(is_kept: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the rule they come too near; summary, table and warning then say the same."""
    if not is_kept:
        monkeypatch.setattr(guidance, "clear_velocity", lambda *_: None)
    run = finished("mapping-rendezvous", *IN_THE_WAY)
    found = summary(run)
    rows = conflicts_of(run)
    assert found["conflicts"] == len({(row[1], row[3]) for row in rows}) == (0 if is_kept else 1)
    assert (found["closest_approach_m"] >= 5.0) is is_kept
    if rows:
        time_s, one, _, other = rows[0]
        at_m = [row[2:4] for row in run.recorder.trajectories if row[0] == time_s and row[1] in (one, other)]
        assert math.dist(*at_m) < 5.0
    said = remoras("run", "mapping-rendezvous", *[part for one in IN_THE_WAY for part in ("--set", one)]).stderr
    warned = "remoras: 1 pair of vehicles came nearer than guidance.separation_m = 5 m, down to"
    assert (warned in said) is not is_kept


# Missions in one layer ----------------------------------------------------------------------------


def assert_all_keep_clear(run: Run) -> None:
    found = summary(run)
    assert found["completed"], found["reason"]
    assert (found["conflicts"], conflicts_of(run)) == (0, [])
    assert found["closest_approach_m"] >= 5.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mapping-rendezvous", "mapping-patches", "mapping-corridor"])
def test_the_shipped_missions_keep_clear(name: str) -> None:
    assert_all_keep_clear(finished(name, "channel.per=0.4", seed=7))


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("name", ["mapping-rendezvous", "mapping-patches", "mapping-corridor"])
def test_a_mission_with_16_in_one_layer_keeps_clear_and_completes(name: str) -> None:
    """All meet within 20 m of one point. It takes at most 1.5 times as long as in layers, where they pass freely.

    In one of nine runs it took 1.46 times as long: those who had met stood in the way of the one who had to go on.
    """
    for seed in (1, 2, 3):
        crowded = finished(name, *ONE_LAYER, "channel.per=0.2", seed=seed)
        assert_all_keep_clear(crowded)
        layered = finished(name, "fleet.size=16", "channel.per=0.2", seed=seed)
        assert crowded.end_s <= 1.5 * layered.end_s


@pytest.mark.slow
def test_without_the_rule_16_in_one_layer_come_too_near(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guidance, "clear_velocity", lambda *_: None)
    assert len(conflicts_of(finished("mapping-patches", *ONE_LAYER, "channel.per=0.2"))) > 10


def test_in_layers_of_their_own_nobody_is_asked_to_keep_clear(monkeypatch: pytest.MonkeyPatch) -> None:
    """So where no two come near in one layer, tracks are what guidance makes of them, byte for byte."""

    def asked(*_: object) -> None:
        raise AssertionError("asked to keep clear")

    settings = ("vehicle.AUV01.depth_m=40.0", "vehicle.AUV02.depth_m=60.0", "scenario.duration_s=400")
    usual = finished("mapping-rendezvous", *settings)
    monkeypatch.setattr(guidance, "clear_velocity", asked)
    assert finished("mapping-rendezvous", *settings).recorder.trajectories == usual.recorder.trajectories
    with pytest.raises(AssertionError, match="asked"):
        finished("mapping-rendezvous", "scenario.duration_s=400")
