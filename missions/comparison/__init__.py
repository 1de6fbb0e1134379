"""Comparison: what the runs of a sweep say of strategies and policies.

``compare`` puts every treatment beside a baseline, ``ranks`` orders those that met the same conditions,
``effects`` says what the factors of a two-level study do. All take the
``SweepResults`` of ``missions.sweeps`` and are loaded when they are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from missions.comparison.baseline import compare
    from missions.comparison.effects import MainEffect, effects_of
    from missions.comparison.ranking import ranks
    from missions.comparison.rows import Comparison, Rank

__all__ = ["Comparison", "MainEffect", "Rank", "compare", "effects_of", "ranks"]

_HOMES = {
    "compare": "baseline", "ranks": "ranking", "effects_of": "effects", "Comparison": "rows", "Rank": "rows",
    "MainEffect": "effects",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
