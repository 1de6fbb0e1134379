"""The uncertainty of a value on the wire: a bit, and an index on the attribute's grid.

Only attributes that declare such a grid have it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from exchange.errors import PeerFault
from exchange.wire.codes import Bits, FieldSize
from worldmodel import Attribute


def uncertainty_bits(attribute: Attribute, uncertainty: float | None) -> Bits:
    """``(bits, size_bits)`` of the uncertainty of a value, or of its lack."""
    grid = attribute.uncertainty
    if grid is None or uncertainty is None:
        return 0, 1
    return 1 << grid.size_bits | attribute.encode_uncertainty(uncertainty), 1 + grid.size_bits


def read(attribute: Attribute, take: Callable[[int], int]) -> float | None:
    """The uncertainty that comes next, ``take(size_bits)`` by its bits; raises PeerFault if it cannot be one."""
    grid = attribute.uncertainty
    if grid is None or not take(1):
        return None
    try:
        return grid.decode(take(grid.size_bits))
    except ValueError as error:
        raise PeerFault(f"uncertainty of {attribute.name}: {error}") from None


def uncertainty_lines(attributes: Iterable[Attribute]) -> list[FieldSize]:
    """Lines of the size listing for uncertainties."""
    return [
        FieldSize(
            "fact", f"uncertainty of {attribute.name}", 1 + attribute.uncertainty.size_bits, "1 where it carries none"
        )
        for attribute in attributes
        if attribute.uncertainty is not None
    ]
