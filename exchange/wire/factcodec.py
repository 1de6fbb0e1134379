"""Fact codec: subject, attribute, value and optional uncertainty.

A number takes ``ceil(log2((max - min) / resolution + 1))`` bits, the rule of DCCL. Numbers out of range, or encoded as
all ones, are escaped and exact (`exchange.wire.codes`). A text is its length in bytes, then UTF-8.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import lru_cache, partial
from typing import Any

from exchange.errors import ConfigurationError, PeerFault
from exchange.wire.codes import (
    LARGEST,
    AttributeNames,
    Bits,
    FieldSize,
    Reader,
    Take,
    joined,
    read_beyond,
    values_in_words,
    whole,
    width,
)
from worldmodel import Attribute, Field, PropertyValue, TBox, Value, ValueKind
from worldmodel.ontology.fields import bytes_of, decoded_text

CACHED = 4096
"""Cached encodings of fact sets, which relays send again."""


class FactCodec:
    """Fact codec of one fleet; ``exchanged`` attributes get short names, None for all."""

    def __init__(self, tbox: TBox, n_instances: int, exchanged: Collection[int] | None) -> None:
        self._attributes = tbox.attributes
        self.n_instances = n_instances
        self.subject_bits = width(n_instances)
        self.names = AttributeNames(len(tbox.attributes), exchanged)
        self.latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self._n_values = {ValueKind.LINK: n_instances, ValueKind.TYPE: len(tbox.classes)}
        self._counts = [self._count_of(attribute) for attribute in tbox.attributes]
        self._value_bits = [
            sum(field.size_bits for field in attribute.fields) if attribute.fields else width(count)
            for attribute, count in zip(tbox.attributes, self._counts, strict=True)
        ]
        self._writers = [self._writer_of(attribute) for attribute in tbox.attributes]
        self._readers = [self._reader_of(attribute) for attribute in tbox.attributes]
        self._uncertain = {attribute.uid: attribute for attribute in tbox.attributes if attribute.uncertainty}
        self.of_all = lru_cache(maxsize=CACHED)(self._of_all)
        """Encode facts, each followed by a continuation bit; return also whether all are latest-only (cached)."""

    def _count_of(self, attribute: Attribute) -> int:
        if attribute.fields:
            return 0
        if attribute.kind is ValueKind.TEXT:
            return attribute.most_bytes + 1  # its length stands first
        return self._n_values.get(attribute.kind) or len(attribute.symbols) or 2

    def attribute(self, uid: int) -> Attribute:
        """Return the attribute with that uid."""
        return self._attributes[uid]

    def listing(self) -> list[FieldSize]:
        """List the fields of a fact in wire order."""
        names, fields = self.names, [("subject", self.subject_bits, f"one of {self.n_instances} instances")]
        fields.append(("attribute", names.short_bits, f"one of {len(names.exchanged)} exchanged"))
        if names.has_others:
            fields.append(("other attribute", names.other_bits, f"one of {names.n_attributes} in all"))
        for attribute, bits in zip(self._attributes, self._value_bits, strict=True):
            fields.append((attribute.name, bits, values_in_words(attribute, self._n_values)))
        for attribute in self._attributes:
            if (grid := attribute.uncertainty) is not None:
                fields.append((f"uncertainty of {attribute.name}", 1 + grid.size_bits, "1 where it carries none"))
        fields.append(("another follows", 1, "of all but own single facts"))
        return [FieldSize("fact", *field) for field in fields]

    def exchanged_texts(self) -> list[Attribute]:
        """Return the text attributes that are exchanged."""
        return [self._attributes[uid] for uid in self.names.exchanged if self._attributes[uid].most_bytes]

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
            raise ConfigurationError(f"instance {subject} has no wire name, 0 to {self.n_instances - 1} have")
        name = self.names.names[uid], self.names.sizes[uid]
        parts = [(subject, self.subject_bits), name, self._writers[uid](value)]
        if uid in self._uncertain:
            parts.append(_uncertainty_bits(self._uncertain[uid], sigma))
        elif sigma is not None:
            raise ConfigurationError(f"{self._attributes[uid].name}: its values carry no uncertainty, not {sigma}")
        return joined(*parts)

    def _writer_of(self, attribute: Attribute) -> Callable[[Any], Bits]:
        if attribute.fields:
            return partial(_numbers, attribute.name, attribute.fields)
        if attribute.most_bytes:
            return partial(_text, attribute, self._value_bits[attribute.uid])
        return partial(self._choice, attribute)

    def _choice(self, attribute: Attribute, value: Value) -> Bits:
        try:
            (number,) = attribute.encode(value)
        except ValueError as error:
            raise ConfigurationError(f"{attribute.name}: {error}") from None
        if number >= self._counts[attribute.uid]:
            raise ConfigurationError(f"{attribute.name}: {number} is outside 0..{self._counts[attribute.uid] - 1}")
        return number, self._value_bits[attribute.uid]

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
        value = self._readers[uid](reader)
        if uid in self._uncertain:
            return PropertyValue(subject, uid, value, _read_uncertainty(self._uncertain[uid], reader.take))
        return PropertyValue(subject, uid, value)

    def _reader_of(self, attribute: Attribute) -> Callable[[Reader], Value]:
        if attribute.fields:
            return partial(_read_numbers, attribute.fields)
        return partial(self._read_choice, attribute, self._value_bits[attribute.uid], self._counts[attribute.uid])

    @staticmethod
    def _read_choice(attribute: Attribute, size_bits: int, n_values: int, reader: Reader) -> Value:
        number = reader.take(size_bits)
        if number >= n_values:
            raise PeerFault(f"{attribute.name}: {number} of {n_values}")
        if attribute.most_bytes:
            return _read_text(reader, attribute, number)
        return bool(number) if attribute.kind is ValueKind.BOOLEAN else number


def _numbers(name: str, fields: Sequence[Field], value: Value) -> Bits:
    values: tuple[Any, ...] = value if isinstance(value, tuple) else (value,)
    if len(values) != len(fields):
        raise ConfigurationError(f"{name}: {value!r} has not {len(fields)} numbers")
    parts = []
    try:
        for field, number in zip(fields, values, strict=True):
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise TypeError(f"{name}: {number!r} is not a number")
            steps = field.grid.index_of(number)
            if abs(steps) > LARGEST:
                raise ConfigurationError(f"{name}: {number} is more than {LARGEST} steps of {field.resolution:g} away")
            parts.append(whole(steps, field.size_bits))
    except (ValueError, OverflowError):
        raise ConfigurationError(f"{name}: {value} is not finite") from None
    return joined(*parts)


def _text(attribute: Attribute, length_bits: int, value: Value) -> Bits:
    try:
        data = bytes_of(value, attribute.most_bytes)
    except ValueError as error:
        raise ConfigurationError(f"{attribute.name}: {error}") from None
    return len(data) << 8 * len(data) | int.from_bytes(data, "big"), length_bits + 8 * len(data)


def _read_text(reader: Reader, attribute: Attribute, n_bytes: int) -> str:
    data = reader.take(8 * n_bytes).to_bytes(n_bytes, "big")
    try:
        return decoded_text(data, attribute.most_bytes)
    except ValueError as error:
        raise PeerFault(f"{attribute.name}: {data!r} is no text: {error}") from None


def _read_numbers(fields: Sequence[Field], reader: Reader) -> Value:
    numbers = []
    for field in fields:
        steps = reader.take(field.size_bits)
        if steps == (1 << field.size_bits) - 1:
            steps = read_beyond(reader.take, field.size_bits)
        # Recorded only: an escaped number may be valid, so the codec checks all values of such a packet afterwards.
        if not 0 <= steps < field.n_values:
            reader.is_beyond = True
        numbers.append(field.grid.value_at(steps))
    return tuple(numbers) if len(numbers) > 1 else numbers[0]  # type: ignore[return-value]


def _uncertainty_bits(attribute: Attribute, uncertainty: float | None) -> Bits:
    grid = attribute.uncertainty
    if grid is None or uncertainty is None:
        return 0, 1
    return 1 << grid.size_bits | attribute.encode_uncertainty(uncertainty), 1 + grid.size_bits


def _read_uncertainty(attribute: Attribute, take: Take) -> float | None:
    """Decode an uncertainty, None if absent; raise PeerFault if invalid."""
    grid = attribute.uncertainty
    if grid is None or not take(1):
        return None
    try:
        return grid.decode(take(grid.size_bits))
    except ValueError as error:
        raise PeerFault(f"uncertainty of {attribute.name}: {error}") from None
