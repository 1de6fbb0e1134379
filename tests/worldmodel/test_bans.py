"""Exclusions (bans) of vehicles: independence of arrival order, and equal cost of a view with and without one."""

import math
import random

from hypothesis import given
from hypothesis import strategies as st

from worldmodel import Block, Observation, PropertyValue
from worldmodel.holdings import decided


def word(time_s: float, issuer: int, vehicle: int, from_s: float | None, sequence: int = 0) -> Observation:
    value = math.inf if from_s is None else from_s
    return Observation(Block(issuer, sequence, time_s, (PropertyValue(vehicle, 0, value),)), 0)


def test_statement_about_the_own_ban_is_ignored() -> None:
    assert decided([word(10, 1, 1, 0)]) == {}
    assert decided([word(10, 0, 1, 5), word(11, 1, 1, None)]) == {1: 5}


def test_earlier_of_two_mutual_bans_prevails() -> None:
    assert decided([word(10, 0, 1, 0), word(12, 1, 0, 0)]) == {1: 0}


def test_ban_applies_from_its_stated_time_on() -> None:
    """Vehicle 1 is banned from 20 s on: its facts at 12 s count, those at 22 s do not."""
    assert decided([word(10, 0, 1, 20), word(12, 1, 2, 0)]) == {1: 20, 2: 0}
    assert decided([word(10, 0, 1, 20), word(22, 1, 2, 0)]) == {1: 20}


def test_ban_stays_valid_if_its_issuer_is_banned_later() -> None:
    assert decided([word(10, 0, 1, 0), word(11, 2, 0, 0)]) == {0: 0, 1: 0}


def test_readmitted_vehicle_may_ban_others_again() -> None:
    assert decided([word(10, 0, 1, 0), word(11, 2, 1, None), word(12, 1, 0, 3)]) == {0: 3}


@given(
    st.lists(
        st.tuples(st.integers(0, 9), st.integers(0, 3), st.integers(0, 3), st.none() | st.integers(0, 9)), max_size=10
    ),
    st.integers(0, 99),
)
def test_order_of_arrival_makes_no_difference(rows: list[tuple[int, int, int, int | None]], seed: int) -> None:
    facts = [word(t, issuer, vehicle, from_s, n) for n, (t, issuer, vehicle, from_s) in enumerate(rows)]
    assert decided(facts) == decided(random.Random(seed).sample(facts, len(facts)))
