"""Numbers, attribute names and facts as bits.

A time or sequence that does not fit its width is escaped: all ones, then the exact remainder. Each number has one
encoding; decoders refuse any other. Attributes that some vehicle needs have short names; an escape precedes the uid of
others.

A fact is subject, attribute, value and optional uncertainty. A value takes ``ceil(log2((max - min) / resolution + 1))``
bits, the rule of DCCL; if they are all ones, 7 zeros follow. One out of range has no encoding. A text is its length in
bytes, then UTF-8.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

from exchange.errors import ConfigurationError, PeerFault
from exchange.policy.planning import width
from worldmodel import Attribute, PropertyValue, TBox, Value, ValueKind


@dataclass(frozen=True, slots=True)
class FieldSize:
    """One line of the size listing; ``note`` has condition of presence, range or unit."""

    group: str
    field: str
    size_bits: int
    note: str = ""


Bits = tuple[int, int]
"""A number and its size in bits."""
Take = Callable[[int], int]
"""Reads the given number of bits of a packet."""

ONES_BITS = 7
"""Zeros behind a number of all ones; another continuation is reserved for numbers out of range, which are refused."""
LENGTH_BITS = 6
LARGEST = 1 << 50
"""Largest magnitude on the wire; a double still separates neighbouring grid steps."""


class Reader:
    """Bit reader, most significant bit first; skips ``n_read`` bits, ``left`` are unread."""

    __slots__ = ("bits", "left")

    def __init__(self, data: bytes, n_read: int = 0) -> None:
        self.bits = int.from_bytes(data, "big")
        self.left = 8 * len(data) - n_read

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
            raise PeerFault(f"attribute {uid} is not in the TBox, or has a short code")
        return uid


CACHED = 4096
"""Cached encodings of fact sets, which relays send again."""


class FactCodec:
    """Fact codec of one fleet; ``exchanged`` attributes get short names, None for all."""

    def __init__(self, tbox: TBox, n_instances: int, exchanged: Collection[int] | None) -> None:
        self.attributes = tbox.attributes
        self.n_instances = n_instances
        self.subject_bits = width(n_instances)
        self.names = AttributeNames(len(tbox.attributes), exchanged)
        self.latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self._n_values = {ValueKind.LINK: n_instances, ValueKind.TYPE: len(tbox.classes)}
        self._layouts = [self._layout_of(attribute) for attribute in tbox.attributes]
        self.of_all = lru_cache(maxsize=CACHED)(self._of_all)
        """Encode facts, each followed by a continuation bit; return also whether all are latest-only (cached)."""

    def _layout_of(self, attribute: Attribute) -> list[tuple[int, int, int]]:
        """Return size (bits), number of codes and code before ``ONES_BITS`` (-1 for none) of each number of a value."""
        if attribute.fields:
            return [(field.size_bits, field.n_values, (1 << field.size_bits) - 1) for field in attribute.fields]
        n_values = self._n_values.get(attribute.kind) or len(attribute.symbols) or 2
        if attribute.kind is ValueKind.TEXT:
            n_values = attribute.most_bytes + 1  # its length stands first
        return [(width(n_values), n_values, -1)]

    def listing(self) -> list[FieldSize]:
        """List the fields of a fact in wire order."""
        names, fields = self.names, [("subject", self.subject_bits, f"one of {self.n_instances} instances")]
        fields.append(("attribute", names.short_bits, f"one of {len(names.exchanged)} exchanged"))
        if names.has_others:
            fields.append(("other attribute", names.other_bits, f"one of {names.n_attributes} in all"))
        for attribute, layout in zip(self.attributes, self._layouts, strict=True):
            note = "length, then " + attribute.in_words if attribute.most_bytes else attribute.in_words
            if attribute.kind in self._n_values:
                nouns = "instances" if attribute.kind is ValueKind.LINK else "classes"
                note = f"one of {self._n_values[attribute.kind]} {nouns}"
            fields.append((attribute.name, sum(bits for bits, *_ in layout), note))
        for attribute in self.attributes:
            if (grid := attribute.uncertainty) is not None:
                fields.append((f"uncertainty of {attribute.name}", 1 + grid.size_bits, "1 where it carries none"))
        fields.append(("another follows", 1, "of all but own single facts"))
        return [FieldSize("fact", *field) for field in fields]

    def exchanged_texts(self) -> list[Attribute]:
        """Return the text attributes that are exchanged."""
        return [self.attributes[uid] for uid in self.names.exchanged if self.attributes[uid].most_bytes]

    # To bits -------------------------------------------------------------------------------------

    def _of_all(self, facts: Sequence[PropertyValue]) -> tuple[int, int, bool]:
        bits, size_bits, are_latest_only = 0, 0, True
        for fact in facts:
            part, part_bits = self._of_one(fact)
            bits, size_bits = (bits << part_bits | part) << 1 | 1, size_bits + part_bits + 1
            are_latest_only = are_latest_only and fact.attribute in self.latest_only
        return bits & ~1, size_bits, are_latest_only

    def _of_one(self, fact: PropertyValue) -> Bits:
        """Encode a fact; raise ConfigurationError if it has no wire format."""
        subject, uid, value, sigma = fact
        if not 0 <= subject < self.n_instances:
            raise ConfigurationError(f"instance {subject} cannot be sent; allowed: 0 to {self.n_instances - 1}")
        attribute, parts = self.attributes[uid], [(subject, self.subject_bits)]
        parts += (self.names.names[uid], self.names.sizes[uid]), self._value(attribute, value)
        if (grid := attribute.uncertainty) is not None:
            parts.append((int(sigma is not None), 1))
            if sigma is not None:
                parts.append((attribute.encode_uncertainty(sigma), grid.size_bits))
        elif sigma is not None:
            raise ConfigurationError(f"{attribute.name}: its values carry no uncertainty, not {sigma}")
        return joined(*parts)

    def _value(self, attribute: Attribute, value: Value) -> Bits:
        try:
            numbers = attribute.encode(value)
        except (TypeError, ValueError) as error:
            raise ConfigurationError(f"{attribute.name}: {error}") from None
        text, text_bits = 0, 0
        if attribute.most_bytes:  # behind a leading 1
            text, text_bits = numbers[0], numbers[0].bit_length() - 1
            numbers = (text_bits // 8,)
        bits = size_bits = 0
        for number, (width_bits, n_values, ones) in zip(numbers, self._layouts[attribute.uid], strict=True):
            if number >= n_values:
                raise ConfigurationError(f"{attribute.name}: {number} is outside 0..{n_values - 1}")
            bits, size_bits = bits << width_bits | number, size_bits + width_bits
            if number == ones:
                bits, size_bits = bits << ONES_BITS, size_bits + ONES_BITS
        return bits << text_bits | text & (1 << text_bits) - 1, size_bits + text_bits

    # From bits -----------------------------------------------------------------------------------

    def read_all(self, reader: Reader) -> tuple[PropertyValue, ...]:
        """Decode facts up to a continuation bit of 0."""
        facts = [self.read_one(reader)]
        while reader.take(1):
            facts.append(self.read_one(reader))
        return tuple(facts)

    def read_one(self, reader: Reader) -> PropertyValue:
        """Decode the next fact; raise PeerFault if invalid."""
        names = self.names
        word = reader.take(self.subject_bits + names.short_bits)
        subject, name = word >> names.short_bits, word & (1 << names.short_bits) - 1
        uid = names.exchanged[name] if name < len(names.exchanged) else names.read_other(name, reader.take)
        if subject >= self.n_instances:
            raise PeerFault(f"instance {subject} is not one of {self.n_instances}")
        attribute = self.attributes[uid]
        value, grid = self._read_value(attribute, reader), attribute.uncertainty
        if grid is None or not reader.take(1):
            return PropertyValue(subject, uid, value)
        try:
            return PropertyValue(subject, uid, value, grid.decode(reader.take(grid.size_bits)))
        except ValueError as error:
            raise PeerFault(f"uncertainty of {attribute.name}: {error}") from None

    def _read_value(self, attribute: Attribute, reader: Reader) -> Value:
        numbers = []
        for size_bits, n_values, ones in self._layouts[attribute.uid]:
            number = reader.take(size_bits)
            if number >= n_values or (number == ones and reader.take(ONES_BITS)):
                raise PeerFault(f"{attribute.name} has code {number}, out of its range 0..{n_values - 1}")
            numbers.append(number)
        if attribute.most_bytes:
            numbers = [1 << 8 * numbers[0] | reader.take(8 * numbers[0])]
        try:
            return attribute.decode(numbers)
        except ValueError as error:
            raise PeerFault(f"{attribute.name}: {error}") from None
