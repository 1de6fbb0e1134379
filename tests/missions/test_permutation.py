"""The sign-flip test by hand: flips that reach the sum as well as the observed one count."""

import math

import pytest

from missions.statistics import step_down_p


@pytest.mark.parametrize("unit", [1.0, 0.1, math.pi])
def test_flips_that_reach_the_mean_but_for_rounding_count(unit: float) -> None:
    """Of 0, a, a, b both signs of 0 reach it, with all others as they are or all turned: 4 of 16."""
    assert step_down_p([[0.0], [unit], [unit], [3.0 * unit]]) == [4 / 16]
    assert step_down_p([[unit], [2.0 * unit], [3.0 * unit]]) == [2 / 8]


def test_what_does_not_differ_is_alike() -> None:
    assert step_down_p([[0.0, 0.0]] * 20) == [1.0, 1.0]
