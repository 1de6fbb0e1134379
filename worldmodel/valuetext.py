"""Exact text form of values in tables, and its parser.

Numbers by ``repr``, points as ``POINT (east north)``, classes by name, linked instances by uid and name: ``3 bay``.
"""

from typing import cast

from worldmodel.facts import PropertyValue
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import Attribute, TBox, ValueKind
from worldmodel.store import Store


def stored_as_text(model: Store, attribute: Attribute, stored: Value) -> str:
    """Return a stored value as text that ``from_text`` restores exactly."""
    match attribute.kind:
        case ValueKind.TYPE:
            return model.tbox.classes[cast(int, stored)].name
        case ValueKind.LINK:
            instance = model.instance(cast(int, stored))
            return f"{stored} {instance.name if instance is not None else ''}".rstrip()
        case ValueKind.SYMBOL:
            return attribute.symbols[cast(int, stored)]
        case ValueKind.TEXT:
            return cast(str, stored)
        case ValueKind.POINT:
            east, north = cast(tuple[float, float], stored)
            return f"POINT ({east!r} {north!r})"
        case ValueKind.BOOLEAN:
            return str(stored).lower()
        case ValueKind.NUMBER:
            return repr(stored)


def uncertainty_as_text(fact: PropertyValue) -> str:
    """Return an uncertainty as exact text; empty if None."""
    return "" if fact.uncertainty is None else repr(fact.uncertainty)


def uncertainty_from_text(text: str) -> float | None:
    """Parse a text of ``uncertainty_as_text``; raises ValueError for any other text."""
    return float(text) if text else None


def from_text(tbox: TBox, attribute: Attribute, text: str) -> Value:
    """Parse a text of ``stored_as_text``; raises ValueError or UnknownNameError otherwise."""
    match attribute.kind:
        case ValueKind.TYPE:
            return tbox.class_named(text).uid
        case ValueKind.LINK:
            return int(text.partition(" ")[0])
        case ValueKind.SYMBOL:
            return attribute.symbols.index(text)
        case ValueKind.TEXT:
            return text
        case ValueKind.POINT:
            east, north = text.removeprefix("POINT (").removesuffix(")").split()
            return (float(east), float(north))
        case ValueKind.BOOLEAN:
            return ("false", "true").index(text) == 1
        case ValueKind.NUMBER:
            return float(text)
