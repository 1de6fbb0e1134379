"""Uncertainty of a value: a presence bit, then an index on the attribute's grid.

Only attributes that declare such a grid have the field.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from exchange.errors import PeerFault
from exchange.wire.codes import Bits, FieldSize
from worldmodel import Attribute


def uncertainty_bits(attribute: Attribute, uncertainty: float | None) -> Bits:
    """Encode an uncertainty; None for absent."""
    grid = attribute.uncertainty
    if grid is None or uncertainty is None:
        return 0, 1
    return 1 << grid.size_bits | attribute.encode_uncertainty(uncertainty), 1 + grid.size_bits


def read(attribute: Attribute, take: Callable[[int], int]) -> float | None:
    """Decode an uncertainty, None if absent; raise PeerFault if invalid."""
    grid = attribute.uncertainty
    if grid is None or not take(1):
        return None
    try:
        return grid.decode(take(grid.size_bits))
    except ValueError as error:
        raise PeerFault(f"uncertainty of {attribute.name}: {error}") from None


def uncertainty_lines(attributes: Iterable[Attribute]) -> list[FieldSize]:
    """List the uncertainty fields."""
    return [
        FieldSize(
            "fact", f"uncertainty of {attribute.name}", 1 + attribute.uncertainty.size_bits, "1 where it carries none"
        )
        for attribute in attributes
        if attribute.uncertainty is not None
    ]
