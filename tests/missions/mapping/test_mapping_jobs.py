"""The survey of an area as a job: what it takes, and from where to where."""

import math

import pytest

from missions.mapping.jobs import SurveyJob
from missions.mapping.sensors import SwathSettings
from remoras.database import VehicleData
from remoras.work import Outlook

AUV = VehicleData(
    name="AUV00",
    vehicle_type="AUV",
    node=0,
    social_layer=True,
    start_m=(0.0, 0.0),
    depth_m=20.0,
    depth_limit_m=100.0,
    transit_speed_mps=2.0,
    survey_speed_mps=1.5,
    turn_rate_radps=0.5,
    acceleration_mps2=0.5,
    energy_j=1.0e6,
    hotel_w=40.0,
    drag_w_per_mps3=15.0,
    transmit_j_per_bit=0.01,
    playable_roles=(),
    sensors=(SwathSettings(swath_m=25.0, speed_limit_mps=1.25),),
)
BLIND = VehicleData(**{name: getattr(AUV, name) for name in AUV.__dataclass_fields__} | {"sensors": ()})
SQUARE = SurveyJob("square", ((100.0, 100.0), (100.0, 350.0), (350.0, 350.0), (350.0, 100.0)))


def test_the_time_that_a_survey_takes() -> None:
    """159.1 m to (112.5, 112.5) at 2 m/s, then 2475 m at 1.25 m/s: 79.55 + 1980 s; ten rows end at (112.5, 337.5)."""
    then = SQUARE.after(Outlook(100.0, (0.0, 0.0)), AUV)
    assert then is not None
    assert then.free_s == pytest.approx(100.0 + 112.5 * math.sqrt(2.0) / 2.0 + 2475.0 / 1.25)
    assert then.position_m == pytest.approx((112.5, 337.5))


def test_it_begins_at_the_nearest_end() -> None:
    then = SQUARE.after(Outlook(0.0, (400.0, 400.0)), AUV)
    assert then is not None
    assert then.position_m == pytest.approx((337.5, 112.5))


def test_who_has_no_sensor_is_not_able() -> None:
    assert SQUARE.is_able(AUV)
    assert not SQUARE.is_able(BLIND)
    assert SQUARE.after(Outlook(0.0, (0.0, 0.0)), BLIND) is None


def test_what_says_that_it_is_done_and_where_it_is() -> None:
    assert SQUARE.done == ("areaDone", "square")
    assert SQUARE.place_m == (225.0, 225.0)
