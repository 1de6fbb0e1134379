"""Coarse values on the wire: a bit before a value says whether it is a number of steps of the coarse grid.

Only attributes that declare a coarse grid have it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from exchange.wire.codes import Bits, FieldSize, Reader
from worldmodel import Attribute, Value
from worldmodel.coarse import is_coarse


def detail_writer(
    attribute: Attribute, fine: Callable[[Any], Bits], coarse: Callable[[Any], Bits]
) -> Callable[[Value], Bits]:
    """``write(value) -> (bits, size_bits)`` by the grid that a value is on.

    Args:
        attribute: with a coarse grid.
        fine, coarse: writers by either grid.
    """

    def write(value: Value) -> Bits:
        bits, size_bits = fine(value)
        if not is_coarse(attribute, value):
            return bits, 1 + size_bits
        bits, size_bits = coarse(value)
        return 1 << size_bits | bits, 1 + size_bits

    return write


def reader(fine: Callable[[Reader], Value], coarse: Callable[[Reader], Value]) -> Callable[[Reader], Value]:
    """``read(reader) -> value``, as ``detail_writer`` writes it."""
    return lambda bits: coarse(bits) if bits.take(1) else fine(bits)


def detail_lines(attributes: Iterable[Attribute]) -> list[FieldSize]:
    """Lines of the size listing for coarse values."""
    sizes = {
        attribute.name: sum(field.size_bits for field in attribute.coarse)
        for attribute in attributes
        if attribute.coarse
    }
    return [FieldSize("fact", f"{name}, coarse", bits, "in its place; a bit says so") for name, bits in sizes.items()]
