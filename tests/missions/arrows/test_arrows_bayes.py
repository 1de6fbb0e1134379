"""Bayes' rule over cells: exact on small cases, free of order, and information that is what it says."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.arrows.belief_map import disagreement, divergence, entropy, log2_of, look_information, posterior

RATES = np.array([[0.1, 0.5, 0.9], [0.02, 0.3, 0.6]])
"""Of two detectors: for nothing and two kinds."""
PRIOR = np.array([[0.9], [0.07], [0.03]])
SHARES = st.lists(st.floats(0.01, 1.0), min_size=3, max_size=3).map(lambda w: np.array([w]).T / sum(w))


def counted(looks: list[tuple[int, bool]]) -> tuple[np.ndarray, np.ndarray]:
    n_yes, n_no = np.zeros((2, 1), dtype=np.int64), np.zeros((2, 1), dtype=np.int64)
    for detector, answer in looks:
        (n_yes if answer else n_no)[detector, 0] += 1
    return n_yes, n_no


LOOKS = st.lists(st.tuples(st.integers(0, 1), st.booleans()), max_size=12)


@given(SHARES, LOOKS)
def test_the_map_is_bayes_rule_look_by_look(prior: np.ndarray, looks: list[tuple[int, bool]]) -> None:
    expected = prior[:, 0].copy()
    for detector, answer in looks:
        expected *= RATES[detector] if answer else 1.0 - RATES[detector]
        expected /= expected.sum()
    assert posterior(prior, RATES, *counted(looks))[:, 0] == pytest.approx(expected, rel=1e-9)


def test_a_small_case_by_hand() -> None:
    """P(second kind | acoustic yes, magnetic no) = 0.03 * 0.9 * 0.4 / (0.0882 + 0.0245 + 0.0108)."""
    found = posterior(PRIOR, RATES, *counted([(0, True), (1, False)]))
    assert found[2, 0] == pytest.approx(0.0108 / (0.0882 + 0.0245 + 0.0108))


@given(LOOKS, st.randoms())
def test_the_order_of_looks_changes_no_bit(looks: list[tuple[int, bool]], order: object) -> None:
    shuffled = list(looks)
    order.shuffle(shuffled)  # type: ignore[attr-defined]
    one, other = (posterior(PRIOR, RATES, *counted(of)) for of in (looks, shuffled))
    assert one.tobytes() == other.tobytes()


def test_many_looks_do_not_underflow() -> None:
    counts = np.array([[3000], [3000]], dtype=np.int64)
    found = posterior(PRIOR, RATES, counts, counts)
    assert np.isfinite(found).all()
    assert found.sum() == pytest.approx(1.0)


@given(st.floats(1e-300, 1e300))
def test_the_logarithm_is_that_of_the_library(x: float) -> None:
    assert log2_of(np.array([x]))[0] == pytest.approx(math.log2(x), rel=1e-14, abs=1e-15)


@given(SHARES)
def test_a_look_is_worth_what_it_tells_in_the_mean(prior: np.ndarray) -> None:
    """Mutual information is the mean divergence of the map after the look from the one before."""
    for detector in (0, 1):
        expected = 0.0
        for answer in (True, False):
            after = posterior(prior, RATES, *counted([(detector, answer)]))
            rates = RATES[detector] if answer else 1.0 - RATES[detector]
            expected += float((prior[:, 0] * rates).sum()) * divergence(after, prior)
        assert look_information(prior, RATES[detector])[0] == pytest.approx(expected, abs=1e-12)


def test_a_detector_that_answers_at_random_tells_nothing() -> None:
    assert look_information(PRIOR, np.array([0.3, 0.3, 0.3]))[0] == pytest.approx(0.0, abs=1e-15)


@given(SHARES, SHARES)
def test_disagreement_is_between_none_and_one_bit_a_cell(one: np.ndarray, other: np.ndarray) -> None:
    assert 0.0 <= disagreement([one, other]) <= 1.0 + 1e-12
    assert disagreement([one, one.copy()]) == pytest.approx(0.0, abs=1e-12)
    assert disagreement([one, other]) == pytest.approx(disagreement([other, one]), abs=1e-12)


def test_entropy_of_even_shares() -> None:
    assert entropy(np.full((4, 2), 0.25)).tolist() == [2.0, 2.0]


def test_over_all_that_may_be_the_map_is_right_in_the_mean() -> None:
    """The law of total probability: the mean of the posterior over all answers is the prior."""
    looks = [(0, 0), (0, 0), (1, 1)]
    mean = np.zeros(3)
    for answers in itertools.product((True, False), repeat=len(looks)):
        given_ = [(detector, answer) for (detector, _), answer in zip(looks, answers, strict=True)]
        p = PRIOR[:, 0].copy()
        for detector, answer in given_:
            p *= RATES[detector] if answer else 1.0 - RATES[detector]
        mean += p.sum() * posterior(PRIOR, RATES, *counted(given_))[:, 0]
    assert mean == pytest.approx(PRIOR[:, 0])
