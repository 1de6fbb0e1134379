"""Vehicles in one layer get past each other: nobody comes nearer than 5 m, all arrive, and the way is hardly longer."""

import math

import pytest
from crossings import KINDS, Crossing, crossing, travel, traveller
from sampling import sampled

from remoras.functional import guidance
from remoras.motion import Motion

LONGEST = 1.15
"""Most that the way and the time may be of those straight ahead."""
SEEDS = range(10)


def assert_kept(found: Crossing, n_vehicles: int) -> None:
    assert found.n_conflicts == 0
    assert found.closest_m >= 5.0
    assert found.n_arrived == n_vehicles
    assert found.longest_way <= LONGEST
    assert found.longest_time <= LONGEST


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_vehicles", [8, 16])
def test_they_keep_clear_and_arrive(kind: str, n_vehicles: int) -> None:
    assert_kept(travel(crossing(kind, n_vehicles, 1)), n_vehicles)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n_vehicles", [8, 16, 32])
@pytest.mark.parametrize("seeds", sampled([SEEDS[:3], SEEDS[3:]], SEEDS[:3]), ids=str)
def test_they_keep_clear_and_arrive_in_ten_seeds(kind: str, n_vehicles: int, seeds: range) -> None:
    for seed in seeds:
        assert_kept(travel(crossing(kind, n_vehicles, seed)), n_vehicles)


@pytest.mark.parametrize("kind", KINDS)
def test_without_the_rule_they_come_too_near(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """So it is the rule that keeps them apart."""
    monkeypatch.setattr(guidance, "clear_velocity", lambda *_: None)
    found = travel(crossing(kind, 16, 1))
    assert found.n_conflicts > 0
    assert found.closest_m < 5.0


def test_without_the_turn_to_the_right_a_symmetric_encounter_takes_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight on a circle at the same speed, each exactly opposite to another."""
    times = []
    for right_rad in (0.3, 0.0):
        monkeypatch.setattr("remoras.avoidance.RIGHT_RAD", right_rad)
        turns = [math.tau * number / 8 for number in range(8)]
        ways = [(300.0 * math.cos(turn), 300.0 * math.sin(turn)) for turn in turns]
        found = travel([traveller(number, way, (-way[0], -way[1])) for number, way in enumerate(ways)])
        assert found.closest_m >= 5.0
        times.append(found.longest_time if found.n_arrived == 8 else math.inf)
    assert times[0] <= LONGEST < times[1]


def test_two_that_want_to_change_sides_do_not_go_on_side_by_side() -> None:
    """8 m apart on parallel courses whose goals are crosswise: one lets the other go ahead."""
    fleet = [traveller(0, (0.0, 4.0), (600.0, -60.0)), traveller(1, (0.0, -4.0), (600.0, 60.0))]
    found = travel(fleet)
    assert_kept(found, 2)


def test_one_that_cannot_get_out_of_the_way_is_passed() -> None:
    """It hardly moves, as a vehicle with a fault does; so the other has to do both halves."""
    fleet = [traveller(0, (-200.0, 0.0), (200.0, 0.0)), traveller(1, (0.0, 0.0), (0.0, 0.0))]
    fleet[1].functional.impair(0.001, frozenset())
    assert_kept(travel(fleet), 2)


def test_tracks_are_the_same_bytes_where_nobody_comes_near(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two lanes 61 m apart, farther than the sonar reaches, and two vehicles that cross in layers 4 m apart."""

    def tracks() -> list[Motion]:
        fleet = [
            traveller(0, (-300.0, 0.0), (300.0, 0.0)),
            traveller(1, (300.0, 61.0), (-300.0, 61.0)),
            traveller(2, (0.0, -300.0), (0.0, 300.0), depth_m=24.0),
        ]
        travel(fleet)
        return [one.functional.motion for one in fleet]

    with_rule = tracks()
    monkeypatch.setattr(guidance, "clear_velocity", lambda *_: None)
    assert tracks() == with_rule
