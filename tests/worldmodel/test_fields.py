import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from worldmodel.ontology.fields import Field, Grid


@pytest.mark.parametrize(
    ("minimum", "maximum", "resolution", "bits"),
    [(0, 1000, 0.1, 14), (0, 86399, 1, 17), (0, 63, 1, 6)],  # DCCL 3 documentation, notes/exchange
)
def test_sizes_follow_dccl(minimum: float, maximum: float, resolution: float, bits: int) -> None:
    assert Field(minimum, maximum, resolution, "").size_bits == bits


fields = st.builds(
    lambda low, steps, step, power: Field(
        float(f"{low}e-{power}"), float(f"{low + steps * step}e-{power}"), float(f"{step}e-{power}"), "m"
    ),
    st.integers(-(10**6), 10**6),
    st.integers(1, 10**6),
    st.integers(1, 25),
    st.integers(0, 7),
)


@given(fields, st.data())
def test_encoding_and_decoding_return_the_same_index(field: Field, data: st.DataObject) -> None:
    index = data.draw(st.integers(0, field.n_values - 1))
    value = field.decode(index)
    assert field.encode(value) == index
    assert field.quantise(value) == value
    assert field.n_values <= 2**field.size_bits < 2 * field.n_values


@given(fields, st.data())
def test_quantising_moves_a_value_by_half_a_step_at_most(field: Field, data: st.DataObject) -> None:
    value = data.draw(st.floats(field.minimum, field.maximum))
    slack = 4 * math.ulp(max(abs(field.minimum), abs(field.maximum)))
    assert abs(field.quantise(value) - value) <= field.resolution / 2 + slack
    assert field.minimum <= field.quantise(value) <= field.maximum


def test_decoded_decimal_is_the_nearest_double() -> None:
    assert [Grid(0.0, 0.1).value_at(i) for i in (1, 3, 7, 12345)] == [0.1, 0.3, 0.7, 1234.5]


@pytest.mark.parametrize("value", [-0.01, 1.01, math.inf, -math.inf, math.nan])
def test_out_of_range_names_the_range(value: float) -> None:
    with pytest.raises(ValueError, match=r"outside \[0, 1\] m"):
        Field(0, 1, 0.01, "m").encode(value)


def test_value_that_is_no_number_and_index_out_of_range_are_refused() -> None:
    with pytest.raises(TypeError, match="True is not a number"):
        Field(0, 1, 0.01, "").encode(True)
    with pytest.raises(ValueError, match=r"index 101 is outside 0\.\.100"):
        Field(0, 1, 0.01, "").decode(101)


@pytest.mark.parametrize(
    ("bounds", "reason"),
    [
        ((0, 1, 0), "above zero"),
        ((1, 1, 1), "above minimum"),
        ((0, 1, 0.3), "whole number of resolutions"),
        ((0, math.inf, 1), "finite"),
        ((1e9, 1e9 + 1, 1e-7), "too fine"),
    ],
)
def test_impossible_bounds_are_refused(bounds: tuple[float, float, float], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Field(*bounds, unit="")


def test_a_grid_needs_a_step() -> None:
    with pytest.raises(ValueError, match="the step above zero"):
        Grid(0.0, 0.0)
