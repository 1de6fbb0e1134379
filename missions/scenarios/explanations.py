"""Explanations of the keys of scenarios and studies, derived from their tables."""

from __future__ import annotations

from enum import Enum
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from missions.document import table_within
from missions.fault import kinds
from missions.files import shipped_abouts, toml_value
from missions.scenarios.faults import KEY, DeclaredFault, users_of_keys
from missions.scenarios.parts import mission_class
from missions.scenarios.scenario import Scenario


def _limit(constraint: Any) -> str:
    words = {"above": ["gt"], "below": ["lt"], "at least": ["ge", "min_length"], "at most": ["le", "max_length"]}
    return ", ".join(
        f"{text} {getattr(constraint, name):g}"
        for text, names in words.items()
        for name in names
        if hasattr(constraint, name)
    )


def explanations_of(root: type[BaseModel], prefix: str = "") -> dict[str, tuple[str, str]]:
    """Return (type, range and default; meaning) of every key, dotted, with nested tables."""
    entries: dict[str, tuple[str, str]] = {}
    for name, info in root.model_fields.items():
        if (nested := table_within(info.annotation)) is not None:
            entries |= explanations_of(nested, f"{prefix}{name}.")
            continue
        limits = [text for m in info.metadata if (text := _limit(m))]
        default = [] if info.is_required() or info.default is None else [f"default {toml_value(info.default)}"]
        optional = [] if info.is_required() or info.default is not None else ["may be left out"]
        text = ", ".join([_in_words(info.annotation), *limits, *default, *optional])
        entries[prefix + name] = (text, info.description or "")
    return entries


def _in_words(annotation: Any) -> str:
    """Describe a type as in a TOML file.

    >>> _in_words(tuple[str, ...] | None), _in_words(tuple[float, float]), _in_words(dict[str, Annotated[int, "> 0"]])
    ('list of texts', 'list of 2 numbers', 'table of whole numbers')
    >>> _in_words(tuple[Literal["top", "bottom"], Literal["left", "right"]])
    'list of 2: one of "top", "bottom"; then one of "left", "right"'
    """
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _in_words(arguments[0])
    if origin is Literal:
        return f"one of {', '.join(map(toml_value, arguments))}"
    if origin in (Union, UnionType):
        return " or ".join(_in_words(kind) for kind in arguments if kind is not NoneType)
    if origin in (tuple, list):
        several = origin is tuple and len(arguments) > 1 and arguments[-1] is not Ellipsis
        words = [_in_words(argument) for argument in arguments if argument is not Ellipsis]
        if several and len({*arguments}) > 1:
            return f"list of {len(arguments)}: {'; then '.join(words)}"
        inner = f"{_plural(words[0])}{_each(arguments[0])}" if arguments else "values"
        return f"list of {len(arguments)} {inner}" if several else f"list of {inner}"
    if origin is dict:
        return "table" if arguments[1] is Any else f"table of {_plural(_in_words(arguments[1]))}"
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return f"one of {', '.join(toml_value(member.value) for member in annotation)}"
    return WORDS.get(annotation, "value")


def _each(annotation: Any) -> str:
    if get_origin(annotation) is not Annotated:
        return ""
    constraints = [part for part in get_args(annotation)[1:] if isinstance(part, FieldInfo)]
    limits = [text for info in constraints for part in info.metadata if (text := _limit(part))]
    return f", each {', '.join(limits)}" if limits else ""


def _plural(words: str) -> str:
    first, joint, rest = words.partition(" of ")
    return f"{first}s{joint}{rest}"


WORDS: dict[Any, str] = {
    str: "text", bool: "true or false", int: "whole number", float: "number", Any: "value", dict: "table",
}  # fmt: skip


def schema_of(root: type[BaseModel], title: str) -> dict[str, Any]:
    """Return a JSON Schema of files described by a model, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **root.model_json_schema(), "title": title}


def explanations() -> dict[str, tuple[str, str]]:
    """Return (type and range, meaning) of every key of a scenario; list entries without names."""
    entries = explanations_of(Scenario)
    for mission in {mission_class(header["mission"]): None for header in shipped_abouts().values()}:
        entries |= explanations_of(mission.Scenario)
        for kind in mission.sensors.values():
            entries |= explanations_of(kind, "vehicle.sensor.")
    return entries | _of_faults()


def _of_faults() -> dict[str, tuple[str, str]]:
    own = {name: explanations_of(kind, f"{KEY}.") for name, kind in kinds().items()}
    entries = {}
    for key, users in users_of_keys().items():
        text, meaning = own[users[0]][f"{KEY}.{key}"]
        entries[f"{KEY}.{key}"] = text, f"of kind{'s' * (len(users) > 1)} {' and '.join(users)}: {meaning}"
    texts = "; ".join(f"{name}: {kind.TEXT}" for name, kind in kinds().items())
    description = DeclaredFault.model_fields["kind"].description
    known = f"one of {', '.join(map(toml_value, kinds()))}, or package.module:Class"
    return {**entries, f"{KEY}.kind": (known, f"{description}. {texts}")}
