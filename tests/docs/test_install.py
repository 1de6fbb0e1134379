"""The requirements of an installation do not grow unnoticed."""

from benchmarks.install import NAME, closure, own_mb, required


def test_declared_requirements_equal_the_documented_ones() -> None:
    """Both figures stand in ``docs/decisions.md``; the goal of 400 MB is not met."""
    assert len(required(NAME)) <= 11
    sizes = closure(NAME)
    required_here = {"mesa", "scipy", "pyarrow", "pydantic-core"}
    assert {*required_here, "numba"} & set(sizes) == required_here
    assert 300.0 < sum(sizes.values()) + own_mb() <= 500.0
