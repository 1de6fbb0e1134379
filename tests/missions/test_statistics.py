"""Statistics against known values and against their own promises."""

import math

import numpy as np
import pytest
from scipy import stats

from missions.statistics import effect_size, pairing_gain, step_down_p, wilson_interval

REPETITIONS = 1000
N_RUNS = 30


def draws(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(seed))


def test_wilson_covers_a_success_rate_in_95_of_100() -> None:
    successes = draws(12).binomial(N_RUNS, 0.8, REPETITIONS)
    covered = sum(low <= 0.8 <= high for low, high in (wilson_interval(int(s), N_RUNS) for s in successes))
    assert 930 <= covered <= 970


def test_the_sign_flip_test_agrees_with_scipy() -> None:
    differences = draws(3).normal(0.4, 1.0, 20)
    expected = stats.permutation_test(
        (differences,), np.mean, permutation_type="samples", n_resamples=20_000, rng=draws(4)
    ).pvalue
    assert step_down_p(differences[:, None]) == pytest.approx([expected], abs=0.025)


def test_of_two_values_spreads_are_known() -> None:
    """Variances 2 and 2: d = -1 / sqrt(2); paired differences -1 and -1 have no spread, -1 and -3 have 2: 10 / 2."""
    assert effect_size([0.0, 2.0], [1.0, 3.0]) == pytest.approx(-(0.5**0.5))
    assert pairing_gain([0.0, 2.0], [1.0, 5.0]) == pytest.approx(5.0)
    assert effect_size([1.0], [2.0]) is None
    assert pairing_gain([1.0], [2.0]) is None


def test_step_down_follows_the_steps_of_romano_and_wolf() -> None:
    """By another way: flip, take the largest of those left, and go on without the clearest (2016, algorithm 4.2)."""
    differences = draws(7).normal([0.0, 0.4, 0.8, 1.5], 1.0, (8, 4))
    flips = [[1.0 - 2.0 * (way >> at & 1) for at in range(8)] for way in range(2**8)]
    of_flips = [abs(stats.ttest_1samp(np.array(flip)[:, None] * differences, 0.0).statistic) for flip in flips]
    observed, left, p, least = of_flips[0], [0, 1, 2, 3], [0.0] * 4, 0.0
    while left:
        clearest = max(left, key=lambda at: observed[at])
        reached = sum(max(of[left]) >= observed[clearest] * (1.0 - 1e-9) for of in of_flips)
        p[clearest] = least = max(least, reached / 2**8)
        left.remove(clearest)
    assert step_down_p(differences) == pytest.approx(p)


def test_pairing_gains_nothing_without_common_draws() -> None:
    a, b = draws(5).normal(size=4000), draws(6).normal(size=4000)
    assert pairing_gain(a, b) == pytest.approx(1.0, abs=0.1)
    assert pairing_gain(a, a + 0.1 * b) == pytest.approx(201.0, rel=0.1)


@pytest.mark.parametrize("unit", [1.0, 0.1, math.pi])
def test_flips_that_reach_the_mean_but_for_rounding_count(unit: float) -> None:
    """Of 0, a, a, b both signs of 0 reach it, with all others as they are or all turned: 4 of 16."""
    assert step_down_p([[0.0], [unit], [unit], [3.0 * unit]]) == [4 / 16]
    assert step_down_p([[unit], [2.0 * unit], [3.0 * unit]]) == [2 / 8]


def test_what_does_not_differ_is_alike() -> None:
    assert step_down_p([[0.0, 0.0]] * 20) == [1.0, 1.0]
