"""Packets as bits, by field tables that follow from the TBox.

Layout, most significant bit first (sizes in bits; ``w(n) = ceil(log2 n)``)::

    packet    definition hash 8 | sender w(nodes) | epoch 2 | acknowledgements (bits that the policy's kind says are
              carried) | number of fragments 5 | fragments | number of signals 4 | signals | padding to a byte
    fragment  relayed 1 [origin w(nodes), epoch 2] | time w(duration / resolution)
              | part of a larger block 1 [index 4, count - 1 4] | facts | sequence w(items), unless a status
    fact      subject w(instances) | attribute w(those exchanged + 1), another's is longer | value
              [| uncertain 1 [| uncertainty]]
              | another fact follows 1
    signal    role w(instances) | value 8, two's complement

A number takes ``ceil(log2((max - min) / resolution + 1))`` bits, the rule of DCCL. Whether a value is uncertain is said
of attributes that may carry an uncertainty. A status has no sequence, and no bit says so: a whole block is one if, and
only if, all its attributes are latest-only. Relayed is what is not of the sender in its present epoch. The hash covers
the TBox and every width in 32 bits, of which the packet of frame k carries byte k mod 4: two vehicles with different
definitions notice it within four frames, see ``exchange.definitions``.
A value out of range is refused with its name: it is never sent as something else.
"""

from __future__ import annotations

import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from exchange.errors import ConfigurationError, DefinitionFault, PeerFault
from exchange.header import AckHeader
from exchange.names import AttributeNames, width
from exchange.packets import Fragment, InfluenceSignal, Packet
from exchange.policies import AckPolicy
from exchange.uncertainties import read_uncertainty, uncertainty_of
from worldmodel import STATUS, Attribute, Field, PropertyValue, TBox, ValueKind

HASH_BITS = 8
"""Bits of the definition hash in one packet."""
HASH_BYTES = 4
"""Bytes of the definition hash; a packet carries one of them, by its frame."""
EPOCH_BITS = 2
FRAGMENT_COUNT_BITS = 5
SIGNAL_COUNT_BITS = 4
SIGNAL_VALUE_BITS = 8
INDEX_BITS = 4
MAX_FRAGMENTS_PER_PACKET = (1 << FRAGMENT_COUNT_BITS) - 1
MAX_SIGNALS = (1 << SIGNAL_COUNT_BITS) - 1


@dataclass(frozen=True, slots=True)
class FieldSize:
    """One line of the size listing.

    Attributes:
        group: `packet`, `fragment`, `fact` or `signal`: the part that the field belongs to.
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
    ranges = [
        f"{field.minimum:g} to {field.maximum:g} {field.unit}".rstrip() + f", steps of {field.resolution:g}"
        for field in attribute.fields
    ]
    return "; ".join(dict.fromkeys(ranges)) or "true or false"


def _layout_of(attribute: Attribute, n_classes: int, n_instances: int) -> tuple[int, ...]:
    """Sizes of the numbers that make up a value of the attribute, in bits."""
    match attribute.kind:
        case ValueKind.TYPE:
            return (width(n_classes),)
        case ValueKind.LINK:
            return (width(n_instances),)
        case ValueKind.BOOLEAN:
            return (1,)
        case ValueKind.SYMBOL:
            return (width(len(attribute.symbols)),)
        case _:
            return tuple(field.size_bits for field in attribute.fields)


def _refuse_nameless(fragment: Fragment, is_status: bool, sequence_bits: int) -> None:
    """Refuse a fragment of a block that has no name on the wire."""
    if fragment.sequence < STATUS:
        raise ConfigurationError(f"block {fragment.sequence} of vehicle {fragment.origin} is private: not to be sent")
    if fragment.is_status != is_status:
        raise ConfigurationError(
            f"sequence {fragment.sequence}: a whole block of latest-only attributes is a status, and has {STATUS}; "
            "any other is an item, and has 0 or more"
        )
    if fragment.sequence >= 1 << sequence_bits:
        raise ConfigurationError(
            f"vehicle {fragment.origin} has told more than {1 << sequence_bits} items, the sequence "
            f"field of {sequence_bits} bits is used up: shorten the mission or report less often"
        )
    _refuse_epoch(fragment.epoch)


def _refuse_epoch(epoch: int) -> None:
    if not 0 <= epoch < 1 << EPOCH_BITS:
        raise ConfigurationError(f"epoch {epoch} has no name on the wire; allowed: 0 to {(1 << EPOCH_BITS) - 1}")


class _Reader:
    """Takes fields off a big integer from the most significant end."""

    __slots__ = ("_bits", "_left")

    def __init__(self, data: bytes) -> None:
        self._bits = int.from_bytes(data, "big")
        self._left = 8 * len(data)

    def take(self, size_bits: int) -> int:
        self._left -= size_bits
        if self._left < 0:
            raise PeerFault("packet ends inside a field")
        return (self._bits >> self._left) & ((1 << size_bits) - 1)

    def padding_is_clean(self) -> bool:
        return self._left < 8 and self.take(self._left) == 0


def _value_lines(
    attributes: Sequence[Attribute], value_bits: Sequence[int], n_values: Mapping[ValueKind, int]
) -> list[FieldSize]:
    """Lines of the size listing for the values of attributes, and for what values may carry."""
    values = [
        FieldSize("fact", one.name, bits, values_in_words(one, n_values))
        for one, bits in zip(attributes, value_bits, strict=True)
    ]
    return values + [
        FieldSize("fact", f"uncertainty of {one.name}", 1 + one.uncertainty.size_bits, "1 where it carries none")
        for one in attributes
        if one.uncertainty is not None
    ]


def _name_fields(names: AttributeNames) -> list[FieldSize]:
    """The lines of an attribute's name: a short one, and that of those which are not exchanged, if there are any."""
    fields = [FieldSize("fact", "attribute", names.short_bits, f"one of {len(names.exchanged)} exchanged")]
    if names.has_others:
        fields.append(FieldSize("fact", "other attribute", names.other_bits, f"one of {names.n_attributes} in all"))
    return fields


class Codec:
    """Encodes and decodes packets for one fleet: fixed TBox, node count, instance count and policy.

    Args:
        tbox: the compiled TBox that every vehicle carries.
        n_instances: instance uids 0..n_instances-1 can be told apart on the wire.
        n_nodes: number of vehicles, 2..64.
        policy: fixes the acknowledgement bits of the header.
        n_items: how many items one vehicle may tell in one epoch.
        duration_s: latest time of an observation.
        time_resolution_s: step of these times.
        exchanged: uids of the attributes that somebody needs, which get short names; None for all.
    """

    def __init__(
        self,
        tbox: TBox,
        n_instances: int,
        n_nodes: int,
        policy: AckPolicy,
        n_items: int,
        duration_s: float,
        time_resolution_s: float = 0.1,
        exchanged: Collection[int] | None = None,
    ) -> None:
        self._attributes = tbox.attributes
        self._latest_only = frozenset(attribute.uid for attribute in tbox.attributes if attribute.latest_only)
        self._n_instances = n_instances
        self._n_nodes = n_nodes
        self._policy = policy
        self._node_bits = width(n_nodes)
        self._sequence_bits = width(n_items)
        self._subject_bits = width(n_instances)
        self._names = AttributeNames(len(tbox.attributes), exchanged)
        self._time = Field(0.0, duration_s, time_resolution_s, "s")
        self._layouts = [_layout_of(attribute, len(tbox.classes), n_instances) for attribute in tbox.attributes]
        self._value_bits = [sum(layout) for layout in self._layouts]
        self._n_values = {ValueKind.LINK: n_instances, ValueKind.TYPE: len(tbox.classes)}
        self.header = AckHeader(policy.acknowledgement, n_nodes)
        """Layout of the acknowledgements."""
        fleet = tbox.hash, n_instances, n_nodes, n_items, self.header.largest_bits
        shape = *fleet, duration_s, time_resolution_s, self._names.exchanged
        self._hash = zlib.crc32(repr(shape).encode()).to_bytes(HASH_BYTES, "big")
        self.decode = lru_cache(maxsize=32)(self._decode)
        """``decode(data, frame=0) -> Packet``; every receiver of one broadcast decodes the same bytes."""

    @property
    def overhead_bits(self) -> int:
        """Bits of a packet without fragments and signals, with the largest header of acknowledgements."""
        head_bits = HASH_BITS + self._node_bits + EPOCH_BITS + self.header.largest_bits
        return head_bits + FRAGMENT_COUNT_BITS + SIGNAL_COUNT_BITS

    @property
    def signal_bits(self) -> int:
        """Bits of one influence signal."""
        return self._subject_bits + SIGNAL_VALUE_BITS

    def fragment_bits(self, fragment: Fragment, relayed: bool = True) -> int:
        """Size of a fragment, by default as a relay has to send it."""
        size = 1 + self._time.size_bits + 1
        size += self._node_bits + EPOCH_BITS if relayed else 0
        size += 0 if fragment.is_status else self._sequence_bits
        size += 2 * INDEX_BITS if fragment.count > 1 else 0
        per_fact, names, values = self._subject_bits + 1, self._names.sizes, self._value_bits
        uncertain = sum(uncertainty_of(self._attributes[fact.attribute], fact)[1] for fact in fragment.facts)
        sizes = (per_fact + names[fact.attribute] + values[fact.attribute] for fact in fragment.facts)
        return size + uncertain + sum(sizes)

    def listing(self) -> tuple[FieldSize, ...]:
        """Every field of a packet in the order of the wire, with its size in this fleet.

        Fields of ``packet`` come once. Those of ``fragment`` come for each fragment, those of ``fact`` for each fact in
        it: subject and attribute, the value of that attribute, and whether another follows.
        """
        part = "if part of a larger block"
        named = f"policy {self._policy.name}" + (", the largest" if self.header.varies else "")
        times = f"{self._time.minimum:g} to {self._time.maximum:g} s, steps of {self._time.resolution:g} s"
        instances = f"one of {self._n_instances} instances"
        return (
            FieldSize(
                "packet", "definition hash", HASH_BITS, f"of {8 * HASH_BYTES} bits a byte in turn: TBox, fleet, policy"
            ),
            FieldSize("packet", "sender", self._node_bits, f"one of {self._n_nodes} nodes"),
            FieldSize("packet", "epoch", EPOCH_BITS, "of the sender: which of its lives"),
            FieldSize("packet", "acknowledgements", self.header.largest_bits, named),
            FieldSize("packet", "number of fragments", FRAGMENT_COUNT_BITS, f"up to {MAX_FRAGMENTS_PER_PACKET}"),
            FieldSize("packet", "number of signals", SIGNAL_COUNT_BITS, f"up to {MAX_SIGNALS}"),
            FieldSize("fragment", "relayed", 1),
            FieldSize("fragment", "origin", self._node_bits, "if relayed"),
            FieldSize("fragment", "origin's epoch", EPOCH_BITS, "if relayed"),
            FieldSize("fragment", "time", self._time.size_bits, times),
            FieldSize("fragment", "part of a larger block", 1),
            FieldSize("fragment", "index", INDEX_BITS, part),
            FieldSize("fragment", "count", INDEX_BITS, part),
            FieldSize("fragment", "sequence", self._sequence_bits, f"if an item: one of {1 << self._sequence_bits}"),
            FieldSize("fact", "subject", self._subject_bits, instances),
            *_name_fields(self._names),
            *_value_lines(self._attributes, self._value_bits, self._n_values),
            FieldSize("fact", "another follows", 1),
            FieldSize("signal", "role", self._subject_bits, instances),
            FieldSize("signal", "value", SIGNAL_VALUE_BITS, "-128 to 127"),
        )

    def _is_status(self, facts: Sequence[PropertyValue], count: int) -> bool:
        """True if a fragment is a status: a whole block of latest-only attributes."""
        return count == 1 and self._latest_only.issuperset([fact.attribute for fact in facts])

    def encode_fragment(self, fragment: Fragment, sender: int, epoch: int = 0) -> tuple[int, int]:
        """``(bits, size_bits)`` of a fragment as ``sender`` says it in its epoch; fixed for the fragment's life."""
        _refuse_nameless(fragment, self._is_status(fragment.facts, fragment.count), self._sequence_bits)
        relayed = (fragment.origin, fragment.epoch) != (sender, epoch)
        bits = 0
        if relayed:
            bits = (1 << self._node_bits | fragment.origin) << EPOCH_BITS | fragment.epoch
        bits = bits << self._time.size_bits | self._time.encode(fragment.time_s)
        bits <<= 1
        if fragment.count > 1:
            bits |= 1
            bits = bits << INDEX_BITS | fragment.index
            bits = bits << INDEX_BITS | fragment.count - 1
        last = len(fragment.facts) - 1
        for position, fact in enumerate(fragment.facts):
            if not 0 <= fact.subject < self._n_instances:
                raise ConfigurationError(f"instance {fact.subject} has no wire name, 0 to {self._n_instances - 1} have")
            bits = bits << self._subject_bits | fact.subject
            bits = bits << self._names.sizes[fact.attribute] | self._names.names[fact.attribute]
            bits = bits << self._value_bits[fact.attribute] | self._encode_value(fact)
            uncertain, size_bits = uncertainty_of(self._attributes[fact.attribute], fact)
            bits = bits << size_bits | uncertain
            bits = bits << 1 | (position < last)
        if not fragment.is_status:
            bits = bits << self._sequence_bits | fragment.sequence
        return bits, self.fragment_bits(fragment, relayed)

    def _encode_value(self, fact: PropertyValue) -> int:
        bits = 0
        try:
            indices = self._attributes[fact.attribute].encode(fact.value)
        except ValueError as error:
            raise ConfigurationError(f"{self._attributes[fact.attribute].name}: {error}") from None
        for index, size_bits in zip(indices, self._layouts[fact.attribute], strict=True):
            bits = bits << size_bits | index
        return bits

    def encode(
        self,
        sender: int,
        rows: Sequence[int],
        fragments: Sequence[tuple[int, int]],
        signals: Sequence[InfluenceSignal] = (),
        frame: int = 0,
        epoch: int = 0,
    ) -> bytes:
        """Bytes of a packet.

        Args:
            sender: node that speaks.
            rows: one acknowledgement bit word per node, shape (n_nodes,).
            fragments: ``(bits, size_bits)`` pairs of ``encode_fragment``.
            signals: influence signals, at most 15.
            frame: TDMA frame in which the packet is sent; the policy may choose its header by it.
            epoch: of the sender.

        Raises:
            ConfigurationError: too many fragments or signals, a signal that is no signed byte, or an epoch too many.
        """
        if len(fragments) > MAX_FRAGMENTS_PER_PACKET or len(signals) > MAX_SIGNALS:
            raise ConfigurationError(
                f"{len(fragments)} fragments and {len(signals)} signals; a packet holds "
                f"{MAX_FRAGMENTS_PER_PACKET} and {MAX_SIGNALS}"
            )
        _refuse_epoch(epoch)
        bits = (self._hash[frame % HASH_BYTES] << self._node_bits | sender) << EPOCH_BITS | epoch
        header_bits = self.header.size_bits(sender, frame)
        bits = bits << header_bits | self.header.encode(sender, rows, frame)
        bits = bits << FRAGMENT_COUNT_BITS | len(fragments)
        size = HASH_BITS + self._node_bits + EPOCH_BITS + header_bits + FRAGMENT_COUNT_BITS
        for fragment, fragment_size in fragments:
            bits = bits << fragment_size | fragment
            size += fragment_size
        bits = bits << SIGNAL_COUNT_BITS | len(signals)
        for signal in signals:
            if not -128 <= signal.value <= 127:
                raise ConfigurationError(f"influence signal {signal.value}: a signed byte holds -128 to 127")
            bits = bits << self._subject_bits | signal.role
            bits = bits << SIGNAL_VALUE_BITS | signal.value & 0xFF
        size += SIGNAL_COUNT_BITS + len(signals) * self.signal_bits
        padding = -size % 8
        return (bits << padding).to_bytes((size + padding) // 8, "big")

    def _decode(self, data: bytes, frame: int = 0) -> Packet:
        """The packet of ``data``; raises PeerFault if it cannot be one of this fleet."""
        reader = _Reader(data)
        if reader.take(HASH_BITS) != self._hash[frame % HASH_BYTES]:
            raise DefinitionFault("definition hash differs: sender uses another TBox or other field widths")
        sender = reader.take(self._node_bits)
        if sender >= self._n_nodes:
            raise PeerFault(f"sender {sender} is not one of {self._n_nodes} nodes")
        epoch = reader.take(EPOCH_BITS)
        rows = self.header.decode(sender, frame, reader.take)
        fragments = tuple(self._decode_fragment(reader, sender, epoch) for _ in range(reader.take(FRAGMENT_COUNT_BITS)))
        signals = tuple(self._decode_signal(reader) for _ in range(reader.take(SIGNAL_COUNT_BITS)))
        if not reader.padding_is_clean():
            raise PeerFault("bits left over behind the packet")
        return Packet(sender, rows, fragments, signals, epoch)

    def _decode_signal(self, reader: _Reader) -> InfluenceSignal:
        role = reader.take(self._subject_bits)
        value = reader.take(SIGNAL_VALUE_BITS)
        return InfluenceSignal(role, value - 256 if value > 127 else value)

    def _decode_fragment(self, reader: _Reader, sender: int, epoch: int) -> Fragment:
        origin = sender
        if reader.take(1):
            origin, epoch = reader.take(self._node_bits), reader.take(EPOCH_BITS)
        if origin >= self._n_nodes:
            raise PeerFault(f"origin {origin} is not one of {self._n_nodes} nodes")
        time_index = reader.take(self._time.size_bits)
        if time_index >= self._time.n_values:
            raise PeerFault(f"observation time {time_index} is behind the end of the mission")
        index, count = 0, 1
        if reader.take(1):
            index = reader.take(INDEX_BITS)
            count = reader.take(INDEX_BITS) + 1
            if count < 2 or index >= count:
                raise PeerFault(f"fragment {index} of {count}")
        facts = []
        follows = 1
        while follows:
            facts.append(self._decode_fact(reader))
            follows = reader.take(1)
        sequence = STATUS if self._is_status(facts, count) else reader.take(self._sequence_bits)
        return Fragment(origin, sequence, self._time.decode(time_index), tuple(facts), index, count, epoch)

    def _decode_fact(self, reader: _Reader) -> PropertyValue:
        subject = reader.take(self._subject_bits)
        uid = self._names.read(reader.take)
        if subject >= self._n_instances:
            raise PeerFault(f"instance {subject} is not one of {self._n_instances}")
        attribute = self._attributes[uid]
        indices = [reader.take(size_bits) for size_bits in self._layouts[uid]]
        try:
            value = attribute.decode(indices)
        except ValueError as error:
            raise PeerFault(f"{attribute.name}: {error}") from None
        n_values = len(attribute.symbols) or self._n_values.get(attribute.kind)
        if n_values is not None and indices[0] >= n_values:
            raise PeerFault(f"{attribute.name}: {indices[0]} of {n_values}")
        return PropertyValue(subject, uid, value, read_uncertainty(attribute, reader.take))
