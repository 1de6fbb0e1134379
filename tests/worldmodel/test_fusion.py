"""Fusion against published check values, and invariants for any observations."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_fleet import TBOX

from worldmodel import Attribute, Block, FactError, Observation, PropertyValue, Value, ValueKind, fused
from worldmodel.ontology.fields import Field

NUMBER = Attribute(1, "depth", "rm:depth", 0, ValueKind.NUMBER, (Field(0, 100, 0.5, "m"),))
POINT = Attribute(1, "place", "rm:place", 0, ValueKind.POINT, (Field(0, 100, 0.5, "m"),) * 2)
SYMBOL = Attribute(1, "kind", "rm:kind", 0, ValueKind.SYMBOL, symbols=("unknown", "wreck", "pipeline", "anomaly"))
TRUTH = Attribute(1, "leaks", "rm:leaks", 0, ValueKind.BOOLEAN)
LINK = Attribute(1, "near", "rm:near", 0, ValueKind.LINK, range_class=0)


def seen(origin: int, value: Value, uncertainty: float | None, time_s: float = 0.0) -> Observation:
    return Observation(Block(origin, 0, time_s, (PropertyValue(7, 1, value, uncertainty),)), 0)


OFTEN = [seen(origin, 50.0, 1.0, float(n)) for origin in (0, 1) for n in range(10)]
LOOKS = [seen(0, True, 0.8, 1.0), seen(0, True, 0.8, 2.0), seen(0, False, 0.8, 3.0)]
AT_TWO_TIMES = [seen(0, 10.0, 1.0, 0.0), seen(1, 21.0, 1.0, 9.0)]
BY_HAND = {
    # Taylor, An Introduction to Error Analysis, 2nd edition, section 7.2, to more digits than 11.42 and 0.69
    "three readings": (NUMBER, [seen(0, 11.0, 1.0), seen(1, 12.0, 1.0), seen(2, 10.0, 3.0)], {}, 217 / 19, 3 / 19**0.5),
    # weights 1 and 1/4: east (10 + 12/4) / 1.25, north (20 + 40/4) / 1.25
    "axes of a point": (POINT, [seen(0, (10.0, 20.0), 1.0), seen(1, (12.0, 40.0), 2.0)], {}, (10.4, 24.0), 1.25**-0.5),
    # Bayes: a rare truth, and a test that is right in nine of ten: 0.01 * 0.9 against 0.99 * 0.1
    "a rare truth": (TRUTH, [seen(0, True, 0.9)], {"prior": {True: 0.01, False: 0.99}}, False, 11 / 12),
    "one look": (SYMBOL, [seen(0, 1, 0.8)], {}, 1, 0.8),
    "two agree": (SYMBOL, [seen(0, 1, 0.8), seen(1, 1, 0.8)], {}, 1, 0.64 / (0.64 + 3 * (0.2 / 3) ** 2)),
    "two differ": (SYMBOL, [seen(0, 1, 0.9), seen(1, 2, 0.7)], {}, 1, 0.09 / (0.09 + 0.07 / 3 + 2 * 0.01 / 3)),
    "a prior rules it out": (SYMBOL, [seen(0, 1, 0.8)], {"prior": {2: 1.0}}, 2, 1.0),
    "the surest alone": (SYMBOL, [seen(0, 1, 0.8), seen(1, 1, 0.9)], {"independent": False}, 1, 0.9),
    "anything else has the rest": (LINK, [seen(0, 5, 0.6)], {}, 5, 0.6),
    "looks of one origin": (TRUTH, LOOKS[:2], {}, True, 0.64 / 0.68),
    "a look that differs": (TRUTH, LOOKS, {}, True, 0.8),
    "ten readings": (NUMBER, [seen(0, float(n), 1.0, float(n)) for n in range(10)], {}, 4.5, 10**-0.5),
    "ten with a shared error": (NUMBER, OFTEN[:10], {"shared": 2.0}, 50.0, 4.1**0.5),
    "two such origins": (NUMBER, OFTEN, {"shared": 2.0}, 50.0, 2.05**0.5),
    # 9 s at 1 m/s^1/2 add 9 to the variance 1 of the first, so weights are 1/10 and 1
    "drift": (NUMBER, AT_TWO_TIMES, {"drift": 1.0}, 22.0 / 1.1, 1.1**-0.5),
    "declared drift": (replace(NUMBER, drift=1.0), AT_TWO_TIMES, {}, 22.0 / 1.1, 1.1**-0.5),
    # 15 s after the last observation the variance has grown by 15
    "predicted": (NUMBER, AT_TWO_TIMES, {"drift": 1.0, "at_s": 24.0}, 22.0 / 1.1, (1.0 / 1.1 + 15.0) ** 0.5),
    "the surest alone, predicted": (
        NUMBER, AT_TWO_TIMES, {"drift": 1.0, "at_s": 24.0, "independent": False}, 21.0, 16.0**0.5,
    ),
    "asked of the past": (NUMBER, AT_TWO_TIMES, {"drift": 1.0, "at_s": 3.0}, 22.0 / 1.1, 1.1**-0.5),
    "no weights": (NUMBER, [seen(0, 10.0, None, 1.0), seen(1, 12.0, None, 2.0)], {}, 12.0, None),
    "one without weight": (NUMBER, [seen(0, 10.0, 1.0, 1.0), seen(1, 99.0, None, 2.0)], {}, 10.0, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", BY_HAND)
def test_estimates_equal_results_computed_by_hand(name: str) -> None:
    attribute, told, given, value, uncertainty = BY_HAND[name]
    found = fused(attribute, told, **given)  # type: ignore[arg-type]
    assert (found.value, found.uncertainty) == (pytest.approx(value), pytest.approx(uncertainty))
    assert fused(attribute, []) is None


DRIFTS, SHARED, NUMBERS = (0.0, 1.0), (0.0, 3.0), (1, 10)
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
def test_estimate_equals_least_squares_and_states_its_true_deviation(n_each: int, drift: float, shared: float) -> None:
    """The normalised squared error of n trials is 1 where stated deviations are true, +- (2 / n)^1/2."""
    draw = np.random.default_rng(11)
    squares, best = list[float](), list[float]()
    of_stated = list[float]()
    for _ in range(N_TRIALS if n_each == 1 else N_TRIALS // 3):
        told, at = simulated(draw, n_each, drift, shared)
        found = fused(NUMBER, told, drift=drift, shared=shared)
        assert isinstance(found.value, float)
        assert found.value == pytest.approx(least_squares(told, drift, shared), abs=1e-6)
        squares.append((found.value - at) ** 2)
        best.append((least_squares(told, drift, shared) - at) ** 2)
        of_stated.append(squares[-1] / (found.uncertainty or math.inf) ** 2)
    assert sum(squares) <= 1.1**2 * sum(best)
    spread = 4.0 * (2.0 / len(of_stated)) ** 0.5
    assert 1.0 - spread <= sum(of_stated) / len(of_stated) <= 1.0 + spread


@pytest.mark.parametrize("given", [{"drift": -1.0}, {"drift": math.inf}, {"shared": -0.1}, {"shared": math.nan}])
def test_invalid_drift_or_shared_error_is_refused(given: dict[str, float]) -> None:
    with pytest.raises(FactError, match="allowed: 0 or more"):
        fused(NUMBER, [seen(0, 1.0, 1.0)], **given)


@pytest.mark.parametrize(
    ("attribute", "prior"), [(NUMBER, {1.0: 1.0}), (SYMBOL, {1: -1.0}), (SYMBOL, {}), (LINK, {5: 1.0})]
)
def test_a_bad_prior_is_refused(attribute: Attribute, prior: dict[Value, float]) -> None:
    with pytest.raises(FactError, match="allowed"):
        fused(attribute, [], prior)


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


def test_ontology_defines_range_and_step_of_uncertainties() -> None:
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
