"""The uncertainty of a value on the wire: a bit, and an index on the attribute's grid; nothing for most attributes."""

from __future__ import annotations

from collections.abc import Callable

from exchange.errors import PeerFault
from worldmodel import Attribute, PropertyValue


def uncertainty_of(attribute: Attribute, fact: PropertyValue) -> tuple[int, int]:
    """``(bits, size_bits)`` of what a value carries: nothing for most attributes, else a bit and its index."""
    if attribute.uncertainty is None:
        return 0, 0
    if fact.uncertainty is None:
        return 0, 1
    size_bits = attribute.uncertainty.size_bits
    return 1 << size_bits | attribute.encode_uncertainty(fact.uncertainty), 1 + size_bits


def read_uncertainty(attribute: Attribute, take: Callable[[int], int]) -> float | None:
    """The uncertainty that comes next, ``take(size_bits)`` by its bits; raises PeerFault if it cannot be one."""
    grid = attribute.uncertainty
    if grid is None or not take(1):
        return None
    try:
        return grid.decode(take(grid.size_bits))
    except ValueError as error:
        raise PeerFault(f"uncertainty of {attribute.name}: {error}") from None
