"""Variable-length integer codes, attribute names and field sizes of the wire format.

A number that does not fit its width is escaped: all ones, then the exact remainder. Each number has one encoding;
decoders refuse any other. Attributes that some vehicle needs have short names; an escape precedes the uid of others.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from exchange.errors import ConfigurationError, PeerFault
from worldmodel import Attribute, ValueKind


@dataclass(frozen=True, slots=True)
class FieldSize:
    """One line of the size listing; ``note`` has condition of presence, range or unit."""

    group: str
    field: str
    size_bits: int
    note: str = ""


def values_in_words(attribute: Attribute, n_values: Mapping[ValueKind, int]) -> str:
    """Describe an attribute's values; ``n_values`` has the numbers of instances and classes."""
    if attribute.kind in n_values:
        nouns = "instances" if attribute.kind is ValueKind.LINK else "classes"
        return f"one of {n_values[attribute.kind]} {nouns}"
    if attribute.symbols:
        return " or ".join(attribute.symbols)
    if attribute.most_bytes:
        return f"length of a text, then its bytes, at most {attribute.most_bytes}"
    ranges = [
        f"{field.minimum:g} to {field.maximum:g} {field.unit}".rstrip() + f", steps of {field.resolution:g}"
        for field in attribute.fields
    ]
    return "; ".join(dict.fromkeys(ranges)) or "true or false"


Bits = tuple[int, int]
"""A number and its size in bits."""
Take = Callable[[int], int]
"""Reads the given number of bits of a packet."""

LENGTH_BITS = 6
LARGEST = 1 << 50
"""Largest magnitude on the wire; a double still separates neighbouring grid steps."""


class Reader:
    """Bit reader, most significant bit first; skips ``n_read`` bits, ``left`` are unread.

    ``is_beyond`` is True once a number outside its attribute's range was read.
    """

    __slots__ = ("bits", "is_beyond", "left")

    def __init__(self, data: bytes, n_read: int = 0) -> None:
        self.bits = int.from_bytes(data, "big")
        self.left = 8 * len(data) - n_read
        self.is_beyond = False

    def take(self, size_bits: int) -> int:
        """Read a number; raise PeerFault at the end of the packet."""
        self.left = left = self.left - size_bits
        if left < 0:
            raise PeerFault("packet ends inside a field")
        return self.bits >> left & (1 << size_bits) - 1


def joined(*parts: Bits) -> Bits:
    """Concatenate bit strings.

    >>> joined((0b10, 2), (0b011, 3))
    (19, 5)
    """
    bits = size_bits = 0
    for part, part_bits in parts:
        bits, size_bits = bits << part_bits | part, size_bits + part_bits
    return bits, size_bits


def padded(string: Bits) -> bytes:
    """Convert a bit string to bytes, with zeros to a whole byte."""
    bits, size_bits = string
    padding = -size_bits % 8
    return (bits << padding).to_bytes((size_bits + padding) // 8, "big")


def width(n_values: int) -> int:
    """Bits that distinguish ``n_values`` values: 1 -> 0, 2 -> 1, 5 -> 3."""
    return (n_values - 1).bit_length()


def rest_of(number: int) -> Bits:
    """Encode a number >= 0 with its length first.

    >>> rest_of(0), rest_of(5)
    ((0, 6), (10, 8))
    """
    # Elias gamma code with the length in binary instead of unary.
    n_bits = (number + 1).bit_length() - 1
    return n_bits << n_bits | number + 1 - (1 << n_bits), LENGTH_BITS + n_bits


def read_rest(take: Take) -> int:
    """Decode ``rest_of``; raise PeerFault above ``LARGEST``."""
    n_bits = take(LENGTH_BITS)
    number = (1 << n_bits) + take(n_bits) - 1
    if number > LARGEST:
        raise PeerFault(f"number {number} is too large")
    return number


def natural(number: int, width_bits: int) -> Bits:
    """Encode a number >= 0 in its width; escape larger ones by all ones and the remainder.

    >>> natural(5, 3), natural(7, 3), natural(9, 3)
    ((5, 3), (448, 9), (899, 10))
    """
    ones = (1 << width_bits) - 1
    if number < ones:
        return number, width_bits
    if number > LARGEST:
        raise ConfigurationError(f"number {number} cannot be sent; allowed: 0 to {LARGEST}")
    rest, size_bits = rest_of(number - ones)
    return ones << size_bits | rest, width_bits + size_bits


def read_natural(take: Take, width_bits: int) -> int:
    """Decode ``natural``."""
    number = take(width_bits)
    return number if number != (1 << width_bits) - 1 else number + read_rest(take)


def whole(number: int, width_bits: int) -> Bits:
    """Encode a signed number in its width; escape negative and larger ones with a sign bit."""
    ones = (1 << width_bits) - 1
    if 0 <= number < ones:
        return number, width_bits
    if not -LARGEST <= number <= LARGEST:
        raise ConfigurationError(f"{number} steps cannot be sent; allowed: {-LARGEST} to {LARGEST}")
    # -1 maps to 0, so that each number has one code.
    rest, size_bits = rest_of(number - ones if number >= 0 else -number - 1)
    return ((ones << 1 | (number < 0)) << size_bits) | rest, width_bits + 1 + size_bits


def read_beyond(take: Take, width_bits: int) -> int:
    """Decode the remainder of an escaped ``whole`` number."""
    is_below = take(1)
    rest = read_rest(take)
    return -rest - 1 if is_below else rest + (1 << width_bits) - 1


class AttributeNames:
    """Wire names of attributes 0..n_attributes-1.

    Args:
        exchanged: uids with a short name; None for all.

    >>> names = AttributeNames(40, exchanged=(3, 5, 8))
    >>> names.sizes[5], names.sizes[6]
    (2, 8)
    """

    def __init__(self, n_attributes: int, exchanged: Collection[int] | None = None) -> None:
        self.exchanged = tuple(sorted(range(n_attributes) if exchanged is None else exchanged))
        """Uids in the order of their short names."""
        self.n_attributes = n_attributes
        self.has_others = len(self.exchanged) < n_attributes
        self.short_bits = width(len(self.exchanged) + self.has_others)
        self.other_bits = self.short_bits + width(n_attributes)
        short = {uid: name for name, uid in enumerate(self.exchanged)}
        escape = len(self.exchanged) << width(n_attributes)
        self.names = tuple(short.get(uid, escape | uid) for uid in range(n_attributes))
        """Encoded name by uid."""
        self.sizes = tuple(self.short_bits if uid in short else self.other_bits for uid in range(n_attributes))
        """Name size by uid (bits)."""

    def read_other(self, name: int, take: Take) -> int:
        """Return the uid behind an escape that replaces a short name; raise PeerFault if not canonical."""
        if not self.has_others or name > len(self.exchanged):
            raise PeerFault(f"attribute {name} is not in the TBox")
        uid = take(width(self.n_attributes))
        if uid >= self.n_attributes or uid in self.exchanged:
            raise PeerFault(f"attribute {uid} is not in the TBox, or has a short name")
        return uid
