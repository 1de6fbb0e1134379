"""What all tables of a scenario or study share: their base, their commonest types, and how they are read raw.

Tables of scenarios take in the keys that features bring, whichever are there.

A feature is a ``missions.feature.Feature``. It is ``Any`` here, for features know scenarios, not the other way round.
"""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Annotated, Any, ClassVar, Self, TypeGuard, TypeVar, cast

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    create_model,
    model_serializer,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from missions.cards import card, number_text, own_names
from missions.document import BETWEEN_KEYS
from missions.errors import ConfigurationFault
from worldmodel import suggestion

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]
Name = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[^./\\\x00-\x1f=+@-][^./\\\x00-\x1f]*$")]
"""Files are named by it: it has no dot, no slash, no control character; and first nothing that makes a formula."""
PointM = tuple[float, float]
LONGEST_REPR = 120
"""Characters of a table in a terminal or notebook."""
QUEUE_LIMIT = 10_000
"""Items in the queue of a vehicle, if a scenario does not say how many."""


class Section(BaseModel):
    """A TOML table: frozen, and no key that is not listed here."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Keys whose values contradict other keys of the table, each with what is allowed; none by default."""
        yield from ()

    @model_validator(mode="after")
    def _in_itself(self) -> Self:
        """Refuse a table of which ``contradictions`` tells any."""
        found: list[InitErrorDetails] = [
            {
                "type": PydanticCustomError(BETWEEN_KEYS, "{allowed}", {"allowed": allowed}),
                "loc": (key,),
                "input": getattr(self, key, None),
            }
            for key, allowed in self.contradictions()
        ]
        if found:
            raise ValidationError.from_exception_data(type(self).__name__, found)
        return self

    @classmethod
    def usual(cls) -> Self:
        """A table of which nothing is said: defaults need no check, and so no validator, which takes time to make."""
        return cast(Self, cls.model_construct())

    def __repr__(self) -> str:
        """All of a small table; of a large one its name and size."""
        whole = super().__repr__()
        name = getattr(self, "name", "")
        named = f" {name}" if isinstance(name, str) and name else ""
        if len(whole) <= LONGEST_REPR:
            return whole
        return f"<{type(self).__name__}{named}: {len(self.model_fields_set)} keys set>"

    def _repr_html_(self) -> str:
        return card(type(self).__name__, ((name, _shown(getattr(self, name))) for name in type(self).model_fields))

    def __dir__(self) -> list[str]:
        return own_names(self)


def _shown(value: Any) -> str:
    return repr(value) if isinstance(value, BaseModel | tuple | dict) else number_text(value)


class Sparse(Section):
    """A table that is written without those of its keys in ``UNSAID`` that say nothing: what few files need is unseen
    in the others, and runs of these keep their id."""

    UNSAID: ClassVar[frozenset[str]] = frozenset()

    def of_feature(self, key: str) -> Any:
        """The value below a key that a feature brings, see ``missions.feature``; None if there is no such feature."""
        return getattr(self, key) if key in type(self).model_fields else None

    @model_serializer(mode="wrap")
    def _said(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        found: dict[str, Any] = handler(self)
        said = {key for key in self.UNSAID & found.keys() if getattr(self, key) != type(self).model_fields[key].default}
        return {key: value for key, value in found.items() if key not in self.UNSAID or (value and key in said)}


def unless(key: str, *needed: str) -> Callable[[dict[str, Any]], None]:
    """Let a JSON Schema of a table do without keys where another one is there, which brings them."""

    def either(schema: dict[str, Any]) -> None:
        schema["required"] = [key for key in schema.get("required", []) if key not in needed]
        schema["anyOf"] = [{"required": list(needed)}, {"required": [key]}]

    return either


def one_or_more(schema: dict[str, Any]) -> None:
    """Let a JSON Schema of a list take its one entry without the list, as validators of the table do."""
    listed = {key: schema.pop(key) for key in ("type", "items", "minItems", "anyOf") if key in schema}
    schema["anyOf"] = [listed["items"], listed]


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
