"""Comparison of strategies and policies from the runs of a sweep (``SweepResults``)."""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from missions.comparison.baseline import Comparison, compare
    from missions.comparison.effects import MainEffect, effects_of
    from missions.comparison.ranking import Rank, ranks

__all__ = ["Comparison", "MainEffect", "Rank", "compare", "effects_of", "ranks"]
__getattr__ = lazily.loader(__name__, __file__)
