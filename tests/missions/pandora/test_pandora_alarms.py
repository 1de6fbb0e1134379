"""Sequential tests: their rate of false alarms is the stated one, what they estimate is right, and soon."""

import numpy as np
import pytest

from missions.pandora.scenario import PandoraSettings
from missions.pandora.sequential import Cusum, readings_between_alarms, threshold


def between_alarms(stated: float, n_readings: int) -> float:
    """Readings for each alarm of one test that sees nothing but noise."""
    draws = np.random.Generator(np.random.Philox(7)).standard_normal(n_readings)
    test = Cusum(threshold(stated))
    return n_readings / sum(test.add(float(z)) is not None for z in draws)


def test_where_nothing_is_wrong_it_alarms_at_the_stated_rate() -> None:
    """400,000 readings bring about 1,000 alarms: their number has a standard deviation of about 3 %."""
    assert between_alarms(400.0, 400_000) == pytest.approx(400.0, rel=0.12)


def test_the_threshold_is_that_of_the_tables() -> None:
    """Exactly, both sides together alarm once in 168 readings at h = 4 and in 465 at h = 5 (Montgomery, Table 9.3)."""
    assert readings_between_alarms(4.0) == pytest.approx(168.0, rel=0.02)
    assert readings_between_alarms(5.0) == pytest.approx(465.0, rel=0.02)


def test_the_rate_is_stated_for_each_test_by_the_hour() -> None:
    """0.01 per hour at a reading every 20 s is one alarm in 18,000 readings."""
    assert PandoraSettings().alarm_at(20.0) == pytest.approx(threshold(18_000.0))


@pytest.mark.parametrize("shift", [2.0, 3.0, -4.0])
def test_what_is_off_is_found_and_estimated(shift: float) -> None:
    draws = np.random.Generator(np.random.Philox(8))
    taken, estimates = [], []
    for _ in range(200):
        test = Cusum(threshold(18_000.0))
        for number in range(1, 1_000):
            if (off := test.add(float(draws.standard_normal()) + shift)) is not None:
                taken.append(number)
                estimates.append(off)
                break
    assert len(estimates) == 200
    # a sum that grows by |shift| - 1/2 a reading, from 0 to h = 8.5 and over it
    assert np.mean(taken) == pytest.approx((threshold(18_000.0) + 1.0) / (abs(shift) - 0.5), rel=0.15)
    assert np.mean(estimates) == pytest.approx(shift, rel=0.15)
