"""The metric keeps to what every metric has to keep to."""

from closest import CLOSEST

from remoras.testing import check_metric


def test_closest():
    check_metric(CLOSEST)
