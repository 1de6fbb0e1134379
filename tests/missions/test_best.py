"""Equal strategies are told apart in at most 5 of 100 studies, whatever the others do; figure and table agree."""

import numpy as np
import pytest

from benchmarks.intervals import error_rate
from missions.comparison.ranking import Contender, column_ranks, family_of
from missions.comparison.treatments import Treatment
from missions.metric import Better
from missions.statistics import least_p, step_down_p


def draws(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(seed))


@pytest.mark.slow
@pytest.mark.parametrize("n", [8, 10])
@pytest.mark.parametrize(
    ("shape", "case", "success"),
    [
        ("normal", "all equal", 1.0),
        ("normal", "all equal", 0.8),
        ("normal", "two far behind", 1.0),
        ("unequal spreads", "all equal", 1.0),
        ("unequal spreads", "two far behind", 1.0),
        ("one in ten slow", "all equal", 1.0),
        ("one in ten slow", "two far behind", 1.0),
    ],
)
def test_equal_strategies_are_seldom_told_apart(shape: str, case: str, success: float, n: int) -> None:
    """At most 6 %, and 2 spreads of 400 studies (1.1 %); a permutation among all has 23 % with two far behind."""
    assert error_rate(shape, case, n, success, 400).told <= 0.06 + 2 * 0.011


def test_two_far_behind_take_nothing_from_the_others() -> None:
    """Step-down: the p of a close pair is what it is without the far ones, but that none is below theirs."""
    values = draws(2).normal(size=(10, 2))
    values[:, 1] += 1.5
    far = values[:, :1] - 50.0 + draws(3).normal(size=(10, 1))
    close = values[:, :1] - values[:, 1:]
    (alone,) = step_down_p(close)
    assert step_down_p(np.hstack([close, far, far - values[:, 1:]])) == [alone, 2 / 2**10, 2 / 2**10]


def test_who_is_worse_is_told() -> None:
    values = draws(2).normal(size=(10, 4))
    values[:, 3] += 4.0
    pairs = [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3)]
    p = step_down_p(np.array([values[:, one] - values[:, other] for one, other in pairs]).T)
    assert [value < 0.05 for value in p] == [False] * 3 + [True] * 3


def test_what_all_meet_in_a_repeat_tells_none_apart() -> None:
    """A common shift of a repeat and the unit of the metric change no p."""
    values = draws(3).normal(size=(8, 3))

    def tested(of: np.ndarray) -> dict[frozenset[Treatment], float]:
        names = [Treatment("s", f"{at}", "ack", "bernoulli", 0.1, ()) for at in range(3)]
        column = {
            name: Contender(dict(enumerate(of[:, at])), dict.fromkeys(range(8), 1.0)) for at, name in enumerate(names)
        }
        family = family_of([column])
        for rank in column_ranks(column, family, "m", Better.LOWER):
            assert rank.p_to_best is None or rank.p_to_best in family.of_metric.values()
        return dict(family.of_metric)

    assert tested(values) == pytest.approx(tested(1000.0 * (values + np.arange(8)[:, None])))


def test_the_least_probability_says_what_so_many_runs_can_tell() -> None:
    """All flipped or none: 2 of 2^n."""
    assert [least_p(n) for n in (1, 4, 5, 8)] == [1.0, 2 / 16, 2 / 32, 2 / 256]
    assert step_down_p([[1.0]] * 5) == [least_p(5)]
    assert step_down_p([[1.0]] * 40) == [least_p(40)]
