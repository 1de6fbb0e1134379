"""Comparison: what the runs of a sweep say of strategies and policies.

``compare`` puts every treatment beside a baseline, ``ranks`` orders those that met the same conditions,
``effects`` says what the factors of a two-level study do. All take the
``SweepResults`` of ``missions.sweeps`` and are loaded when they are first used.
"""

from typing import TYPE_CHECKING

from exchange import lazily

if TYPE_CHECKING:
    from missions.comparison.baseline import compare
    from missions.comparison.effects import MainEffect, effects_of
    from missions.comparison.ranking import ranks
    from missions.comparison.rows import Comparison, Rank

__all__ = ["Comparison", "MainEffect", "Rank", "compare", "effects_of", "ranks"]
__getattr__ = lazily.loader(__name__, __file__)
