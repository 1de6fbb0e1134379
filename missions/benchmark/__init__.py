"""Benchmark: comparison of a strategy with others on a fixed suite of cases.

>>> from missions.benchmark import suite_named
>>> len(suite_named("fathom-2").cells)
48
"""

from missions.benchmark.suite import Cell, Suite, suite_named

__all__ = ["Cell", "Suite", "suite_named"]
