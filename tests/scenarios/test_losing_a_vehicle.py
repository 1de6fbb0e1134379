"""A vehicle that runs low on energy goes home, leaves its roles, and its area passes on."""

import math

import pytest
from sampling import sampled

from missions.runs.run import Run, run
from missions.runs.summary import summary
from missions.scenarios import load
from remoras.work import Work


def with_a_weak_auv01() -> Run:
    """150 kJ of the usual 5 MJ last AUV01 for half of an area: it is given one, for others go on with it."""
    return run(load("mapping-rendezvous", [("--set", "vehicle.AUV01.energy_j=150000")]))


@pytest.mark.slow
def test_its_area_is_allocated_anew_and_the_others_meet_without_it() -> None:
    finished = with_a_weak_auv01()
    roles = finished.recorder.roles
    left_s = min(row[0] for row in roles if row[1] == "AUV01" and row[4] == "left")
    taken_over = [row for row in roles if row[3] == "LeftWinger" and row[4] == "assigned" and row[1] != "AUV01"]
    assert taken_over
    assert left_s < taken_over[0][0] < left_s + 60.0
    assert finished.completed


def test_it_comes_home_before_its_battery_is_empty() -> None:
    finished = with_a_weak_auv01()
    track = [row for row in finished.recorder.trajectories if row[1] == "AUV01"]
    home = [row for row in track if math.dist(row[2:4], track[0][2:4]) <= 1.0 and row[0] > 100.0]
    assert home
    assert home[0][6] < 150_000.0


def test_with_energy_enough_nobody_leaves() -> None:
    finished = run(load("mapping-rendezvous", [("--set", "scenario.duration_s=600")]))
    assert [row for row in finished.recorder.roles if row[4] == "left"] == []


def test_a_fleet_without_energy_does_not_count_as_fast() -> None:
    """The run ends when nobody is alive; its mission would never have ended."""
    weak = [("--set", f"vehicle.{name}.energy_j=5000") for name in ("ASV00", "AUV00", "AUV01", "AUV02")]
    finished = run(load("mapping-rendezvous", weak))
    assert not finished.completed
    assert "out of action" in finished.reason
    assert finished.recorder.trajectories[-1][0] < 1000.0
    assert summary(finished)["mission_time_s"] == finished.scenario.scenario.duration_s


def test_a_head_that_joins_late_gives_way_to_its_successor() -> None:
    """It gives out jobs before it hears of its successor: these are taken back, or both would wait for good."""
    late = 'fault=[{kind="joins", vehicle="AUV00", at_s=900.0}]'
    settings = [("--set", one) for one in ("strategy.name=central", "channel.per=0.4", late)]
    finished = run(load("mapping-patches", settings), 3)
    assert finished.completed
    assert finished.end_s < 3000.0


def head_lost(at_s: float) -> float:
    """When a mission is complete whose head is lost after all but a few cells are mapped (s)."""
    fault = f'fault=[{{kind="lost", vehicle="AUV00", at_s={at_s}}}]'
    finished = run(load("mapping-rendezvous", [("--set", fault), ("--set", "channel.per=0.2")]))
    assert finished.completed
    return finished.end_s


@pytest.mark.parametrize("at_s", sampled((1800.0, 1860.0, 1920.0, 1980.0, 2040.0), 1920.0))
def test_what_the_goal_spares_is_not_given_to_others_once_its_vehicle_is_lost(at_s: float) -> None:
    """The successor waits for nothing that nobody needs: it meets the others, and both the surface vehicle."""
    assert head_lost(at_s) <= 2350.0


@pytest.mark.slow
def test_where_it_is_given_out_head_and_member_wait_for_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load-bearing: the member comes to the meeting, to which it is called, and the head waits for its work."""
    monkeypatch.setattr(Work, "open", property(lambda work: work.unfinished))
    assert head_lost(1920.0) > 2900.0
