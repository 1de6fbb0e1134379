"""Features of scenarios: keys that they add to tables, and effects on vehicles and water.

A feature is ``Any`` here, since its hooks take scenarios, which depend on this module.
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from multiprocessing import parent_process
from typing import Any, TypeVar

from pydantic import create_model

from remoras.errors import PluginError
from remoras.plugins import faults_of, installed_plugins, named_object, refuse
from remoras.table import Sparse

FOLDER = "missions.features"
Table = TypeVar("Table", bound=Sparse)


@cache  # 0.3 s of imports, asked by each check
def features() -> dict[str, Any]:
    """Return the shipped features by name, sorted, then installed ones by reference."""
    names = sorted(module.name for module in pkgutil.iter_modules(importlib.import_module(FOLDER).__path__))
    known = {name: importlib.import_module(f"{FOLDER}.{name}").FEATURE for name in names}
    plugins = [plugin for plugin in installed_plugins() if plugin.kind == "feature"]
    for plugin in plugins:
        # A faulty one affects no scenario: its keys are unknown.
        try:
            twice = [other.reference for other in plugins if other.name == plugin.name and other != plugin]
            refuse("its name", [f"{text} has it, too" for text in (*twice, *{plugin.name} & known.keys())])
            known[plugin.reference] = _accepted(named_object(plugin.reference), known.values())
        except PluginError as error:
            if parent_process() is None:  # workers would repeat the line
                print(f"remoras: feature {plugin.name} is left out, {plugin}: {error}", file=sys.stderr)
    return known


def _accepted(feature: Any, known: Iterable[Any]) -> Any:
    members = ("keys", "observer", "checks", "metrics", "last_metrics", "states", "for_all")
    refuse("no missions.feature.Feature", faults_of(feature, type(feature), members))
    taken = {(place, key) for other in known for place in other.keys for key in other.keys[place]}
    own = ((place, key) for place in feature.keys for key in feature.keys[place])
    refuse("its keys", [f"{key} is one of another feature" for place, key in own if (place, key) in taken])
    return feature


def names_used_in(scenario: Sparse) -> tuple[str, ...]:
    """Return the names of the features with a key off its default."""

    def says(place: str, key: str) -> bool:
        value = getattr(scenario, place) if place else scenario
        tables = value if isinstance(value, tuple) else [value]
        return any(getattr(table, key) != type(table).model_fields[key].default for table in tables)

    return tuple(
        name
        for name, feature in features().items()
        if any(says(place, key) for place in feature.keys for key in feature.keys[place])
    )


def used_in(scenario: Sparse) -> tuple[Any, ...]:
    """Return the features with a key off its default."""
    return tuple(features()[name] for name in names_used_in(scenario))


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
