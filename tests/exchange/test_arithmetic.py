"""The elementary functions against those of the C library, whose own error is below one unit in the last place."""

import math
import random
from collections.abc import Callable
from statistics import NormalDist
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange import arithmetic
from exchange.arithmetic import PI, atan2, erfc, exp, expm1, length, log, log1p, log10, normal_quantile

from exchange.arithmetic import expm1_of, power, power_of_10, sincos  # isort: skip

LIBRARY_ULP = 1.0
draw = random.Random(1).uniform
near_1 = [lambda: (1.0 + draw(-1.0, 1.0) * 10.0 ** draw(-10.0, -1.0),)]
wide = [lambda: (10.0 ** draw(-300.0, 300.0),), lambda: (draw(0.4, 2.5),)]
angles = [
    lambda: (draw(-7.0, 7.0),), lambda: (draw(-6e6, 6e6),),
    lambda: (round(draw(-20.0, 20.0)) * math.pi / 2.0 * (1.0 + draw(-1e-9, 1e-9)),),
]  # fmt: skip
vectors = [lambda: (draw(-1.0, 1.0) * 10.0 ** draw(-3.0, 3.0), draw(-1.0, 1.0) * 10.0 ** draw(-3.0, 3.0))]

Case = tuple[Callable[..., float], Callable[..., float], float, list[Callable[[], tuple[float, ...]]]]
CASES: dict[str, Case] = {
    "exp": (exp, math.exp, 0.6, [lambda: (draw(-700.0, 700.0),), lambda: (draw(-2.0, 2.0),)]),
    "expm1": (
        expm1, math.expm1, 3.0,
        [lambda: (draw(-40.0, 40.0),), lambda: (draw(-1.0, 1.0) * 10.0 ** draw(-12.0, 0.0),)],
    ),
    "log": (log, math.log, 0.8, wide + near_1),
    "log1p": (log1p, math.log1p, 1.5, [lambda: (10.0 ** draw(-30.0, 30.0),), lambda: (-(10.0 ** draw(-20.0, -0.1)),)]),
    "log10": (log10, math.log10, 2.5, wide),
    "power_of_10": (
        power_of_10, lambda x: math.pow(10.0, x), 3.5,
        [lambda: (draw(-30.0, 30.0),), lambda: (draw(-1.0, 1.0),)],
    ),
    "sine": (lambda x: sincos(x)[0], math.sin, 2.5, angles),
    "cosine": (lambda x: sincos(x)[1], math.cos, 2.5, angles),
    "atan2": (atan2, math.atan2, 1.6, vectors),
    "length": (length, math.hypot, 1.2, vectors),
    "erfc": (erfc, math.erfc, 6.0, [lambda: (draw(-3.0, 26.0),), lambda: (draw(0.0, 3.0),)]),
}  # fmt: skip
"""By name: ours, the library's, the error that the module states, and what arguments are drawn from."""


@pytest.mark.parametrize("name", CASES)
def test_function_errors_stay_within_stated_bounds(name: str) -> None:
    """10,000 arguments of each kind; those just beside zeros, too."""
    ours, library, most_ulp, kinds = CASES[name]
    assert f"{name} {most_ulp}" in " ".join((arithmetic.__doc__ or "").split())
    for kind in kinds:
        for _ in range(10_000):
            arguments = kind()
            expected = library(*arguments)
            assert abs(ours(*arguments) - expected) <= (most_ulp + LIBRARY_ULP) * math.ulp(expected), arguments


def test_quantiles_are_those_of_the_standard_library() -> None:
    for _ in range(10_000):
        share = draw(0.0, 1.0) ** 4
        assert normal_quantile(share) == pytest.approx(NormalDist().inv_cdf(share), rel=2e-15, abs=1e-16)


@pytest.mark.parametrize(
    ("ours", "argument", "expected"),
    [
        (exp, 0.0, 1.0), (exp, math.inf, math.inf), (exp, -math.inf, 0.0), (exp, 800.0, math.inf), (exp, -800.0, 0.0),
        (expm1, 0.0, 0.0), (expm1, -math.inf, -1.0), (expm1, math.inf, math.inf), (expm1, 5e-324, 5e-324),
        (log, 1.0, 0.0), (log, math.inf, math.inf), (log1p, 0.0, 0.0), (log1p, math.inf, math.inf),
        (log1p, 1.0, log(2.0)),
        (log10, 1.0, 0.0), (log10, 10.0, 1.0),
        (power_of_10, 0.0, 1.0), (power_of_10, -7.0, 1e-7), (erfc, 0.0, 1.0), (erfc, math.inf, 0.0),
        (erfc, -math.inf, 2.0), (normal_quantile, 0.5, 0.0),
    ],
)  # fmt: skip
def test_exact_results_are_exact(ours: Callable[[float], float], argument: float, expected: float) -> None:
    assert ours(argument) == expected


@pytest.mark.parametrize("ours", [exp, expm1, log, log1p, log10, erfc])
def test_nan_stays_nan(ours: Callable[[float], float]) -> None:
    assert math.isnan(ours(math.nan))


@pytest.mark.parametrize(
    ("ours", "argument"),
    [(log, 0.0), (log, -1.0), (log1p, -1.0), (log10, -3.0), (sincos, 1e7), (sincos, math.inf),
     (sincos, math.nan), (normal_quantile, 0.0), (normal_quantile, 1.0)],
)  # fmt: skip
def test_arguments_outside_the_domain_are_refused(ours: Callable[[float], Any], argument: float) -> None:
    with pytest.raises(ValueError, match=r"expected$"):
        ours(argument)


@given(
    st.lists(
        st.sampled_from([0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, 5e-324, -1e308, 1e-300]), min_size=2, max_size=2
    )
)
def test_angles_of_the_axes_and_of_extremes_have_the_right_sign(vector: list[float]) -> None:
    y, x = vector
    assert atan2(y, x) == math.atan2(y, x)
    assert math.copysign(1.0, atan2(y, x)) == math.copysign(1.0, y)


def test_constants_are_those_of_the_standard_library() -> None:
    assert (math.pi, math.tau, math.log(2.0), math.log(10.0)) == (PI, arithmetic.TAU, arithmetic.LN2, arithmetic.LN10)


@given(st.floats(0.0, 2.0), st.integers(0, 40))
def test_powers_are_products(base: float, n: int) -> None:
    assert power(base, n) == pytest.approx(math.prod([base] * n), rel=1e-14, abs=1e-300)


@given(st.lists(st.floats(-50.0, 50.0), max_size=5))
def test_array_results_equal_scalar_results(several: list[float]) -> None:
    assert expm1_of(several) == [expm1(x) for x in several]
