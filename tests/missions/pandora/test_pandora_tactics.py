"""What was learnt of a vehicle changes the speed that it asks for."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from missions.pandora.assessment import SPARE_MPS, ActionMonitor
from remoras.database import VehicleData


def monitor() -> ActionMonitor:
    data = SimpleNamespace(name="AUV01", transit_speed_mps=2.0, depth_m=5.0, sensor=lambda kind: None)
    return ActionMonitor(cast(VehicleData, data), cast(Any, None), cast(Any, None), None)


@pytest.mark.parametrize(
    ("known", "asked_mps"),
    [
        ({}, 0.4),
        ({("thrustShare", "AUV01"): 0.5}, 0.8),
        ({("flow", "AUV01"): (0.3, 0.4)}, 0.5 + SPARE_MPS),
        ({("flow", "AUV01"): (0.3, 0.4), ("thrustShare", "AUV01"): 0.5}, 2.0 * (0.5 + SPARE_MPS)),
        ({("flow", "AUV01"): (3.0, 4.0)}, 2.0),
    ],
)
def test_a_place_is_held_with_what_thrusters_and_current_leave(known: dict[Any, Any], asked_mps: float) -> None:
    assert monitor().hold_speed_mps(known, 0.0, 0.4, 1.0) == pytest.approx(asked_mps)


@pytest.mark.parametrize(("thrust_share", "is_overpowered"), [(1.0, False), (0.2, True)])
def test_a_current_is_too_strong_for_weak_thrusters(thrust_share: float, is_overpowered: bool) -> None:
    known = {("flow", "AUV01"): (0.3, 0.4), ("thrustShare", "AUV01"): thrust_share}
    assert monitor().is_overpowered(known, 0.0) is is_overpowered
