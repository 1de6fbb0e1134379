"""Features of scenarios: keys that they add to tables, and effects on vehicles and water.

A feature (``missions.feature.Feature``) is ``Any`` here, since features depend on scenarios, not vice versa.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeVar

from pydantic import create_model

from remoras.table import Sparse

FOLDER = "missions.features"
Table = TypeVar("Table", bound=Sparse)


@cache  # 0.3 s of imports, asked by each check
def features() -> dict[str, Any]:
    """Return the existing features by name, sorted."""
    names = sorted(module.name for module in pkgutil.iter_modules(importlib.import_module(FOLDER).__path__))
    return {name: importlib.import_module(f"{FOLDER}.{name}").FEATURE for name in names}


def used_in(scenario: Sparse) -> tuple[Any, ...]:
    """Return the features with a key off its default."""

    def says(place: str, key: str) -> bool:
        value = getattr(scenario, place) if place else scenario
        tables = value if isinstance(value, tuple) else [value]
        return any(getattr(table, key) != type(table).model_fields[key].default for table in tables)

    known = features().values()
    return tuple(
        feature for feature in known if any(says(place, key) for place in feature.keys for key in feature.keys[place])
    )


def slower_by(scenario: Sparse) -> tuple[float, str]:
    """Return the greatest relative loss of speed, and the key that sets it."""
    return next((loss for feature in used_in(scenario) if (loss := feature.slower(scenario))[0]), (0.0, ""))


def place_error_m(scenario: Sparse, vehicles: Sequence[Any]) -> float | None:
    """Greatest error (m) of these vehicles before a fix; None without navigation error."""
    errors_m = (feature.place_error_m(scenario, vehicles) for feature in used_in(scenario))
    return max((error for error in errors_m if error is not None), default=None)


def locating(scenario: Sparse) -> frozenset[str]:
    """Return the vehicles near which others get a position fix."""
    return frozenset(name for feature in used_in(scenario) for name in feature.locating(scenario))


def water(scenario: Sparse) -> Any:
    """Return the table of moving water; None for still water.

    ``foretold()`` is the planned current or None, ``at(depth_m, now_s)`` its velocity (m/s, east and north);
    ``surges(seed)`` are unknown to plans.
    """
    return next((table for feature in used_in(scenario) if (table := feature.water(scenario)) is not None), None)


def with_features(table: str) -> Callable[[type[Table]], type[Table]]:
    """Decorate a table class with the keys of features; ``table`` as in ``Feature.keys``."""

    def extended(base: type[Table]) -> type[Table]:
        keys: dict[str, Any] = {}
        for feature in features().values():
            keys |= feature.keys.get(table, {})
        if not keys:
            return base
        name, module, text = base.__name__, base.__module__, base.__doc__
        made: type[Table] = create_model(name, __base__=base, __module__=module, __doc__=text, **keys)
        # A feature that is off by default leaves the resolved text of other scenarios unchanged.
        made.UNSAID = base.UNSAID | {key for key in keys if made.model_fields[key].default is not True}
        return made

    return extended
