"""Conformance test of the strategy; needs the package hypothesis."""

from remoras.testing import conforms


def test_nearest():
    assert list(conforms("strategy", "nearest:NEAREST"))
