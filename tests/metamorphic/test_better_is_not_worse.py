"""Better equipment and less work do not lengthen the mission: means over seeds."""

from __future__ import annotations

from functools import cache
from statistics import fmean

import pytest
from recorded import flown

SEEDS = range(1, 13)
TOLERANCE = 1.05
"""A plan is found by a search, and a fleet that is done sooner may meet at a worse moment of the frame."""
SHORT = "area.right 3.corners_m=[[100.0, 500.0], [100.0, 560.0], [350.0, 560.0], [350.0, 500.0]]"
BETTER = {
    "a wider swath": ("vehicle.AUV02.sensor.swath_m=40.0",),
    "a faster vehicle": ("vehicle.AUV02.transit_speed_mps=2.83", "vehicle.AUV02.survey_speed_mps=1.73"),
    "a shorter area": (SHORT,),
}


@cache
def mean_s(strategy: str, *settings: str) -> float:
    """Mean mission time; a run that does not complete counts with the whole duration."""
    given = f"strategy.name={strategy}", "channel.per=0.3", *settings
    return fmean(flown("mapping-patches", *given, seed=seed).end_s for seed in SEEDS)


@pytest.mark.slow
@pytest.mark.thorough
@pytest.mark.parametrize("strategy", ["remoras", "central", "status-broadcast"])
@pytest.mark.parametrize("better", BETTER)
def test_better_equipment_and_less_work_do_not_make_the_mission_worse(strategy: str, better: str) -> None:
    """It fails if jobs are weighed by another swath or speed than they are done with, or plans waste what is gained."""
    assert mean_s(strategy, *BETTER[better]) <= TOLERANCE * mean_s(strategy)
