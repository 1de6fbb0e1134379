"""What an installation takes does not grow unseen."""

from benchmarks.install import NAME, closure, own_mb, required


def test_what_is_required_is_what_is_said() -> None:
    """Both figures stand in ``docs/decisions.md``; the goals of 9 packages and 450 MB are not met."""
    assert len(required(NAME)) <= 12
    sizes = closure(NAME)
    required_here = {"mesa", "scipy", "pyarrow", "pydantic-core"}
    assert {*required_here, "numba"} & set(sizes) == required_here
    assert 300.0 < sum(sizes.values()) + own_mb() <= 510.0
