"""Statistics against known values and their own guarantees: tests, intervals, shares, sequential verdicts."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from benchmarks.intervals import SHAPES, coverage, error_rate, race_error
from missions.comparison.ranking import Contender, column_ranks, family_of
from missions.comparison.treatments import Measured, Treatment
from missions.meeting.sequential_tests import sequential_verdict
from missions.runs.metrics import CORE_METRICS
from missions.statistics import (
    FEW,
    MANY,
    NoInterval,
    Timed,
    difference_interval,
    effect_size,
    least_p,
    mean_interval,
    pairing_gain,
    restricted_difference_interval,
    restricted_interval,
    share_interval,
    step_down_p,
    t_half_width,
    wilson_interval,
)

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


def test_effect_size_and_pairing_gain_of_two_values_are_exact() -> None:
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
def test_sign_flips_equal_up_to_rounding_count_as_extreme(unit: float) -> None:
    """Of 0, a, a, b both signs of 0 reach it, with all others as they are or all turned: 4 of 16."""
    assert step_down_p([[0.0], [unit], [unit], [3.0 * unit]]) == [4 / 16]
    assert step_down_p([[unit], [2.0 * unit], [3.0 * unit]]) == [2 / 8]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "case", "success"),
    [
        ("normal", "all equal", 0.8),
        ("unequal spreads", "two far behind", 1.0),
        ("one in ten slow", "two far behind", 1.0),
    ],
)
def test_equal_strategies_are_rarely_distinguished(shape: str, case: str, success: float) -> None:
    """At most 6 %, and 2 spreads of 400 studies (1.1 %); a permutation among all has 23 % with two far behind."""
    assert error_rate(shape, case, 8, success, 400).told <= 0.06 + 2 * 0.011


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "equal", "behind"),
    [
        pytest.param("normal", 5, (0.4, 1.2), marks=pytest.mark.thorough),
        pytest.param("one in ten slow", 4, (0.4, 1.2), marks=pytest.mark.thorough),
        ("unequal spreads", 1, (0.035, 0.035, 0.4)),
    ],
)
def test_races_rarely_state_what_is_wrong(shape: str, equal: int, behind: tuple[float, ...]) -> None:
    """At most 6 %, and two spreads of 100 races (2.4 %), over all looks of a race."""
    assert race_error(shape, equal, behind, 100, 100) <= 0.06 + 2 * 0.024


def test_common_shift_of_a_repeat_and_unit_change_no_p_value() -> None:
    """A common shift of a repeat and the unit of the metric change no p."""
    values = draws(3).normal(size=(8, 3))

    def tested(of: np.ndarray) -> dict[frozenset[Treatment], float]:
        names = [Treatment("s", f"{at}", "ack", "bernoulli", 0.1, ()) for at in range(3)]
        column = {
            name: Contender(Measured(dict(enumerate(of[:, at]))), Measured(dict.fromkeys(range(8), 1.0)))
            for at, name in enumerate(names)
        }
        family = family_of([column])
        for rank in column_ranks(column, family, CORE_METRICS[0]):
            assert rank.p_to_best is None or rank.p_to_best in family.of_metric.values()
        return dict(family.of_metric)

    assert tested(values) == pytest.approx(tested(1000.0 * (values + np.arange(8)[:, None])))


def test_least_p_value_of_n_runs_is_2_over_2_to_the_n() -> None:
    """All flipped or none: 2 of 2^n."""
    assert [least_p(n) for n in (1, 4, 5, 8)] == [1.0, 2 / 16, 2 / 32, 2 / 256]
    assert step_down_p([[1.0]] * 5) == [least_p(5)]
    assert step_down_p([[1.0]] * 40) == [least_p(40)]


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_interval_of_a_mean_covers_it_in_95_of_100(shape: str) -> None:
    """93 to 97 % within twice the spread of 1000 studies (0.7 %); half of the width is not bought by saying nothing."""
    found = coverage("mean", shape, MANY, 0.0, 1000)
    assert found.covered is not None
    assert found.n_intervals >= 0.97 * found.n_studies
    assert 0.92 <= found.covered <= 0.98


@pytest.mark.parametrize("n", [8, 10, 20])
def test_few_runs_with_rare_slow_ones_have_no_interval_of_the_mean(n: int) -> None:
    """Student's and the bootstrap's cover 55, 64, 88 % there, since 43, 35, 12 % of the studies see no slow run."""
    assert coverage("mean", "one in ten slow", n, 0.0, 20).n_intervals == 0


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("n", [8, 10])
def test_interval_of_a_difference_covers_it_in_95_of_100(shape: str, n: int) -> None:
    """Exact: 1 - 12 / 2^8 and 1 - 50 / 2^10, within three spreads of 400 studies (1.1 %)."""
    found = coverage("shift", shape, n, 0.0, 400)
    assert found.n_intervals == found.n_studies
    assert found.covered == pytest.approx(0.952, abs=0.033)


@given(st.lists(st.floats(-10.0, 10.0).map(lambda value: round(value, 3)), min_size=FEW, max_size=10))
def test_interval_of_a_difference_inverts_its_test(differences: list[float]) -> None:
    low, high = difference_interval(differences)
    for shift, refuted in ((low - 1e-4, True), (low + 1e-4, False), (high - 1e-4, False), (high + 1e-4, True)):
        (p,) = step_down_p([[value - shift] for value in differences])
        assert (p <= 0.05) is refuted or high - low < 2e-4


@pytest.mark.parametrize("n", [8, 10, 20])
def test_interval_of_a_restricted_mean_covers_rare_slow_runs(n: int) -> None:
    """One in ten is slow, and all complete before the horizon; unseen runs may be as late as the horizon."""
    found = coverage("restricted", "one in ten slow", n, 0.0, 100)
    assert found.covered is not None
    assert found.covered >= 0.93


@pytest.mark.parametrize("share", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("what", ["restricted", "difference"])
def test_intervals_cover_at_any_share_of_censored_runs(what: str, share: float) -> None:
    """At least 93 %, within twice the spread of 150 studies (1.8 %); above 97 % since a share not seen may be there."""
    found = coverage(what, "exponential", 10, share, 150)
    assert found.covered is not None
    assert found.covered >= 0.93 - 2 * 0.018


def test_too_few_values_have_no_interval() -> None:
    assert FEW == 8
    values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5]
    assert difference_interval(values) is NoInterval.TOO_FEW
    assert isinstance(difference_interval([*values, 8.0]), tuple)
    assert mean_interval(values * 4) is NoInterval.RARE
    assert isinstance(mean_interval([*values * 4, 8.0, 9.0]), tuple)
    assert restricted_interval(Timed(values, [True] * 7, 9.0)) is NoInterval.TOO_FEW
    timed = Timed(values, [True] * 7, 9.0)
    assert restricted_difference_interval(timed, timed) is NoInterval.TOO_FEW
    one = Timed([*values, 8.0], [True] + [False] * 7, 9.0)
    assert restricted_difference_interval(one, Timed([9.0] * 8, [True] * 8, 9.0)) is NoInterval.FEW_REACHED


def test_values_that_hardly_differ_have_no_interval() -> None:
    assert mean_interval([1.0] * 30) is NoInterval.ALIKE
    assert mean_interval([1.0] * 29 + [0.9]) is NoInterval.FEW_DIFFER


@given(st.lists(st.floats(0.0, 100.0), min_size=MANY, max_size=40))
def test_interval_of_a_mean_contains_students_and_mirrors_with_its_values(values: list[float]) -> None:
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
def test_restricted_mean_is_in_its_interval_below_the_horizon(n_late: int, horizon: float) -> None:
    times = [100.0 + 3.0 * number for number in range(12 - n_late)] + [horizon] * n_late
    found = restricted_interval(Timed(times, [value < horizon for value in times], horizon))
    assert isinstance(found, tuple)
    assert 0.0 <= found[0] <= float(np.mean(times)) <= found[1] * (1 + 1e-12)
    if n_late == 12:
        assert found == (pytest.approx(0.025 ** (1 / 12) * horizon), horizon)


N = 4000


def played(draw: random.Random, is_true: bool, p_right: float, rate: float) -> tuple[bool, int]:
    """Verdict, and number of looks until it."""
    odds, n = 1.0, 0
    while (verdict := sequential_verdict(odds / (1.0 + odds), rate, rate)) is None:
        looks_true = is_true == (draw.random() < p_right)
        odds *= p_right / (1.0 - p_right) if looks_true else (1.0 - p_right) / p_right
        n += 1
    return verdict, n


@pytest.mark.parametrize("rate", [0.01, 0.1])
@pytest.mark.parametrize("p_right", [0.7, 0.85, 0.95])
@pytest.mark.parametrize("is_true", [True, False])
def test_sequential_test_keeps_its_error_rate_with_few_looks(is_true: bool, p_right: float, rate: float) -> None:
    """Wald: at most rate / (1 - rate) err; a walk that ends n steps off ends after (1 - 2 err) n / (2 p - 1) looks."""
    draw = random.Random(5)
    verdicts, looks = zip(*(played(draw, is_true, p_right, rate) for _ in range(N)), strict=True)
    most = rate / (1.0 - rate)
    errors = sum(verdict is not is_true for verdict in verdicts) / N
    assert errors <= most + 4.0 * math.sqrt(most / N)
    steps = math.ceil(math.log((1.0 - rate) / rate) / math.log(p_right / (1.0 - p_right)) - 1e-9)
    err = 1.0 / (1.0 + (p_right / (1.0 - p_right)) ** steps)
    assert sum(looks) / N == pytest.approx((1.0 - 2.0 * err) * steps / (2.0 * p_right - 1.0), rel=0.05)


def test_stricter_error_rate_needs_more_looks() -> None:
    assert sequential_verdict(0.99, 0.02, 0.02) is True
    assert sequential_verdict(0.99, 0.005, 0.005) is None
    assert sequential_verdict(1.0, 0.001, 0.001) is True
    assert sequential_verdict(0.0, 0.001, 0.001) is False
