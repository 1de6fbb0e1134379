"""Attributes compiled to functions, for the two paths that every fact takes: recording and merging.

``Attribute.quantise`` explains what is wrong with a value; a compiled function only says that something is.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

from worldmodel.bans import Bans, deciding
from worldmodel.ontology.fields import Field, bytes_of
from worldmodel.ontology.tbox import Attribute, TBox, ValueKind

Quantise = Callable[[Any], Any]
"""Returns the value as it is stored, or None for one that a closer look has to judge."""

MOST_SHARED = 1 << 16
"""The number of steps up to which the values of a field are kept and shared by all facts."""

NO_CLASS = -1


class AttributeRow(NamedTuple):
    """One attribute: how its values are stored, and the classes that it asks of subject and target."""

    quantise: Quantise
    domain: int
    range_class: int


class CompiledAttributes:
    """The compiled attributes of one TBox; ``rows`` has them by uid, all but those that need a closer look."""

    def __init__(self, tbox: TBox) -> None:
        self._tbox = tbox
        self.rows = {
            attribute.uid: AttributeRow(
                _quantiser(attribute),
                attribute.domain,
                NO_CLASS if attribute.range_class is None else attribute.range_class,
            )
            for attribute in tbox.attributes
            if attribute.kind is not ValueKind.TYPE
        }
        self.unpacked = {uid: (row.quantise, row.domain, row.range_class) for uid, row in self.rows.items()}
        """The rows as bare tuples, which are unpacked faster."""
        self.latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self.deciding = deciding(tbox)
        """The attributes whose values decide who is believed."""
        followed = tbox.rules.heeded | self.deciding
        self.unlinked = frozenset(
            uid for uid, row in self.rows.items() if row.range_class == NO_CLASS and uid not in followed
        )
        """The attributes of whose values nothing follows: no links, no bans, none that a definition asks for."""
        self.plain = {
            uid: (row.quantise, row.domain)
            for uid, row in self.rows.items()
            if uid in self.unlinked and uid not in self.latest_only
        }
        """By uid, how values are stored and the class asked of the subject; without links and status."""
        self.statuses = {
            uid: (row.quantise, row.domain)
            for uid, row in self.rows.items()
            if uid in self.unlinked and uid in self.latest_only
        }
        """The same for attributes of which only the latest value counts."""
        below = [sum(1 << d for d in tbox.subclasses(c.uid)) for c in tbox.classes]
        self._descendants = tuple(below)

    def trust(self) -> Bans:
        """Return what a vehicle knows of who is believed, before it has heard anything: all are."""
        return Bans(self._tbox)

    def have_common_subclass(self, c: int, d: int) -> bool:
        """True if something may be of both classes by one of its types."""
        return bool(self._descendants[c] & self._descendants[d])

    def __reduce__(self) -> tuple[Callable[[TBox], "CompiledAttributes"], tuple[TBox]]:
        return compiled_attributes, (self._tbox,)


@lru_cache(maxsize=8)
def compiled_attributes(tbox: TBox) -> CompiledAttributes:
    """Return the compiled attributes of an ontology, the same for all its world models."""
    return CompiledAttributes(tbox)


def _quantiser(attribute: Attribute) -> Quantise:
    match attribute.kind:
        case ValueKind.NUMBER:
            return _number(attribute.fields[0])
        case ValueKind.POINT:
            return _point(*attribute.fields)
        case ValueKind.BOOLEAN:
            return lambda value: value if value is True or value is False else None
        case ValueKind.SYMBOL:
            return _index(len(attribute.symbols))
        case ValueKind.TEXT:
            return _text(attribute.most_bytes)
        case _:
            return _index(math.inf)


def _index(n_indices: float) -> Quantise:
    return lambda value: value if type(value) is int and 0 <= value < n_indices else None


def _text(most_bytes: int) -> Quantise:
    def quantise(value: Any) -> str | None:
        try:
            bytes_of(value, most_bytes)
        except (TypeError, ValueError):
            return None
        text: str = value
        return text

    return quantise


def _number(field: Field) -> Quantise:
    low, high, step = field.minimum, field.maximum, field.resolution
    value_at: Callable[[int], float] = field.grid.value_at
    n_shared = field.n_values if field.n_values <= MOST_SHARED else 0
    shared: list[float | None] = []  # made when the first value comes: few attributes of an ontology are used

    def of_few(value: Any) -> float | None:
        if (type(value) is not float and type(value) is not int) or not low <= value <= high:
            return None
        index: int = round((value - low) / step)
        try:
            stored = shared[index]
        except IndexError:
            shared.extend([None] * n_shared)
            stored = None
        if stored is None:
            shared[index] = stored = value_at(index)
        return stored

    def of_many(value: Any) -> float | None:
        if (type(value) is not float and type(value) is not int) or not low <= value <= high:
            return None
        return value_at(round((value - low) / step))

    return of_few if n_shared else of_many


def _point(east: Field, north: Field) -> Quantise:
    west, x_end, x_step = east.minimum, east.maximum, east.resolution
    south, y_end, y_step = north.minimum, north.maximum, north.resolution
    x_first, x_ticks, x_denominator = east.grid.whole_numbers
    y_first, y_ticks, y_denominator = north.grid.whole_numbers

    def quantise(value: Any) -> tuple[float, float] | None:
        if type(value) is not tuple or len(value) != 2:
            return None
        x, y = value
        if (type(x) is not float and type(x) is not int) or (type(y) is not float and type(y) is not int):
            return None
        if not (west <= x <= x_end and south <= y <= y_end):
            return None
        return (
            (x_first + round((x - west) / x_step) * x_ticks) / x_denominator,
            (y_first + round((y - south) / y_step) * y_ticks) / y_denominator,
        )

    return quantise
