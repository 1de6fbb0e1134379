"""A lost, disabled or empty vehicle drifts with the surface current."""

from functools import partial

import pytest
from varied import Varied

from missions.runs.run import Run

CURRENT = ("current.east_mps=0.3", "current.north_mps=-0.2", "current.shear_depth_m=40.0", "scenario.duration_s=300.0")
LOST = 'fault=[{kind="lost",vehicle="AUV02",at_s=100}]'
EMPTY = "vehicle.AUV02.energy_j=6000.0"


flown = partial(Varied("mapping-patches", "own.toml").flown, 1)


def at_m(of: Run, time_s: float) -> tuple[float, float]:
    return next((row[2], row[3]) for row in of.recorder.trajectories if row[:2] == (time_s, "AUV02"))


def way_m(of: Run, from_s: float, until_s: float) -> tuple[float, float]:
    (x_m, y_m), (then_x_m, then_y_m) = at_m(of, from_s), at_m(of, until_s)
    return then_x_m - x_m, then_y_m - y_m


@pytest.mark.parametrize(("befalls", "kind"), [(LOST, "lost"), (EMPTY, "energy")])
def test_lost_or_empty_vehicle_drifts_with_the_surface_current(befalls: str, kind: str) -> None:
    """From the tick after on: 100 s of (0.3, -0.2) m/s, though at its own depth of 20 m the water runs half as fast."""
    done = flown(*CURRENT, befalls)
    assert [row[0] < 200.0 for row in done.recorder.faults if row[1:3] == ("AUV02", kind)] == [True]
    assert way_m(done, 200.0, 300.0) == pytest.approx((30.0, -20.0))


def test_lost_vehicle_stays_in_still_water() -> None:
    assert way_m(flown("scenario.duration_s=300.0", LOST), 150.0, 250.0) == (0.0, 0.0)
