"""Who is told from the best: of equal ones somebody in at most 5 of 100 studies."""

import numpy as np
import pytest

from benchmarks.intervals import error_rate
from missions.comparison.ranking import least_p, worse_p


def draws(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(seed))


def told(values: np.ndarray) -> list[bool]:
    return [p < 0.05 for p in worse_p(values, [True] * values.shape[1])]


@pytest.mark.slow
@pytest.mark.parametrize(("k", "n", "success"), [(10, 10, 1.0), (4, 30, 0.8)])
def test_equal_strategies_are_seldom_told_apart(k: int, n: int, success: float) -> None:
    """60 studies with an error of 3.5 %: more than 6 in 0.5 % of the cases; a test against the winner has 14 %."""
    assert error_rate("normal", k, n, success, 60).told <= 6 / 60


@pytest.mark.slow
def test_the_best_of_a_tie_is_kept_where_others_are_worse_and_vary_more() -> None:
    """Two of four are equal, the others worse by three times their spread: of the two at most 5 % are told."""
    generator = draws(1)
    wrong = 0
    for _ in range(300):
        values = generator.normal(size=(10, 4))
        values[:, 2:] = 3.0 + 3.0 * values[:, 2:]
        wrong += any(told(values)[:2])
    assert wrong <= 15


def test_who_is_worse_is_told() -> None:
    values = draws(2).normal(size=(10, 4))
    values[:, 3] += 4.0
    assert told(values) == [False, False, False, True]


def test_a_common_shift_of_a_repeat_changes_nothing() -> None:
    """What all met in a repeat does not tell them apart; neither does the unit."""
    values = draws(3).normal(size=(8, 3))
    shifted = 1000.0 * (values + np.arange(8)[:, None])
    assert worse_p(values, [True] * 3) == pytest.approx(worse_p(shifted, [True] * 3))


def test_nobody_is_told_from_one_that_is_no_rival() -> None:
    values = draws(4).normal(size=(10, 3))
    values[:, 0] -= 9.0
    assert told(values)[1:] == [True, True]
    assert not any(p < 0.05 for p in worse_p(values, [False, True, True]))


def test_the_least_probability_says_what_so_many_runs_can_tell() -> None:
    """Of two treatments: 2 of 2^n ways to deal."""
    assert least_p(4, 2) == 2 / 16
    assert least_p(8, 2) == 2 / 256
    assert least_p(10, 10) < 0.01
