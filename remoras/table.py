"""Tables of TOML files as values: their base, and their commonest types.

A table that the model uses is defined beside the equations that use it; a scenario is composed of such tables.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any, ClassVar, Self, cast

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from remoras.cards import card, number_text, own_names

BETWEEN_KEYS = "between_keys"
"""Type of the errors of keys that contradict each other, in words for the user."""
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]
Name = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[^./\\\x00-\x1f=+@-][^./\\\x00-\x1f]*$")]
"""Files are named by it: it has no dot, no slash, no control character; and first nothing that makes a formula."""
PointM = tuple[float, float]
LONGEST_REPR = 120
"""Characters of a table in a terminal or notebook."""


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
