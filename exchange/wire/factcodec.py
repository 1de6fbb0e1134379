"""Fact codec: subject, attribute, value and optional uncertainty.

A number takes ``ceil(log2((max - min) / resolution + 1))`` bits, the rule of DCCL. Numbers out of range, or encoded as
all ones, are escaped and exact (`exchange.wire.codes`). A text is its length in bytes, then UTF-8.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
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
    name_fields,
    read_beyond,
    value_lines,
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
        self._short, self._n_short = self.names.exchanged, len(self.names.exchanged)
        self.prefix_bits = self.subject_bits + self.names.short_bits
        self._short_mask = (1 << self.names.short_bits) - 1
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
        """Encode facts, each followed by a continuation bit (cached)."""

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
        return [
            FieldSize("fact", "subject", self.subject_bits, f"one of {self.n_instances} instances"),
            *name_fields(self.names),
            *value_lines(self._attributes, self._value_bits, self._n_values),
            *_uncertainty_lines(self._attributes),
            FieldSize("fact", "another follows", 1, "of all but own single facts"),
        ]

    def exchanged_texts(self) -> list[Attribute]:
        """Return the text attributes that are exchanged."""
        return [self._attributes[uid] for uid in self._short if self._attributes[uid].most_bytes]

    def forget(self) -> None:
        """Clear the cache of encodings."""
        self.of_all.cache_clear()

    # To bits -------------------------------------------------------------------------------------

    def _of_all(self, facts: Sequence[PropertyValue]) -> Bits:
        bits, size_bits = 0, 0
        for fact in facts:
            fact_bits, fact_size = self.of_one(fact)
            bits = (bits << fact_size | fact_bits) << 1 | 1
            size_bits += fact_size + 1
        return bits & ~1, size_bits

    def of_one(self, fact: PropertyValue) -> Bits:
        """Encode a fact; raise ConfigurationError if it has no wire format."""
        subject, uid, value, sigma = fact
        if not 0 <= subject < self.n_instances:
            raise ConfigurationError(f"instance {subject} has no wire name, 0 to {self.n_instances - 1} have")
        value_bits, value_size = self._writers[uid](value)
        bits = (subject << self.names.sizes[uid] | self.names.names[uid]) << value_size | value_bits
        size_bits = self.subject_bits + self.names.sizes[uid] + value_size
        if uid in self._uncertain:
            more, more_bits = _uncertainty_bits(self._uncertain[uid], sigma)
            return bits << more_bits | more, size_bits + more_bits
        if sigma is not None:
            raise ConfigurationError(f"{self._attributes[uid].name}: its values carry no uncertainty, not {sigma}")
        return bits, size_bits

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
        return self.read_named(reader, reader.take(self.prefix_bits))

    def read_named(self, reader: Reader, word: int) -> PropertyValue:
        """Decode a fact whose first ``prefix_bits`` are ``word``; raise PeerFault if invalid."""
        take, names = reader.take, self.names
        subject, name = word >> names.short_bits, word & self._short_mask
        uid = self._short[name] if name < self._n_short else names.uid_of(name, take)
        if subject >= self.n_instances:
            raise PeerFault(f"instance {subject} is not one of {self.n_instances}")
        value = self._readers[uid](reader)
        if uid in self._uncertain:
            return PropertyValue(subject, uid, value, _read_uncertainty(self._uncertain[uid], take))
        return PropertyValue(subject, uid, value)

    def _reader_of(self, attribute: Attribute) -> Callable[[Reader], Value]:
        if not attribute.fields:
            return partial(self._read_choice, attribute, self._value_bits[attribute.uid], self._counts[attribute.uid])
        return _number_reader(attribute.fields)

    @staticmethod
    def _read_choice(attribute: Attribute, size_bits: int, n_values: int, reader: Reader) -> Value:
        number = reader.take(size_bits)
        if number >= n_values:
            raise PeerFault(f"{attribute.name}: {number} of {n_values}")
        if attribute.most_bytes:
            return _read_text(reader, attribute, number)
        return bool(number) if attribute.kind is ValueKind.BOOLEAN else number


def _number_reader(fields: Sequence[Field]) -> Callable[[Reader], Value]:
    return _point_reader(*fields) if len(fields) == 2 else partial(_read_number, fields[0])


def _point_reader(east: Field, north: Field) -> Callable[[Reader], Value]:
    """Read both coordinates in one operation, unless one is escaped or out of range."""
    x_start, x_step, x_denominator = east.grid.whole_numbers
    y_start, y_step, y_denominator = north.grid.whole_numbers
    north_bits, both_bits = north.size_bits, east.size_bits + north.size_bits
    ones, x_end, y_end = (1 << north_bits) - 1, _end_of_short(east), _end_of_short(north)

    def read(reader: Reader) -> tuple[float, float]:
        both = reader.take(both_bits)
        x, y = both >> north_bits, both & ones
        if x < x_end and y < y_end:
            return (x_start + x * x_step) / x_denominator, (y_start + y * y_step) / y_denominator
        reader.left += both_bits
        return (_read_number(east, reader), _read_number(north, reader))

    return read


def _end_of_short(field: Field) -> int:
    """First step index that is out of range or needs an escape."""
    return min(field.n_values, (1 << field.size_bits) - 1)


def _numbers(name: str, fields: Sequence[Field], value: Value) -> Bits:
    values: tuple[Any, ...] = value if isinstance(value, tuple) else (value,)
    if len(values) != len(fields):
        raise ConfigurationError(f"{name}: {value!r} has not {len(fields)} numbers")
    bits, size_bits = 0, 0
    try:
        for field, number in zip(fields, values, strict=True):
            if type(number) is not float:
                _refuse_no_number(name, number)
            steps, width_bits = round((number - field.minimum) / field.resolution), field.size_bits  # ``Grid.index_of``
            if 0 <= steps < field.n_values - 1:  # as ``whole`` has it
                bits, size_bits = bits << width_bits | steps, size_bits + width_bits
                continue
            if abs(steps) > LARGEST:
                raise ConfigurationError(f"{name}: {number} is more than {LARGEST} steps of {field.resolution:g} away")
            more, more_bits = whole(steps, width_bits)
            bits, size_bits = bits << more_bits | more, size_bits + more_bits
    except (ValueError, OverflowError):
        raise ConfigurationError(f"{name}: {value} is not finite") from None
    return bits, size_bits


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


def _refuse_no_number(name: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{name}: {value!r} is not a number")


def _read_number(field: Field, reader: Reader) -> float:
    size_bits = field.size_bits
    steps = reader.take(size_bits)
    if steps == (1 << size_bits) - 1:
        steps = read_beyond(reader.take, size_bits)
    if not 0 <= steps < field.n_values:
        reader.is_beyond = True
    return field.grid.value_at(steps)


def _uncertainty_bits(attribute: Attribute, uncertainty: float | None) -> Bits:
    """Encode an uncertainty; None for absent."""
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


def _uncertainty_lines(attributes: Iterable[Attribute]) -> list[FieldSize]:
    """List the uncertainty fields."""
    return [
        FieldSize(
            "fact", f"uncertainty of {attribute.name}", 1 + attribute.uncertainty.size_bits, "1 where it carries none"
        )
        for attribute in attributes
        if attribute.uncertainty is not None
    ]
