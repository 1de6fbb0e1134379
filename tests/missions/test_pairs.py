"""Pairs are of one repeat each, in whatever order runs ended."""

import pytest

from missions.comparison.pairs import paired_with


def test_each_value_is_compared_with_that_of_its_own_repeat() -> None:
    baseline = {0: 5.0, 1: 1.0, 2: 3.0, 7: 100.0}
    paired = paired_with({2: 4.0, 0: 6.0, 1: 2.0, 9: 50.0}, baseline)
    assert paired is not None
    assert paired.difference == 1.0
    assert paired.interval == (1.0, 1.0)
    assert paired.p == pytest.approx(2 / 8)
