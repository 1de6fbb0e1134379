"""Checks that many tables share, and the keys that features bring to the tables of scenarios.

A feature is a ``missions.feature.Feature``. It is ``Any`` here, for features know scenarios, not the other way round.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, TypeGuard, TypeVar

from pydantic import (
    create_model,
)

from missions.errors import ConfigurationFault
from remoras.table import Sparse
from worldmodel import suggestion

QUEUE_LIMIT = 10_000
"""Items in the queue of a vehicle, if a scenario does not say how many."""


def numbered(kind: str, number: int) -> tuple[str, ...]:
    """Names of so many things of a kind.

    >>> numbered("lift", 2)
    ('lift 1', 'lift 2')
    """
    return tuple(f"{kind} {n}" for n in range(1, number + 1))


def one_of(key: str, given: Any, allowed: Sequence[str]) -> Iterator[ConfigurationFault]:
    """A fault, with the nearest name, if a text is none of those allowed."""
    if isinstance(given, str) and given not in allowed:
        hint = suggestion(given, allowed)
        yield ConfigurationFault(key, f'"{given}"', f"allowed: {', '.join(allowed) or 'none'}{hint}")


def span_faults(key: str, from_s: float, until_s: float | None, end_s: float) -> Iterator[ConfigurationFault]:
    """Times from which and until when a table at ``key`` holds that cannot be; ``end_s``: of the mission."""
    if from_s >= end_s:
        allowed = f"must be below scenario.duration_s = {end_s:g}, when the mission is over"
        yield ConfigurationFault(f"{key}.from_s", "", allowed)
    if until_s is not None and until_s <= from_s:
        yield ConfigurationFault(f"{key}.until_s", "", f"must be above from_s = {from_s:g}")


def is_number(value: object) -> TypeGuard[float]:
    """True for a finite number, and no truth value."""
    return type(value) in (int, float) and math.isfinite(value)  # type: ignore[arg-type]


FOLDER = "missions.features"
Table = TypeVar("Table", bound=Sparse)


@cache
def features() -> dict[str, Any]:
    """The features that are there, by name, in the order of their names."""
    names = sorted(module.name for module in pkgutil.iter_modules(importlib.import_module(FOLDER).__path__))
    return {name: importlib.import_module(f"{FOLDER}.{name}").FEATURE for name in names}


def used_in(scenario: Sparse) -> tuple[Any, ...]:
    """The features that a scenario uses: one of their keys is not at its default. The others are asked for nothing.

    Args:
        scenario: the whole input; a malformed table of it uses none.
    """

    def says(place: str, key: str) -> bool:
        found = getattr(scenario, place, ()) if place else scenario
        tables = found if isinstance(found, list | tuple) else [found]
        defaults = ((table, type(table).model_fields[key].default) for table in tables)
        return any(getattr(table, key, default) != default for table, default in defaults)

    found = features().values()
    return tuple(
        feature for feature in found if any(says(place, key) for place in feature.keys for key in feature.keys[place])
    )


def slower_by(scenario: Sparse) -> tuple[float, str]:
    """The share by which vehicles may be slower than their data, and the key that says so."""
    return next((found for feature in used_in(scenario) if (found := feature.slower(scenario))[0]), (0.0, ""))


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
