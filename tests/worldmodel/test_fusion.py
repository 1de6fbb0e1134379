"""Fusion against check values with their source, and laws that hold for any observations."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_fleet import TBOX

from worldmodel import Attribute, Block, FactError, Observation, PropertyValue, Value, ValueKind, fused
from worldmodel.fields import Field

NUMBER = Attribute(1, "depth", "rm:depth", 0, ValueKind.NUMBER, (Field(0, 100, 0.5, "m"),))
POINT = Attribute(1, "place", "rm:place", 0, ValueKind.POINT, (Field(0, 100, 0.5, "m"),) * 2)
SYMBOL = Attribute(1, "kind", "rm:kind", 0, ValueKind.SYMBOL, symbols=("unknown", "wreck", "pipeline", "anomaly"))
TRUTH = Attribute(1, "leaks", "rm:leaks", 0, ValueKind.BOOLEAN)
LINK = Attribute(1, "near", "rm:near", 0, ValueKind.LINK, range_class=0)


def seen(origin: int, value: Value, uncertainty: float | None, time_s: float = 0.0) -> Observation:
    return Observation(Block(origin, 0, time_s, (PropertyValue(7, 1, value, uncertainty),)), 0)


def test_three_measurements_of_a_resistance() -> None:
    """Taylor, An Introduction to Error Analysis, 2nd edition, section 7.2: 11 +- 1, 12 +- 1 and 10 +- 3 ohms give
    11.42 and 0.69."""
    found = fused(NUMBER, [seen(0, 11.0, 1.0), seen(1, 12.0, 1.0), seen(2, 10.0, 3.0)])
    assert found is not None
    assert found.value == pytest.approx(11.42, abs=0.005)
    assert found.uncertainty == pytest.approx(0.69, abs=0.005)
    assert found.origins == (0, 1, 2)


def test_axes_of_a_point_are_numbers() -> None:
    """By hand: weights 1 and 1/4, so east (10 + 12/4) / 1.25 = 10.4 and north (20 + 40/4) / 1.25 = 24; 1.25^-1/2."""
    found = fused(POINT, [seen(0, (10.0, 20.0), 1.0), seen(1, (12.0, 40.0), 2.0)])
    assert found is not None
    assert isinstance(found.value, tuple)
    assert found.value == pytest.approx((10.4, 24.0))
    assert found.uncertainty == pytest.approx(1.25**-0.5)


def test_a_rare_truth_and_a_test_that_is_right_in_nine_of_ten() -> None:
    """Bayes by hand: 0.01 * 0.9 / (0.01 * 0.9 + 0.99 * 0.1) = 1/12."""
    found = fused(TRUTH, [seen(0, True, 0.9)], prior={True: 0.01, False: 0.99})
    assert found is not None
    assert dict(found.probabilities)[True] == pytest.approx(1 / 12)
    assert found.value is False


def test_two_that_agree_are_surer_than_each() -> None:
    """Of four symbols, 0.8 twice for one: 0.64 against three times (0.2/3)^2, so 0.64 / 0.6533 = 0.9796."""
    both = fused(SYMBOL, [seen(0, 1, 0.8), seen(1, 1, 0.8)])
    alone = fused(SYMBOL, [seen(0, 1, 0.8)])
    assert both is not None
    assert alone is not None
    assert (both.value, both.uncertainty) == (1, pytest.approx(0.64 / (0.64 + 3 * (0.2 / 3) ** 2)))
    assert alone.uncertainty == pytest.approx(0.8)  # of a flat prior nothing but the sensor's own word is left


def test_two_that_differ_leave_the_surer_one_ahead() -> None:
    """By hand, with p 0.9 for a wreck and 0.7 for a pipeline: wreck 0.9 * 0.3/3, pipeline 0.1/3 * 0.7."""
    found = fused(SYMBOL, [seen(0, 1, 0.9), seen(1, 2, 0.7)])
    weights = {1: 0.9 * 0.1, 2: 0.1 / 3 * 0.7, 0: 0.1 / 3 * 0.1, 3: 0.1 / 3 * 0.1}
    assert found is not None
    assert found.value == 1
    assert dict(found.probabilities) == pytest.approx({h: w / sum(weights.values()) for h, w in weights.items()})


def test_a_link_leaves_room_for_what_nobody_named() -> None:
    """0.6 for 5 alone: the other hypothesis, anything else, has 0.4."""
    found = fused(LINK, [seen(0, 5, 0.6)])
    assert found is not None
    assert found.probabilities == ((5, pytest.approx(0.6)),)


def test_every_observation_of_an_origin_counts() -> None:
    """By hand: the mean of 0 to 9 is 4.5, and its standard deviation 10^-1/2."""
    often = [seen(0, float(n), 1.0, float(n)) for n in range(10)]
    found = fused(NUMBER, often)
    assert found is not None
    assert (found.value, found.uncertainty) == pytest.approx((4.5, 10.0**-0.5))
    assert found.origins == (0,)


def test_looks_of_one_origin_are_multiplied() -> None:
    """By hand: 0.8^2 against 0.2^2 for two looks at a truth value, and a third that differs takes one of them back."""
    looks = [seen(0, True, 0.8, 1.0), seen(0, True, 0.8, 2.0), seen(0, False, 0.8, 3.0)]
    two, three = fused(TRUTH, looks[:2]), fused(TRUTH, looks)
    assert two is not None
    assert three is not None
    assert two.uncertainty == pytest.approx(0.64 / 0.68)
    assert (three.value, three.uncertainty) == (True, pytest.approx(0.8))


def test_an_error_that_is_shared_is_not_averaged_out() -> None:
    """By hand: n readings of sigma 1, a shared error of 2: (4 + 1/n)^1/2; of two such origins 2^-1/2 of it."""
    often = [seen(origin, 50.0, 1.0, float(n)) for origin in (0, 1) for n in range(10)]
    for some, sigma in ((often[:10], 4.1**0.5), (often, (4.1 / 2.0) ** 0.5)):
        found = fused(NUMBER, some, shared=2.0)
        assert found is not None
        assert found.uncertainty == pytest.approx(sigma)


def test_an_old_observation_of_what_drifts_counts_less() -> None:
    """By hand: 9 s at 1 m/s^1/2 add 9 to the variance 1 of the first, so weights are 1/10 and 1."""
    told = [seen(0, 10.0, 1.0, 0.0), seen(1, 21.0, 1.0, 9.0)]
    found = fused(NUMBER, told, drift=1.0)
    assert found is not None
    assert found.value == pytest.approx((10.0 / 10.0 + 21.0) / 1.1)
    assert found.uncertainty == pytest.approx(1.1**-0.5)
    declared = fused(replace(NUMBER, drift=1.0), told)
    assert declared == found
    assert fused(replace(NUMBER, drift=1.0), told, drift=0.0) == fused(NUMBER, told)


DRIFTS, SHARED, NUMBERS = (0.0, 1.0), (0.0, 3.0), (1, 10, 30)
SIGMAS, BETWEEN_S, N_TRIALS = (4.0, 6.0, 8.0), 7.0, 1500


def simulated(draw: np.random.Generator, n_each: int, drift: float, shared: float) -> tuple[list[Observation], float]:
    """Observations of three vehicles in turn, and where the thing is at the time of the last."""
    at, told, own = 50.0, list[Observation](), draw.normal(0.0, 1.0, 3) * shared
    for number in range(3 * n_each):
        at += drift * math.sqrt(BETWEEN_S) * draw.normal() if number else 0.0
        sigma = SIGMAS[number % 3]
        told.append(seen(number % 3, at + own[number % 3] + sigma * draw.normal(), sigma, BETWEEN_S * number))
    return told, at


def least_squares(told: list[Observation], drift: float, shared: float) -> float:
    """The best linear estimate (Gauss, Markov, Aitken 1935), all at once, by the covariance of all errors."""
    times_s, origins = np.array([one.time_s for one in told]), np.array([one.origin for one in told])
    sigmas = np.array([one.fact.uncertainty for one in told])
    covariance = np.diag(sigmas**2) + shared**2 * (origins[:, None] == origins[None, :])
    covariance += drift**2 * (times_s[-1] - np.maximum(times_s[:, None], times_s[None, :]))
    weights = np.linalg.solve(covariance, np.ones(len(told)))
    return float(weights @ np.array([one.value for one in told]) / weights.sum())


@pytest.mark.parametrize("shared", SHARED)
@pytest.mark.parametrize("drift", DRIFTS)
@pytest.mark.parametrize("n_each", NUMBERS)
def test_the_estimate_is_the_best_there_is_and_its_deviation_is_true(n_each: int, drift: float, shared: float) -> None:
    """The normalised squared error of n trials is 1 where stated deviations are true, +- (2 / n)^1/2."""
    draw = np.random.default_rng(11)
    squares, best = list[float](), list[float]()
    of_stated = list[float]()
    for _ in range(N_TRIALS if n_each == 1 else N_TRIALS // 3):
        told, at = simulated(draw, n_each, drift, shared)
        found = fused(NUMBER, told, drift=drift, shared=shared)
        assert found is not None
        assert isinstance(found.value, float)
        assert found.value == pytest.approx(least_squares(told, drift, shared), abs=1e-6)
        squares.append((found.value - at) ** 2)
        best.append((least_squares(told, drift, shared) - at) ** 2)
        of_stated.append(squares[-1] / (found.uncertainty or math.inf) ** 2)
    assert sum(squares) <= 1.1**2 * sum(best)
    spread = 4.0 * (2.0 / len(of_stated)) ** 0.5
    assert 1.0 - spread <= sum(of_stated) / len(of_stated) <= 1.0 + spread


def test_a_model_that_is_wrong_states_a_wrong_deviation() -> None:
    """What drifts and is taken to be at rest is far from where its stated deviation has it."""
    draw = np.random.default_rng(12)
    of_stated = list[float]()
    for _ in range(300):
        told, at = simulated(draw, 10, 1.0, 0.0)
        found = fused(NUMBER, told)
        assert found is not None
        of_stated.append((float(found.value) - at) ** 2 / (found.uncertainty or math.inf) ** 2)  # type: ignore[arg-type]
    assert sum(of_stated) / 300 > 2.0


@pytest.mark.parametrize("given", [{"drift": -1.0}, {"drift": math.inf}, {"shared": -0.1}, {"shared": math.nan}])
def test_a_model_that_cannot_be_is_refused(given: dict[str, float]) -> None:
    with pytest.raises(FactError, match="allowed: 0 or more"):
        fused(NUMBER, [seen(0, 1.0, 1.0)], **given)


def test_of_sources_that_heard_of_each_other_the_most_certain_counts_alone() -> None:
    told = [seen(0, 10.0, 2.0), seen(1, 12.0, 1.0)]
    found = fused(NUMBER, told, independent=False)
    assert found is not None
    assert (found.value, found.uncertainty, found.origins) == (12.0, 1.0, (1,))
    found = fused(SYMBOL, [seen(0, 1, 0.8), seen(1, 1, 0.9)], independent=False)
    assert found is not None
    assert found.uncertainty == pytest.approx(0.9)


def test_without_any_uncertainty_the_newest_stands() -> None:
    found = fused(NUMBER, [seen(0, 10.0, None, 1.0), seen(1, 12.0, None, 2.0)])
    assert found is not None
    assert (found.value, found.uncertainty, found.time_s) == (12.0, None, 2.0)
    assert fused(NUMBER, []) is None


def test_a_value_that_nobody_can_weigh_is_left_out() -> None:
    found = fused(NUMBER, [seen(0, 10.0, 1.0, 1.0), seen(1, 99.0, None, 2.0)])
    assert found is not None
    assert (found.value, found.origins) == (10.0, (0,))


@pytest.mark.parametrize(
    ("attribute", "prior"), [(NUMBER, {1.0: 1.0}), (SYMBOL, {1: -1.0}), (SYMBOL, {}), (LINK, {5: 1.0})]
)
def test_a_bad_prior_is_refused(attribute: Attribute, prior: dict[Value, float]) -> None:
    with pytest.raises(FactError, match="allowed"):
        fused(attribute, [], prior)


def test_what_the_prior_rules_out_has_no_probability() -> None:
    found = fused(SYMBOL, [seen(0, 1, 0.8)], prior={2: 1.0, 3: 1.0})
    assert found is not None
    assert found.value in (2, 3)
    assert found.uncertainty == pytest.approx(0.5)


@given(
    st.lists(
        st.tuples(st.integers(0, 4), st.integers(0, 200), st.integers(1, 64), st.integers(0, 3)), min_size=1, max_size=9
    ),
    st.integers(0, 99),
)
def test_order_makes_no_difference(rows: list[tuple[int, int, int, int]], seed: int) -> None:
    """To the last bit: two vehicles that hold the same come to the same."""
    numbers = [seen(o, v / 2, s / 2, float(t)) for o, v, s, t in rows]
    symbols = [seen(o, v % 4, 0.05 + s / 80, float(t)) for o, v, s, t in rows]
    for attribute, observations in ((NUMBER, numbers), (SYMBOL, symbols)):
        distinct = list({(one.origin, one.time_s): one for one in observations}.values())
        shuffled = random.Random(seed).sample(distinct, len(distinct))
        assert fused(attribute, distinct) == fused(attribute, shuffled)


def test_the_ontology_says_what_may_be_uncertain() -> None:
    """Six bits for a standard deviation in steps of half a metre, five for a probability in steps of a twentieth."""
    location, classification = (TBOX.attribute_named(name) for name in ("location", "classification"))
    assert location.uncertainty == Field(0.5, 32.0, 0.5, location.fields[0].unit)
    assert classification.uncertainty == Field(0.05, 0.95, 0.05, "")
    assert (location.uncertainty.size_bits, classification.uncertainty.size_bits) == (6, 5)
    assert location.quantise_uncertainty(0.0) == 0.5  # nobody is quite certain
    assert classification.quantise_uncertainty(1.0) == 0.95
    with pytest.raises(ValueError, match="standard deviation"):
        location.quantise_uncertainty(33.0)
    with pytest.raises(TypeError, match="carry no uncertainty"):
        TBOX.attribute_named("position").quantise_uncertainty(1.0)
