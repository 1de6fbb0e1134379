"""The size listing of a packet: every field with its bits, and what it may be in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from exchange.wire.names import AttributeNames
from worldmodel import Attribute, ValueKind


@dataclass(frozen=True, slots=True)
class FieldSize:
    """One line of the size listing.

    Attributes:
        group: `packet`, `fragment`, `fact`, `signal` or `summary`: the part that the field belongs to.
        field: its name, in the order of the wire.
        size_bits: its size.
        note: when it is there, its range or its unit.
    """

    group: str
    field: str
    size_bits: int
    note: str = ""


def values_in_words(attribute: Attribute, n_values: Mapping[ValueKind, int]) -> str:
    """What a value of the attribute may be; ``n_values`` has the numbers of instances and classes."""
    if attribute.kind in n_values:
        of = "instances" if attribute.kind is ValueKind.LINK else "classes"
        return f"one of {n_values[attribute.kind]} {of}"
    if attribute.symbols:
        return " or ".join(attribute.symbols)
    if attribute.most_bytes:
        return f"length of a text, then its bytes, at most {attribute.most_bytes}"
    ranges = [
        f"{field.minimum:g} to {field.maximum:g} {field.unit}".rstrip() + f", steps of {field.resolution:g}"
        for field in attribute.fields
    ]
    return "; ".join(dict.fromkeys(ranges)) or "true or false"


def value_lines(
    attributes: Sequence[Attribute], value_bits: Sequence[int], n_values: Mapping[ValueKind, int]
) -> list[FieldSize]:
    """Lines of the size listing for the values of attributes."""
    return [
        FieldSize("fact", attribute.name, bits, values_in_words(attribute, n_values))
        for attribute, bits in zip(attributes, value_bits, strict=True)
    ]


def name_fields(names: AttributeNames) -> list[FieldSize]:
    """The lines of an attribute's name: a short one, and that of those which are not exchanged, if there are any."""
    fields = [FieldSize("fact", "attribute", names.short_bits, f"one of {len(names.exchanged)} exchanged")]
    if names.has_others:
        fields.append(FieldSize("fact", "other attribute", names.other_bits, f"one of {names.n_attributes} in all"))
    return fields
