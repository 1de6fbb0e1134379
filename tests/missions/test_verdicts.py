"""The goal is all of the declared work, for any survivors and under every strategy."""

from __future__ import annotations

from typing import Any

import pytest
from recorded import flown, with_energy

from missions.runs.results import summary
from missions.runs.run import Run
from remoras.strategies import strategies

GROUND = "mapping-patches"
AUVS = ("AUV00", "AUV01", "AUV02")
SOME = ("remoras", "fixed-partition", "cbba")
"""Strategies that speak of their jobs, say nothing, and bid."""


def made(scenario: str, *settings: str, seed: int = 1) -> tuple[Run, dict[str, Any]]:
    finished = flown(scenario, *settings, seed=seed)
    return finished, summary(finished)


def lost(at_s: float, *names: str) -> str:
    faults = ", ".join(f"{{vehicle='{name}', kind='lost', at_s={at_s}}}" for name in names)
    return f"fault=[{faults}]"


def assert_failed_for_want_of_vehicles(finished: Run, found: dict[str, Any]) -> None:
    scenario: Any = finished.scenario
    assert not found["completed"]
    assert found["goal_fraction"] == pytest.approx(found["coverage_fraction"] / scenario.mission.goal, abs=1e-6)
    assert found["reachable_fraction"] == found["goal_fraction"]
    assert found["mission_time_s"] == scenario.scenario.duration_s
    open_percent = 100.0 * (1.0 - found["coverage_fraction"])
    assert found["reason"].startswith(f"no vehicle left that is able to map: {open_percent:.0f} % open")


@pytest.mark.parametrize("strategy", strategies())
def test_with_empty_batteries_nothing_is_reached(strategy: str) -> None:
    finished, found = made(GROUND, f"strategy.name={strategy}", *with_energy(GROUND, 1.0))
    assert_failed_for_want_of_vehicles(finished, found)
    assert found["goal_fraction"] == 0.0
    assert finished.recorder.trajectories[-1][0] < 10.0
    assert {row[-1] for row in finished.recorder.trajectories[-4:]} == {0.0}  # without power all float up


@pytest.mark.parametrize("strategy", SOME)
def test_with_all_mappers_lost_the_rest_is_open_and_the_run_ends(strategy: str) -> None:
    """The surface vehicle is at the rally point, or goes there, and no other will come."""
    finished, found = made("mapping-rendezvous", f"strategy.name={strategy}", lost(200.0, *AUVS))
    assert_failed_for_want_of_vehicles(finished, found)
    assert 0.0 < found["goal_fraction"] < 0.2
    assert finished.recorder.trajectories[-1][0] < 1000.0


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["remoras", "cbba"])
def test_too_little_energy_reaches_a_share_of_the_whole_goal(strategy: str) -> None:
    """100 kJ last for a third of the work: all return, or run empty, and the run ends."""
    finished, found = made(GROUND, f"strategy.name={strategy}", *with_energy(GROUND, 100e3))
    assert_failed_for_want_of_vehicles(finished, found)
    assert found["goal_fraction"] > 0.05
    assert finished.recorder.trajectories[-1][0] < 3000.0


# Less is never more -------------------------------------------------------------------------------


MORE_LOST = [[lost(600.0, *AUVS[3 - n :])] for n in (0, 1, 3)]


@pytest.mark.slow
def test_fewer_vehicles_never_reach_more() -> None:
    summaries = [made("mapping-rendezvous", "channel.per=0.3", *settings)[1] for settings in MORE_LOST]
    found = [(one["goal_fraction"], one["completed"]) for one in summaries]
    assert found == sorted(found, reverse=True), found
    assert (found[0][1], found[-1][1]) == (True, False)


# Other missions ----------------------------------------------------------------------------------


@pytest.mark.parametrize("scenario", ["pandora-inspection", "trident-intervention", "arrows-archaeology"])
def test_no_mission_is_complete_without_energy(scenario: str) -> None:
    finished, found = made(scenario, *with_energy(scenario, 1.0))
    assert (found["completed"], found["goal_fraction"], found["reachable_fraction"]) == (False, 0.0, 0.0)
    assert found["reason"].startswith("no vehicle left that is able to ")
    assert ": 100 % open" in found["reason"]
    assert finished.recorder.trajectories[-1][0] < 60.0
