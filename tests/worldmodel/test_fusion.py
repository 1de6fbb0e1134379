"""Fusion against check values with their source, and laws that hold for any observations."""

import random

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


def test_of_one_origin_the_newest_counts_alone() -> None:
    """Ten readings of one sensor are as good as one: its errors are the same in all."""
    often = [seen(0, float(n), 1.0, float(n)) for n in range(10)]
    found = fused(NUMBER, often)
    assert found is not None
    assert (found.value, found.uncertainty) == (9.0, 1.0)


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
