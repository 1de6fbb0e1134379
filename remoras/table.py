"""Base and common types of TOML tables as values, and their display in notebooks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Self, TypeVar, cast

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from worldmodel import suggestion

BETWEEN_KEYS = "between_keys"
"""Error type of keys that contradict each other."""
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]
Name = Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[^./\\\x00-\x1f=+@-][^./\\\x00-\x1f]*$")]
"""Name usable in file names: no dot, slash or control character, no formula sign first."""
PointM = tuple[float, float]


def _rising(ends: PointM) -> PointM:
    if ends[0] >= ends[1]:
        raise ValueError("allowed: the lower end first")
    return ends


RISING = AfterValidator(_rising)
SpanM = Annotated[PointM, RISING]
LONGEST_REPR = 120


class Section(BaseModel):
    """TOML table: frozen, without unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    def contradictions(self) -> Iterator[tuple[str, str]]:
        """Yield keys whose values contradict others, each with the allowed ones."""
        yield from ()

    @model_validator(mode="after")
    def _in_itself(self) -> Self:
        errors: list[InitErrorDetails] = [
            {
                "type": PydanticCustomError(BETWEEN_KEYS, "{allowed}", {"allowed": allowed}),
                "loc": (key,),
                "input": getattr(self, key, None),
            }
            for key, allowed in self.contradictions()
        ]
        if errors:
            raise ValidationError.from_exception_data(type(self).__name__, errors)
        return self

    @classmethod
    def usual(cls) -> Self:
        """Return the default table without validation, which would build a validator."""
        return cast(Self, cls.model_construct())

    def __repr__(self) -> str:
        """Return the full repr of a small table; name and size of a large one."""
        whole = super().__repr__()
        name = getattr(self, "name", "")
        named = f" {name}" if isinstance(name, str) and name else ""
        if len(whole) <= LONGEST_REPR:
            return whole
        return f"<{type(self).__name__}{named}: {len(self.model_fields_set)} keys set>"

    def _repr_html_(self) -> str:
        return card(type(self).__name__, ((name, _shown(getattr(self, name))) for name in type(self).model_fields))


def _shown(value: Any) -> str:
    return repr(value) if isinstance(value, BaseModel | tuple | dict) else number_text(value)


class Sparse(Section):
    """Table serialised without keys of ``UNSAID`` at their defaults, so that run ids stay equal."""

    UNSAID: ClassVar[frozenset[str]] = frozenset()

    def of_feature(self, key: str) -> Any:
        """Return the value of a feature's key (``missions.feature``); None without the feature."""
        return getattr(self, key) if key in type(self).model_fields else None

    @model_serializer(mode="wrap")
    def _said(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        table: dict[str, Any] = handler(self)
        kept = {key for key in self.UNSAID & table.keys() if getattr(self, key) != type(self).model_fields[key].default}
        return {key: value for key, value in table.items() if key not in self.UNSAID or (value and key in kept)}


def unless(key: str, *needed: str) -> Callable[[dict[str, Any]], None]:
    """Relax required keys of a JSON Schema where another key replaces them."""

    def either(schema: dict[str, Any]) -> None:
        schema["required"] = [key for key in schema.get("required", []) if key not in needed]
        schema["anyOf"] = [{"required": list(needed)}, {"required": [key]}]

    return either


def _one_or_more(schema: dict[str, Any]) -> None:
    """Allow a single entry in place of a list in a JSON Schema, as validators do."""
    listed = {key: schema.pop(key) for key in ("type", "items", "minItems", "anyOf") if key in schema}
    schema["anyOf"] = [listed["items"], listed]


def _listed(value: Any) -> Any:
    return (value,) if isinstance(value, str | dict) else tuple(value) if isinstance(value, list) else value


Item = TypeVar("Item")
OneOrMore = Annotated[tuple[Item, ...], BeforeValidator(_listed), Field(json_schema_extra=_one_or_more)]
"""List in which a single entry needs no brackets."""


# Notebook display ---------------------------------------------------------------------------------

LONGEST_TEXT = 160
MOST_ROWS = 60
"""Maximum rows; a line gives the number of others."""


def card(title: str, rows: Iterable[tuple[str, ...]], note: str = "") -> str:
    """Return HTML with a title, a table of texts and a note."""
    from html import escape  # needed by notebooks only

    listed = [tuple(_cut(text) for text in row) for row in rows]
    more = [f"and {len(listed) - MOST_ROWS} more"] if len(listed) > MOST_ROWS else []
    lines = "".join(_row(*map(escape, row)) for row in listed[:MOST_ROWS])
    notes = "".join(f"<p>{escape(text)}</p>" for text in [*more, *([note] if note else [])])
    return f"<div><strong>{escape(title)}</strong><table>{lines}</table>{notes}</div>"


def _row(first: str, *others: str) -> str:
    style = ' style="text-align:left"'
    return f"<tr><th{style}>{first}</th>{''.join(f'<td>{text}</td>' for text in others)}</tr>"


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 3]}..."


def number_text(value: Any) -> str:
    """Return a value as text; numbers to six digits."""
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return f"{value:.6g}" if isinstance(value, float) else str(value)


class Figures(dict[str, Any]):
    """Figures of a run by name, displayed as a table with units, read only for display."""

    def __init__(self, values: Mapping[str, Any], units: Callable[[], Mapping[str, str]] = dict) -> None:
        super().__init__(values)
        self._units = units

    def __missing__(self, name: str) -> Any:
        raise KeyError(f"no figure {name!r}{suggestion(name, self)}")

    def _repr_html_(self) -> str:
        units = self._units()
        shown = {name: value for name, value in self.items() if not isinstance(value, list | dict)}
        return card("Figures", ((name, number_text(value), units.get(name, "")) for name, value in shown.items()))


class Records(list[dict[str, Any]]):
    """Records of one kind in order, displayed as a table."""

    def _repr_html_(self) -> str:
        keys = list(self[0]) if self else []
        return card(" · ".join(keys), (tuple(number_text(record[key]) for key in keys) for record in self))
