"""Comparison of strategies and policies from the runs of a sweep.

``compare`` sets every treatment against a baseline, ``ranks`` orders treatments of equal conditions, ``effects_of``
estimates the effects of factors in two-level studies. All take ``SweepResults`` of ``missions.sweeps`` and are loaded
on first use.
"""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from missions.comparison.baseline import Comparison, compare
    from missions.comparison.effects import MainEffect, effects_of
    from missions.comparison.ranking import Rank, ranks

__all__ = ["Comparison", "MainEffect", "Rank", "compare", "effects_of", "ranks"]
__getattr__ = lazily.loader(__name__, __file__)
