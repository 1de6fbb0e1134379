"""Fragment codec: origin, age, facts and sequence.

The size of a fragment depends on its packet: the age on the slot, the sequence on its predecessor of the same origin
and epoch. Callers therefore offer fragments to a `Packing`, which accepts those that fit. Layout in
``exchange.wire.codec``.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from operator import itemgetter

from exchange.errors import ConfigurationError, PeerFault
from exchange.packets import Fragment, Life
from exchange.policy.planning import width
from exchange.wire.factcodec import Bits, FactCodec, FieldSize, Reader, joined, natural, read_natural
from worldmodel import EPOCHS, STATUS, Field
from worldmodel.facts import MOST_ITEMS

EPOCH_BITS = 2
"""Bits of an epoch; a higher one is escaped."""
EPOCH_MASK = (1 << EPOCH_BITS) - 1
INDEX_BITS = 4
LONGEST_KIND_BITS = 3
"""Longest prefix that announces a fragment."""
OWN_BITS, RELAYED_BITS = (0b100, 3), (0b101, 3)
NEAR_STEP_BITS = 4
NEAR_STEPS = 1 << NEAR_STEP_BITS
FAR_AGE_BITS = 3
"""Extra bits of a far age over a near one."""

Before = dict[Life, int]
"""Last sequence by origin and epoch in a packet."""


def step(before: int | None, number: int, width_bits: int) -> Bits:
    """Encode a sequence by its predecessor, None for the first: +1 in 1 bit, 0 and 2..16 in 6 bits, else absolute.

    >>> [step(40, number, 12)[1] for number in (41, 40, 56, 57, 39)]
    [1, 6, 6, 14, 14]
    """
    if before is None:
        return natural(number, width_bits)
    ahead = number - before
    if ahead == 1:
        return 0, 1
    if 0 <= ahead <= NEAR_STEPS:
        # A step of 1 has the short code, so that its place here stands for 0: a further part of the same block.
        return 0b10 << NEAR_STEP_BITS | (ahead - 1 if ahead else 0), 2 + NEAR_STEP_BITS
    bits, size_bits = natural(number, width_bits)
    return 0b11 << size_bits | bits, 2 + size_bits


def age(base: int, index: int, near_bits: int, width_bits: int) -> Bits:
    """Encode a time index by its distance before ``base``: near, far, or absolute.

    >>> [age(1000, index, 5, 12)[1] for index in (1000, 969, 968, 713, 712, 1001)]
    [6, 6, 10, 10, 14, 14]
    """
    ago = base - index
    near = 1 << near_bits
    if 0 <= ago < near:
        return ago, 1 + near_bits
    far_bits = near_bits + FAR_AGE_BITS
    if 0 <= ago < near + (1 << far_bits):
        return 0b10 << far_bits | ago - near, 2 + far_bits
    bits, size_bits = natural(index, width_bits)
    return 0b11 << size_bits | bits, 2 + size_bits


def refuse_epoch(epoch: int) -> None:
    """Raise ConfigurationError for an epoch out of range."""
    if not 0 <= epoch < EPOCHS:
        raise ConfigurationError(f"epoch {epoch} cannot be sent; allowed: 0 to {EPOCHS - 1}")


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
        return natural(self.time.grid.index_of(time_s), self._time_bits)

    def read_time(self, reader: Reader) -> float:
        """Decode ``encode_time``."""
        return self.time.grid.value_at(read_natural(reader.take, self._time_bits))

    def most_bits(self, fragment: Fragment, relayed: bool = True) -> int:
        """Return an upper bound of a fragment's size in any packet, by default as a relay sends it."""
        size = 2 + self.encode_time(fragment.time_s)[1] + self.facts.of_all(fragment.facts)[1]
        if fragment.sequence != STATUS:
            size += 2 + natural(fragment.sequence, self.sequence_bits)[1]
        if relayed or fragment.count > 1 or len(fragment.facts) > 1:
            size += LONGEST_KIND_BITS + 1 + (2 * INDEX_BITS if fragment.count > 1 else 0)
        return size + (self.encode_life(fragment.origin, fragment.epoch)[1] if relayed else 0)

    def listing(self) -> tuple[FieldSize, ...]:
        """List the fields of a fragment in wire order, without facts."""
        part, step_s, near = "if part of a larger block", self.time.resolution, 1 << self.near_bits
        far = near + (near << FAR_AGE_BITS)
        far_bits = 2 + self.near_bits + FAR_AGE_BITS
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
            FieldSize("fragment", "near sequence", 2 + NEAR_STEP_BITS, f"up to {NEAR_STEPS} more"),
            FieldSize("fragment", "other sequence", 2 + self.sequence_bits),
        )

    # To bits -------------------------------------------------------------------------------------

    def encode(self, fragment: Fragment, sender: int, epoch: int, base: int) -> Bits:
        """Encode a fragment without its sequence; raise ConfigurationError if it has no wire format.

        ``base`` belongs to the slot, see ``base_of``.
        """
        facts, count, sequence = fragment.facts, fragment.count, fragment.sequence
        bits, size_bits, are_latest_only = self.facts.of_all(facts)
        if sequence < STATUS or (sequence == STATUS) != (count == 1 and are_latest_only):
            raise _nameless(fragment)
        if not 0 <= fragment.epoch < EPOCHS:
            refuse_epoch(fragment.epoch)
        index = self.time.grid.index_of(fragment.time_s)
        if index < 0:
            raise ConfigurationError(f"a fact of {fragment.time_s} s: times are counted from the mission's beginning")
        time = age(base, index, self.near_bits, self._time_bits)
        if fragment.origin != sender or fragment.epoch != epoch:
            if not 0 <= fragment.origin < self.n_nodes:
                raise ConfigurationError(f"origin {fragment.origin} is not one of {self.n_nodes} nodes")
            parts = [RELAYED_BITS, self.encode_life(fragment.origin, fragment.epoch), time]
        elif count == 1 and len(facts) == 1:
            return time[0] << size_bits - 1 | bits >> 1, time[1] + size_bits  # a 0 in front, no continuation bit
        else:
            parts = [OWN_BITS, time]
        parts.append((int(count > 1), 1))
        if count > 1:
            parts += [(fragment.index, INDEX_BITS), (count - 1, INDEX_BITS)]
        return joined(*parts, (bits, size_bits))

    def encode_life(self, origin: int, epoch: int) -> Bits:
        """Encode an origin and its epoch."""
        return joined((origin, self.origin_bits), natural(epoch, EPOCH_BITS))

    # From bits -----------------------------------------------------------------------------------

    def read_origin(self, reader: Reader) -> int:
        """Decode an origin; raise PeerFault if invalid."""
        origin = reader.take(self.origin_bits)
        if origin >= self.n_nodes:
            raise PeerFault(f"origin {origin} is not one of {self.n_nodes} nodes")
        return origin

    def read_epoch(self, reader: Reader) -> int:
        """Decode an epoch; raise PeerFault if invalid."""
        epoch = read_natural(reader.take, EPOCH_BITS)
        if epoch >= EPOCHS:
            raise PeerFault(f"epoch {epoch}: allowed are 0 to {EPOCHS - 1}")
        return epoch

    def read_life(self, reader: Reader) -> Life:
        """Decode an origin and its epoch; raise PeerFault if invalid."""
        return self.read_origin(reader), self.read_epoch(reader)

    def _read_time(self, reader: Reader, base: int) -> float:
        """Decode ``age``; raise PeerFault for a negative time or if a shorter form exists."""
        near_bits = self.near_bits
        number = reader.take(1 + near_bits)
        if number >> near_bits == 0:
            index = base - number
        else:
            reader.left += near_bits  # a longer form
            if not reader.take(1):
                index = base - (1 << near_bits) - reader.take(near_bits + FAR_AGE_BITS)
            else:
                index = read_natural(reader.take, self._time_bits)
                if 0 <= base - index < (1 << near_bits) + (1 << near_bits + FAR_AGE_BITS):
                    raise PeerFault(f"time {index} not in its shortest form, relative to {base}")
        if index < 0:
            raise PeerFault(f"a time {-index} steps before the mission began")
        return self.time.grid.value_at(index)

    def _read_sequence(self, reader: Reader, life: Life, before: Before) -> int:
        """Decode ``step``; raise PeerFault if it is too large or a shorter form exists."""
        last, take = before.get(life), reader.take
        if last is None:
            sequence = read_natural(take, self.sequence_bits)
        elif not take(1):
            sequence = last + 1
        elif not take(1):
            near = take(NEAR_STEP_BITS)
            sequence = last + near + 1 if near else last
        else:
            sequence = read_natural(take, self.sequence_bits)
            if 0 <= sequence - last <= NEAR_STEPS:
                raise PeerFault(f"sequence {sequence} not in its shortest form, after {last}")
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
            raise PeerFault("own fragment not in its shortest form")
        is_status = count == 1 and all(fact.attribute in self.facts.latest_only for fact in facts)
        sequence = STATUS if is_status else self._read_sequence(reader, life, before)
        return Fragment(life[0], sequence, time_s, facts, index, count, life[1])


class Packing:
    """Fragments of a packet under construction; ``left_bits`` is its remaining capacity."""

    def __init__(self, codec: FragmentCodec, sender: int, epoch: int, slot_start_s: float, room_bits: int) -> None:
        self._codec = codec
        self._sender = sender
        self._epoch = epoch
        self._base = codec.base_of(slot_start_s)
        self.left_bits = room_bits
        # Place in the packet, attribute of the first fact, bits and their number.
        self._bodies: list[tuple[tuple[bool, int, int, int, int], int, int, int]] = []
        self._sequences: dict[Life, list[int]] = {}

    def size_bits(self, fragment: Fragment, body_bits: int) -> int:
        """Return the growth of the packet by an item of ``body_bits`` without its sequence."""
        taken, sequence = self._sequences.get((fragment.origin, fragment.epoch), ()), fragment.sequence
        width_bits, index = self._codec.sequence_bits, bisect_left(taken, sequence)
        before = taken[index - 1] if index else None
        size_bits = body_bits + step(before, sequence, width_bits)[1]
        if index < len(taken):  # its successor gets another predecessor
            size_bits += step(sequence, taken[index], width_bits)[1] - step(before, taken[index], width_bits)[1]
        return size_bits

    def add(self, fragment: Fragment) -> bool:
        """Accept a fragment; return False without a change if it does not fit."""
        bits, size_bits = self._codec.encode(fragment, self._sender, self._epoch, self._base)
        origin, sequence, _, facts, index, _, epoch = fragment
        growth_bits = size_bits if sequence == STATUS else self.size_bits(fragment, size_bits)
        if growth_bits > self.left_bits:
            return False
        self.left_bits -= growth_bits
        is_relayed = origin != self._sender or epoch != self._epoch
        self._bodies.append(((is_relayed, origin, epoch, sequence, index), facts[0].attribute, bits, size_bits))
        if sequence != STATUS:
            insort(self._sequences.setdefault((origin, epoch), []), sequence)
        return True

    def wired(self) -> tuple[list[Bits], list[tuple[int, int]]]:
        """Return the bits of the accepted fragments by origin, epoch and sequence, own ones first.

        A second list has the attribute of the first fact and the size (bits) of each.
        """
        before: Before = {}
        parts: list[Bits] = []
        sizes: list[tuple[int, int]] = []
        for (_, origin, epoch, sequence, _), attribute, bits, size_bits in sorted(self._bodies, key=itemgetter(0)):
            number = 0, 0
            if sequence != STATUS:
                number = step(before.get((origin, epoch)), sequence, self._codec.sequence_bits)
                before[origin, epoch] = sequence
            parts += (bits, size_bits), number
            sizes.append((attribute, size_bits + number[1]))
        return parts, sizes


def _nameless(fragment: Fragment) -> ConfigurationError:
    if fragment.sequence < STATUS:
        return ConfigurationError(f"block {fragment.sequence} of vehicle {fragment.origin} is private: not to be sent")
    return ConfigurationError(
        f"sequence {fragment.sequence}: a whole block of latest-only attributes is a status, and has {STATUS}; "
        "any other is an item, and has 0 or more"
    )
