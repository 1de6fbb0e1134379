"""Fragment codec: origin, age, facts and sequence.

The size of a fragment depends on its packet: the age on the slot, the sequence on its predecessor of the same origin
and epoch. Callers therefore offer fragments to a `Packing`, which accepts those that fit. Layout in
``exchange.wire.codec``.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterable, Sequence

from exchange.errors import ConfigurationError, PeerFault
from exchange.packets import Fragment
from exchange.wire import codes
from exchange.wire.codes import Bits, FieldSize, Reader, joined, width
from exchange.wire.factcodec import FactCodec
from worldmodel import EPOCHS, STATUS, Field, PropertyValue
from worldmodel.facts import MOST_ITEMS

EPOCH_BITS = 2
"""Bits of an epoch; a higher one is escaped."""
INDEX_BITS = 4
LONGEST_KIND_BITS = 3
"""Longest prefix that announces a fragment."""
OWN_BITS, RELAYED_BITS = (0b100, 3), (0b101, 3)

Life = tuple[int, int]
"""An origin and its epoch."""
Before = dict[Life, int]
"""Last sequence by origin and epoch in a packet."""
Wired = tuple[Fragment, int, int]
"""A fragment, its bits and their number."""


def refuse_epoch(epoch: int) -> None:
    """Raise ConfigurationError for an epoch out of range."""
    if not 0 <= epoch < EPOCHS:
        raise ConfigurationError(f"epoch {epoch} has no name on the wire; allowed: 0 to {EPOCHS - 1}")


class FragmentCodec:
    """Fragment codec of one fleet; arguments as of ``Codec`` and ``Widths``."""

    def __init__(
        self,
        facts: FactCodec,
        n_nodes: int,
        n_items: int,
        duration_s: float,
        time_resolution_s: float,
        recent_s: float,
    ) -> None:
        self.facts = facts
        self.n_nodes = n_nodes
        self.origin_bits = width(n_nodes)
        self.sequence_bits = width(n_items)
        self.time = Field(0.0, duration_s, time_resolution_s, "s")
        self._time_bits = self.time.size_bits
        self.near_bits = min(self._time_bits, width(max(2, round(recent_s / time_resolution_s) + 1)))

    def base_of(self, slot_start_s: float) -> int:
        """Return the time step from which ages count; no earlier observation has a negative age."""
        return int(slot_start_s / self.time.resolution) + 1

    def encode_time(self, time_s: float) -> Bits:
        """Encode a time independently of a slot."""
        return codes.natural(self.time.grid.index_of(time_s), self._time_bits)

    def read_time(self, reader: Reader) -> float:
        """Decode ``encode_time``."""
        return self.time.grid.value_at(codes.read_natural(reader.take, self._time_bits))

    def most_bits(self, fragment: Fragment, relayed: bool = True) -> int:
        """Return an upper bound of a fragment's size in any packet, by default as a relay sends it."""
        size = 2 + self.encode_time(fragment.time_s)[1]
        size += 0 if fragment.sequence == STATUS else 2 + self.encode_sequence(fragment.sequence, None)[1]
        if not relayed and fragment.count == 1 and len(fragment.facts) == 1:
            return size + self.facts.of_all(fragment.facts)[1]
        size += LONGEST_KIND_BITS + 1 + (2 * INDEX_BITS if fragment.count > 1 else 0)
        if relayed:
            size += self.encode_life(fragment.origin, fragment.epoch)[1]
        return size + self.facts.of_all(fragment.facts)[1]

    def listing(self) -> tuple[FieldSize, ...]:
        """List the fields of a fragment in wire order, without facts."""
        part, step_s, near = "if part of a larger block", self.time.resolution, 1 << self.near_bits
        far = near + (near << codes.FAR_AGE_BITS)
        far_bits = 2 + self.near_bits + codes.FAR_AGE_BITS
        other_times = f"of any other time, from 0 to {self.time.maximum:g} s; more bits beyond"
        return (
            FieldSize("fragment", "own single fact", 1, "a whole block of the sender's own"),
            FieldSize("fragment", "own or relayed", OWN_BITS[1], "any other"),
            FieldSize("fragment", "origin", self.origin_bits, "if relayed"),
            FieldSize("fragment", "origin's epoch", EPOCH_BITS, "if relayed; more bits from 3 on"),
            FieldSize("fragment", "near age", 1 + self.near_bits, f"below {near * step_s:g} s, steps of {step_s:g} s"),
            FieldSize("fragment", "far age", far_bits, f"below {far * step_s:g} s"),
            FieldSize("fragment", "time", 2 + self._time_bits, other_times),
            FieldSize("fragment", "part of a larger block", 1, "of all but own single facts"),
            FieldSize("fragment", "index", INDEX_BITS, part),
            FieldSize("fragment", "count", INDEX_BITS, part),
            FieldSize("fragment", "first sequence", self.sequence_bits, "of an origin, if an item; more bits beyond"),
            FieldSize("fragment", "next sequence", 1, "one more than the one before it"),
            FieldSize("fragment", "near sequence", 2 + codes.NEAR_STEP_BITS, f"up to {codes.NEAR_STEPS} more"),
            FieldSize("fragment", "other sequence", 2 + self.sequence_bits),
        )

    # To bits -------------------------------------------------------------------------------------

    def encode(self, fragment: Fragment, sender: int, epoch: int, base: int) -> Bits:
        """Encode a fragment without its sequence; raise ConfigurationError if it has no wire format.

        ``base`` belongs to the slot, see ``base_of``.
        """
        facts, count, sequence = fragment.facts, fragment.count, fragment.sequence
        if sequence < STATUS or (sequence == STATUS) != self._is_status(facts, count):
            raise _nameless(fragment)
        if not 0 <= fragment.epoch < EPOCHS:
            refuse_epoch(fragment.epoch)
        time = self.time.grid.index_of(fragment.time_s)
        if time < 0:
            raise ConfigurationError(f"a fact of {fragment.time_s} s: times are counted from the mission's beginning")
        age = codes.age(base, time, self.near_bits, self._time_bits)
        bits, size_bits = self.facts.of_all(facts)
        if fragment.origin != sender or fragment.epoch != epoch:
            if not 0 <= fragment.origin < self.n_nodes:
                raise ConfigurationError(f"origin {fragment.origin} is not one of {self.n_nodes} nodes")
            parts = [RELAYED_BITS, self.encode_life(fragment.origin, fragment.epoch), age]
        elif count == 1 and len(facts) == 1:
            return age[0] << size_bits - 1 | bits >> 1, age[1] + size_bits  # a 0 in front, no continuation bit
        else:
            parts = [OWN_BITS, age]
        parts.append((int(count > 1), 1))
        if count > 1:
            parts += [(fragment.index, INDEX_BITS), (count - 1, INDEX_BITS)]
        return joined(*parts, (bits, size_bits))

    def encode_life(self, origin: int, epoch: int) -> Bits:
        """Encode an origin and its epoch."""
        return joined((origin, self.origin_bits), codes.natural(epoch, EPOCH_BITS))

    def encode_sequence(self, sequence: int, before: int | None) -> Bits:
        """Encode a sequence by its predecessor of the same origin and epoch; None for the first."""
        if before is None:
            return codes.natural(sequence, self.sequence_bits)
        return codes.step(before, sequence, self.sequence_bits)

    def in_sequence(self, bodies: Iterable[Wired], sender: int, epoch: int) -> list[Wired]:
        """Add sequences to ``bodies`` and sort by origin, epoch and sequence, own fragments first."""

        def place(body: Wired) -> tuple[bool, int, int, int, int]:
            origin, sequence, _, _, index, _, of_epoch = body[0]
            return origin != sender or of_epoch != epoch, origin, of_epoch, sequence, index

        before: Before = {}
        wired: list[Wired] = []
        for fragment, bits, size_bits in sorted(bodies, key=place):
            sequence, step, step_bits = fragment.sequence, 0, 0
            if sequence != STATUS:
                life = fragment.origin, fragment.epoch
                step, step_bits = self.encode_sequence(sequence, before.get(life))
                before[life] = sequence
            wired.append((fragment, bits << step_bits | step, size_bits + step_bits))
        return wired

    def _is_status(self, facts: Sequence[PropertyValue], count: int) -> bool:
        latest_only = self.facts.latest_only
        return count == 1 and facts[0].attribute in latest_only and all(fact.attribute in latest_only for fact in facts)

    # From bits -----------------------------------------------------------------------------------

    def read_life(self, reader: Reader) -> Life:
        """Decode an origin and its epoch; raise PeerFault if invalid."""
        origin, epoch = reader.take(self.origin_bits), codes.read_natural(reader.take, EPOCH_BITS)
        if origin >= self.n_nodes:
            raise PeerFault(f"origin {origin} is not one of {self.n_nodes} nodes")
        if epoch >= EPOCHS:
            raise PeerFault(f"epoch {epoch} of node {origin}: there are {EPOCHS}")
        return origin, epoch

    def _read_time(self, reader: Reader, base: int) -> float:
        return self.time.grid.value_at(codes.read_age(reader.take, base, self.near_bits, self._time_bits))

    def _read_sequence(self, reader: Reader, life: Life, before: Before) -> int:
        last = before.get(life)
        if last is None:
            sequence = codes.read_natural(reader.take, self.sequence_bits)
        elif not reader.take(1):
            sequence = last + 1
        else:
            sequence = codes.read_further(reader.take, last, self.sequence_bits)
        if sequence >= MOST_ITEMS:
            raise PeerFault(f"item {sequence}: allowed are 0 to {MOST_ITEMS - 1}")
        before[life] = sequence
        return sequence

    def read_single(self, reader: Reader, own: Life, base: int, before: Before) -> Fragment:
        """Decode an own whole block of a single fact; updates the last sequences in ``before``."""
        reader.left -= 1  # the prefix
        time_s, fact = self._read_time(reader, base), self.facts.read_one(reader)
        is_status = fact.attribute in self.facts.latest_only
        sequence = STATUS if is_status else self._read_sequence(reader, own, before)
        return Fragment(own[0], sequence, time_s, (fact,), 0, 1, own[1])

    def read_other(self, reader: Reader, own: Life, base: int, before: Before) -> Fragment:
        """Decode a fragment of any other kind; arguments as ``read_single``."""
        is_relayed = reader.take(OWN_BITS[1]) & 1
        life = self.read_life(reader) if is_relayed else own
        time_s = self._read_time(reader, base)
        index, count = 0, 1
        if reader.take(1):
            index = reader.take(INDEX_BITS)
            count = reader.take(INDEX_BITS) + 1
            if count < 2 or index >= count:
                raise PeerFault(f"fragment {index} of {count}")
        facts = self.facts.read_all(reader)
        if life == own and (is_relayed or (count == 1 and len(facts) == 1)):
            raise PeerFault("an own fragment in a longer form than it has")
        sequence = STATUS if self._is_status(facts, count) else self._read_sequence(reader, life, before)
        return Fragment(life[0], sequence, time_s, facts, index, count, life[1])


class Packing:
    """Fragments of a packet under construction; ``left_bits`` is its remaining capacity."""

    def __init__(self, codec: FragmentCodec, sender: int, epoch: int, slot_start_s: float, room_bits: int) -> None:
        self._codec = codec
        self._sender = sender
        self._epoch = epoch
        self._base = codec.base_of(slot_start_s)
        self.left_bits = room_bits
        self._bodies: list[Wired] = []
        self._sequences: dict[Life, list[int]] = {}

    @property
    def fragments(self) -> list[Fragment]:
        """Accepted fragments in order of acceptance."""
        return [fragment for fragment, _, _ in self._bodies]

    def size_bits(self, fragment: Fragment, body_bits: int) -> int:
        """Return the growth of the packet by an item of ``body_bits`` without its sequence."""
        taken, sequence = self._sequences.get((fragment.origin, fragment.epoch), ()), fragment.sequence
        index = bisect_left(taken, sequence)
        before = taken[index - 1] if index else None
        sequence_bits = self._codec.encode_sequence(sequence, before)[1]
        if index < len(taken):  # its successor gets another predecessor
            behind = self._codec.encode_sequence
            sequence_bits += behind(taken[index], sequence)[1] - behind(taken[index], before)[1]
        return body_bits + sequence_bits

    def add(self, fragment: Fragment) -> bool:
        """Accept a fragment; return False without a change if it does not fit."""
        body = self._codec.encode(fragment, self._sender, self._epoch, self._base)
        size_bits = body[1] if fragment.sequence == STATUS else self.size_bits(fragment, body[1])
        if size_bits > self.left_bits:
            return False
        self.left_bits -= size_bits
        self._bodies.append((fragment, *body))
        if fragment.sequence != STATUS:
            insort(self._sequences.setdefault((fragment.origin, fragment.epoch), []), fragment.sequence)
        return True

    def wired(self) -> list[Wired]:
        """Return the accepted fragments in wire order."""
        return self._codec.in_sequence(self._bodies, self._sender, self._epoch)


def _nameless(fragment: Fragment) -> ConfigurationError:
    if fragment.sequence < STATUS:
        return ConfigurationError(f"block {fragment.sequence} of vehicle {fragment.origin} is private: not to be sent")
    return ConfigurationError(
        f"sequence {fragment.sequence}: a whole block of latest-only attributes is a status, and has {STATUS}; "
        "any other is an item, and has 0 or more"
    )
