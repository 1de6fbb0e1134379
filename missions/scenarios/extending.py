"""Tables of scenarios take in the keys that features bring, whichever are there.

A feature is a ``missions.feature.Feature``. It is ``Any`` here, for features know scenarios, not the other way round.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeVar

from pydantic import create_model

from missions.scenarios.tables import Raw, Sparse

FOLDER = "missions.features"
Table = TypeVar("Table", bound=Sparse)


@cache
def features() -> dict[str, Any]:
    """The features that are there, by name, in the order of their names."""
    names = sorted(module.name for module in pkgutil.iter_modules(importlib.import_module(FOLDER).__path__))
    return {name: importlib.import_module(f"{FOLDER}.{name}").FEATURE for name in names}


def named_in(raw: Raw) -> list[Any]:
    """The features of which a scenario has a key, by its raw tables."""

    def has(place: str, key: str) -> bool:
        table = raw.get(place) if place else raw
        tables = table if isinstance(table, list) else [table]
        return any(isinstance(table, dict) and key in table for table in tables)

    return [
        feature
        for feature in features().values()
        if any(has(place, key) for place in feature.keys for key in feature.keys[place])
    ]


def used_in(scenario: Sparse) -> tuple[Any, ...]:
    """The features that a scenario uses: one of their keys is not at its default. The others are asked for nothing.

    Args:
        scenario: the whole input.
    """

    def says(place: str, key: str) -> bool:
        table = getattr(scenario, place) if place else scenario
        tables = table if isinstance(table, list | tuple) else [table]
        return any(getattr(table, key) != type(table).model_fields[key].default for table in tables)

    found = features().values()
    return tuple(
        feature for feature in found if any(says(place, key) for place in feature.keys for key in feature.keys[place])
    )


def slower_by(raw: Raw) -> tuple[Any, str]:
    """The share by which vehicles may be slower than their data, and the key that says so; not checked yet."""
    return next((found for feature in named_in(raw) if (found := feature.slower(raw))[0]), (0.0, ""))


def place_error_m(scenario: Sparse, vehicles: Sequence[Any]) -> float | None:
    """How far off these vehicles may take themselves to be in the time in which they learn their place (m).

    Args:
        scenario: the whole input.
        vehicles: their data.

    Returns:
        None where vehicles know where they are.
    """
    errors_m = (feature.place_error_m(scenario, vehicles) for feature in used_in(scenario))
    return max((error for error in errors_m if error is not None), default=None)


def locating(scenario: Sparse) -> frozenset[str]:
    """Names of the vehicles near which others learn where they are."""
    return frozenset(name for feature in used_in(scenario) for name in feature.locating(scenario))


def water(scenario: Sparse) -> Any:
    """How the water moves; None where it stands.

    Args:
        scenario: the whole input.

    Returns:
        The table of the feature by which it does: ``foretold()`` is None or has ``at(depth_m, now_s)``, the velocity by
        the plan (m/s, east and north); ``surges(seed)`` what no plan knows of.
    """
    return next((found for feature in used_in(scenario) if (found := feature.water(scenario)) is not None), None)


def with_features(table: str) -> Callable[[type[Table]], type[Table]]:
    """Let a table take in what features bring to it: a decorator of its class.

    Args:
        table: as features call it, see ``missions.feature.Feature.keys``.
    """

    def extended(base: type[Table]) -> type[Table]:
        keys: dict[str, Any] = {}
        for feature in features().values():
            keys |= feature.keys.get(table, {})
        if not keys:
            return base
        name, module, text = base.__name__, base.__module__, base.__doc__
        made: type[Table] = create_model(name, __base__=base, __module__=module, __doc__=text, **keys)
        made.UNSAID = base.UNSAID | {key for key in keys if made.model_fields[key].default is not True}
        return made

    return extended
