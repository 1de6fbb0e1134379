"""Pairs are of one repeat each, in whatever order runs ended."""

from missions.comparison.treatments import Measured, paired_with
from missions.statistics import NoInterval


def test_each_value_is_compared_with_that_of_its_own_repeat() -> None:
    baseline = Measured({0: 5.0, 1: 1.0, 2: 3.0, 7: 100.0})
    paired = paired_with(Measured({2: 4.0, 0: 6.0, 1: 2.0, 9: 50.0}), baseline)
    assert paired is not None
    assert (paired.difference, paired.n) == (1.0, 3)
    assert paired.interval is NoInterval.TOO_FEW


def test_a_run_in_which_nothing_was_drawn_is_the_same_in_all_repeats() -> None:
    once = Measured({0: 10.0}, constant=True)
    paired = paired_with(Measured({3: 11.0, 4: 12.0}), once)
    assert paired is not None
    assert (paired.difference, paired.n) == (1.5, 2)


def test_two_runs_in_which_nothing_was_drawn_differ_without_chance() -> None:
    paired = paired_with(Measured({0: 11.0}, constant=True), Measured({0: 10.0}, constant=True))
    assert paired is not None
    assert (paired.difference, paired.n, paired.effect) == (1.0, 1, None)
    assert paired.interval is NoInterval.DETERMINISTIC


def test_only_the_share_of_what_was_drawn_is_uncertain() -> None:
    """None of 8 failed. Of the one side that may, the difference may be larger; of the other, proven, it may not."""
    times = {repeat: 100.0 + repeat for repeat in range(8)}
    ours = Measured(times, frozenset(times), 1000.0)
    paired = paired_with(ours, Measured({0: 100.0}, frozenset({0}), 1000.0, constant=True))
    assert paired is not None
    assert isinstance(paired.interval, tuple)
    low, high = paired.interval
    assert 0.0 < low < 3.5
    assert high > 300.0
    assert paired.n_reached == 8
    assert isinstance(paired.reached_interval, tuple)
    assert paired.reached_interval[1] < 7.0
