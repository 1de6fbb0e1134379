"""The strategy keeps to what every strategy has to keep to; needs the package hypothesis."""

from remoras.testing import conforms


def test_nearest():
    assert list(conforms("strategy", "nearest:NEAREST"))
