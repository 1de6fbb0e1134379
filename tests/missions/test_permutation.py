"""The sign-flip test by hand: what is drawn counts itself too, and what reaches the mean as well as it does, does."""

import math

import pytest

from missions.statistics import RESAMPLES, paired_p


def test_of_drawn_flips_the_one_that_was_observed_counts_too() -> None:
    """Of 2^40 flips none that is drawn reaches the mean: without itself the probability would be 0, which none is."""
    assert paired_p([1.0] * 40) == 1.0 / (5 * RESAMPLES)


@pytest.mark.parametrize("unit", [1.0, 0.1, math.pi])
def test_flips_that_reach_the_mean_but_for_rounding_count(unit: float) -> None:
    """Of 0, a, a, b both signs of 0 reach it, with all others as they are or all turned: 4 of 16."""
    assert paired_p([0.0, unit, unit, 3.0 * unit]) == 4 / 16
    assert paired_p([unit, 2.0 * unit, 3.0 * unit]) == 2 / 8
