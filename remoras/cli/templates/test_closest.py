"""Conformance test of the metric."""

from closest import CLOSEST

from remoras.testing import check_metric


def test_closest():
    check_metric(CLOSEST)
