"""A vehicle without headway withdraws; others do the rest, and the run ends."""

from __future__ import annotations

import pytest
from recorded import faults, flown

SLOWED = "fault=[{vehicle='AUV01', kind='slow', factor=0.3, at_s=300.0}]"


@pytest.mark.slow
def test_slowed_vehicle_swept_away_is_replaced_though_in_contact() -> None:
    """0.3 of 1 m/s against 0.4 m/s. Before, its two parts stayed open and all waited for it until 14,400 s."""
    finished = flown("pandora-inspection", "current={east_mps=0.4}", SLOWED)
    assert finished.completed, finished.reason
    assert [who for who, _ in faults(finished, "cannot")] == ["AUV01", "AUV01"]  # its job, then its way
    assert "AUV01" not in {row[1] for row in finished.recorder.rows("serviced") if row[0] > 700.0}


@pytest.mark.slow
def test_vehicle_holds_position_in_a_current_faster_than_its_slow_speed() -> None:
    """It creeps at 0.3 m/s over ground; as fast through the water it was carried off, and nothing was recovered."""
    finished = flown("trident-intervention", "current={east_mps=0.5}", seed=2)
    assert finished.completed, finished.reason
