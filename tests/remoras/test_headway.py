"""Loss of headway: a vehicle that long comes no nearer its target, unless it dwells, waits or moves on."""

import math

import pytest

from remoras.behaviours import Reference
from remoras.functional.guidance import NO_WAY_S, Headway
from remoras.motion import Motion

TARGET = Reference((1000.0, 0.0), 1.0)
STAY = Reference((1000.0, 0.0), 0.0)


def missing_s(gains_mps: float, reference: Reference | None = TARGET, from_m: float = 500.0) -> float:
    """When headway is first missing of a vehicle that comes nearer to x = 1000 m by so much; infinite if never."""
    headway = Headway()
    for now_s in range(0, 1000, 2):
        if headway.is_missing(reference, Motion(from_m + gains_mps * now_s, 0.0), float(now_s)):
            assert headway.is_lost
            return float(now_s)
    return math.inf


@pytest.mark.parametrize("gains_mps", [0.0, -0.2, 0.001])
def test_headway_is_lost_by_a_stationary_or_drifting_vehicle(gains_mps: float) -> None:
    assert missing_s(gains_mps) == NO_WAY_S + 2.0


def test_headway_is_kept_by_slow_dwelling_and_waiting_vehicles() -> None:
    """One metre in 300 s is 0.0033 m/s."""
    assert math.inf == missing_s(0.01) == missing_s(0.0, STAY) == missing_s(0.0, None) == missing_s(0.0, from_m=996.0)


def test_a_new_target_or_coming_nearer_restores_headway() -> None:
    headway, at = Headway(), Motion(500.0, 0.0)
    found = [headway.is_missing(TARGET._replace(target_m=(x_m, 0.0)), at, s) for s, x_m in ((0, 900), (300, 1000))]
    assert found == [False, False]
    assert not headway.is_missing(TARGET, at, 600.0)
    assert headway.is_missing(TARGET, at, 602.0)
    assert headway.is_lost
    assert not headway.is_missing(TARGET, Motion(502.0, 0.0), 604.0)
    assert not headway.is_lost
