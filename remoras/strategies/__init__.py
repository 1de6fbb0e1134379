"""Organisational strategies, one module each; a module that has a ``STRATEGY`` is one.

Adding a strategy is adding a file here, or naming ``package.module:object`` in a scenario.
"""

from __future__ import annotations

import importlib
import pkgutil

from remoras.strategies.strategy import Evidence, Strategy

__all__ = ["Evidence", "Strategy", "strategies"]


def strategies() -> dict[str, Strategy]:
    """The shipped strategies by name."""
    found: dict[str, Strategy] = {}
    for module_info in pkgutil.iter_modules(__path__):
        module = importlib.import_module(f"{__name__}.{module_info.name}")
        strategy: Strategy | None = getattr(module, "STRATEGY", None)
        if strategy is not None:
            found[strategy.name] = strategy
    return dict(sorted(found.items()))
