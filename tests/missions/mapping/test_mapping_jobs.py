"""The survey of an area as a job: what it takes, and from where to where."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_vehicles import AUV, WITHOUT_SENSOR

from missions.mapping.jobs import SurveyJob
from remoras.work import Outlook

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
    assert not SQUARE.is_able(WITHOUT_SENSOR)
    assert SQUARE.after(Outlook(0.0, (0.0, 0.0)), WITHOUT_SENSOR) is None


def test_who_does_not_stand_the_depth_is_not_able() -> None:
    """The vehicle stands 100 m."""
    deep, too_deep = replace(SQUARE, depth_m=100.0), replace(SQUARE, depth_m=100.5)
    assert deep.is_able(AUV)
    assert deep.after(Outlook(0.0, (0.0, 0.0)), AUV) == SQUARE.after(Outlook(0.0, (0.0, 0.0)), AUV)
    assert not too_deep.is_able(AUV)
    assert too_deep.after(Outlook(0.0, (0.0, 0.0)), AUV) is None


def test_what_says_that_it_is_done_and_where_it_is() -> None:
    assert SQUARE.done == ("areaDone", "square")
    assert SQUARE.place_m == (225.0, 225.0)
    assert SQUARE.needs == ()


@given(st.tuples(st.floats(-500, 1000), st.floats(-500, 1000)), st.floats(0.0, 1e4))
def test_a_survey_takes_its_own_time_and_the_way_to_it_wherever_it_begins(
    place_m: tuple[float, float], s: float
) -> None:
    """2475 m at 1.25 m/s, and the way to the nearest of the square's four ends at 2 m/s."""
    then = SQUARE.after(Outlook(s, place_m), AUV)
    assert then is not None
    way_m = min(math.dist(place_m, (x, y)) for x in (112.5, 337.5) for y in (112.5, 337.5))
    assert then.free_s - s == pytest.approx(way_m / 2.0 + 1980.0)


@given(st.floats(0.9, 1.1))
def test_a_vehicle_that_is_faster_by_a_share_is_done_sooner_by_that_share(factor: float) -> None:
    usual, faster = (SQUARE.after(Outlook(0.0, (0.0, 0.0)), data) for data in (AUV, AUV.faster(factor)))
    assert usual is not None
    assert faster is not None
    assert faster.free_s == pytest.approx(usual.free_s / factor)
