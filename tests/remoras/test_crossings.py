"""Vehicles that cross in one layer stay 5 m apart, all arrive, and detours are short."""

import pytest
from crossings import KINDS, Crossing, crossing, travel, traveller

from remoras.condition import Condition

LONGEST = 1.15
"""Most that the way and the time may be of those straight ahead."""


def assert_kept(found: Crossing, n_vehicles: int) -> None:
    assert found.n_conflicts == 0
    assert found.closest_m >= 5.0
    assert found.n_arrived == n_vehicles
    assert found.longest_way <= LONGEST
    assert found.longest_time <= LONGEST


@pytest.mark.parametrize("kind", KINDS)
def test_crossing_vehicles_keep_apart_and_arrive(kind: str) -> None:
    assert_kept(travel(crossing(kind, 16, 1)), 16)


def test_a_vehicle_that_cannot_yield_is_passed() -> None:
    """It hardly moves, as a vehicle with a fault does; so the other has to do both halves."""
    fleet = [traveller(0, (-200.0, 0.0), (200.0, 0.0)), traveller(1, (0.0, 0.0), (0.0, 0.0))]
    fleet[1].functional.impair(Condition(speed_factor=0.001))
    assert_kept(travel(fleet), 2)
