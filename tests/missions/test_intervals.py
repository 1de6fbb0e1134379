"""Intervals of means hold what they say, or say that they cannot."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.intervals import SHAPES, coverage
from missions.statistics import (
    FEW,
    MANY,
    NoInterval,
    Timed,
    difference_interval,
    mean_interval,
    restricted_difference_interval,
    restricted_interval,
    share_interval,
    step_down_p,
    t_half_width,
)


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_the_interval_of_a_mean_covers_it_in_95_of_100(shape: str) -> None:
    """93 to 97 % within twice the spread of 1000 studies (0.7 %); half of the width is not bought by saying nothing."""
    found = coverage("mean", shape, MANY, 0.0, 1000)
    assert found.covered is not None
    assert found.n_intervals >= 0.97 * found.n_studies
    assert 0.92 <= found.covered <= 0.98


@pytest.mark.parametrize("n", [8, 10, 20])
def test_where_one_run_in_ten_is_slow_few_runs_have_no_interval_of_the_mean(n: int) -> None:
    """Student's and the bootstrap's cover 55, 64, 88 % there, since 43, 35, 12 % of the studies see no slow run."""
    assert coverage("mean", "one in ten slow", n, 0.0, 20).n_intervals == 0


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("n", [8, 10])
def test_the_interval_of_a_difference_covers_it_in_95_of_100(shape: str, n: int) -> None:
    """Exact: 1 - 12 / 2^8 and 1 - 50 / 2^10, within three spreads of 400 studies (1.1 %)."""
    found = coverage("shift", shape, n, 0.0, 400)
    assert found.n_intervals == found.n_studies
    assert found.covered == pytest.approx(0.952, abs=0.033)


@given(st.lists(st.floats(-10.0, 10.0).map(lambda value: round(value, 3)), min_size=FEW, max_size=10))
def test_the_interval_of_a_difference_is_what_its_test_does_not_refute(differences: list[float]) -> None:
    low, high = difference_interval(differences)
    for shift, refuted in ((low - 1e-4, True), (low + 1e-4, False), (high - 1e-4, False), (high + 1e-4, True)):
        (p,) = step_down_p([[value - shift] for value in differences])
        assert (p <= 0.05) is refuted or high - low < 2e-4


@pytest.mark.parametrize("n", [8, 10, 20])
def test_a_slow_run_that_was_not_seen_is_in_the_interval_of_a_restricted_mean(n: int) -> None:
    """Of times with one in ten slow all get there before the horizon; what was not seen may be as late as that."""
    found = coverage("restricted", "one in ten slow", n, 0.0, 100)
    assert found.covered is not None
    assert found.covered >= 0.93


@pytest.mark.parametrize("share", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("what", ["restricted", "difference"])
def test_an_interval_holds_whatever_share_of_the_runs_does_not_get_there(what: str, share: float) -> None:
    """At least 93 %, within twice the spread of 150 studies (1.8 %); above 97 % since a share not seen may be there."""
    found = coverage(what, "exponential", 10, share, 150)
    assert found.covered is not None
    assert found.covered >= 0.93 - 2 * 0.018


def test_of_too_few_values_no_interval_is_said() -> None:
    assert FEW == 8
    values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5]
    assert difference_interval(values) is NoInterval.TOO_FEW
    assert isinstance(difference_interval([*values, 8.0]), tuple)
    assert mean_interval(values * 4) is NoInterval.RARE
    assert isinstance(mean_interval([*values * 4, 8.0, 9.0]), tuple)
    assert restricted_interval(Timed(values, [True] * 7, 9.0)) is NoInterval.TOO_FEW
    timed = Timed(values, [True] * 7, 9.0)
    assert restricted_difference_interval(timed, timed) is NoInterval.TOO_FEW


def test_values_that_do_not_differ_say_nothing_of_their_spread() -> None:
    assert mean_interval([1.0] * 30) is NoInterval.ALIKE
    assert mean_interval([1.0] * 29 + [0.9]) is NoInterval.FEW_DIFFER


@given(st.lists(st.floats(0.0, 100.0), min_size=MANY, max_size=40))
def test_an_interval_is_never_shorter_than_students_and_turns_with_its_values(values: list[float]) -> None:
    found, turned = mean_interval(values), mean_interval([-value for value in values])
    if isinstance(found, NoInterval):
        assert turned is found or isinstance(turned, NoInterval)
        return
    mean, half = math.fsum(values) / len(values), t_half_width(values)
    assert found[0] <= mean - half * (1 - 1e-9)
    assert found[1] >= mean + half * (1 - 1e-9)


def test_exact_bounds_of_a_share() -> None:
    """Clopper and Pearson: at 0 of n the upper bound is 1 - 0.025^(1/n), at n of n the lower 0.025^(1/n)."""
    assert share_interval(0, 30) == (0.0, pytest.approx(1 - 0.025 ** (1 / 30)))
    assert share_interval(5, 5) == (pytest.approx(0.025 ** (1 / 5)), 1.0)
    low, high = share_interval(2, 10)
    assert (low, high) == (pytest.approx(0.0252, abs=1e-4), pytest.approx(0.5561, abs=1e-4))


@given(st.integers(0, 12), st.floats(200.0, 1000.0))
def test_a_restricted_mean_lies_in_its_interval_and_that_below_the_horizon(n_late: int, horizon: float) -> None:
    times = [100.0 + 3.0 * number for number in range(12 - n_late)] + [horizon] * n_late
    found = restricted_interval(Timed(times, [value < horizon for value in times], horizon))
    assert isinstance(found, tuple)
    assert 0.0 <= found[0] <= float(np.mean(times)) <= found[1] * (1 + 1e-12)
    if n_late == 12:
        assert found == (pytest.approx(0.025 ** (1 / 12) * horizon), horizon)
