"""Packet codec with field tables derived from the TBox.

Layout, most significant bit first (sizes in bits; ``w(n) = ceil(log2 n)``)::

    packet    head | acknowledgements (bits that the policy's kind says are carried) [| account] | sections | 111
              | zeros to a byte [| tag 32] [| checksum 8, 16 or 32], see `exchange.wire.sealing`; with a tag all behind
              the head is encrypted
    head      definition hash 8 | sender w(nodes) | epoch mod 4 2 | frame mod 4 2 [| zeros to a byte, for encryption]
    account   holdings, if the policy reports them: `exchange.policy.planning`
    section   0 age, fact, sequence: an own fragment that is a whole block of a single fact
              100 age, part, facts, sequence: any other own fragment
              101 origin w(origins), epoch 2 or more, age, part, facts, sequence: a relayed fragment
              1100 role w(instances), value 8 (two's complement): an influence signal
              1101 origin w(origins), epoch 2 or more, highest + 1 w(items), mask 8: a summary of the received set
    part      part of a larger block 1 [index 4, count - 1 4]
    facts     fact | another follows 1 [fact | another follows 1 ...]
    fact      subject w(instances) | attribute w(those exchanged + 1), another's is longer | value
              [| uncertain 1 [| uncertainty]]

Absent sections cost no bits. A truncated packet lacks its end marker and is refused. Ages count from the start of the
slot. Per origin and epoch, the first sequence of a packet is absolute, the others are steps from their predecessor; see
`exchange.wire.fragmentcodec` for both codes. A status has no sequence: a whole block is a status if, and only if, all
its attributes are latest-only. A fragment is relayed unless it belongs to the sender in its present epoch.

The hash covers grammar, TBox and all widths in 32 bits; the packet of frame k carries byte k mod 4, so different
definitions show within four frames (`exchange.wire.definitions`). The byte is XORed with the higher bits of the frame
and with the sender's *era* (the higher bits of its epoch; 0 in the first four incarnations).
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Collection, Iterable, Sequence
from copy import copy
from functools import lru_cache
from typing import NamedTuple

from exchange.errors import ConfigurationError, DefinitionFault, PeerFault
from exchange.packets import (
    MASK_BITS,
    NO_ACCOUNT,
    Account,
    DecodedPacket,
    Fragment,
    Head,
    InfluenceSignal,
    Life,
    Named,
    Packet,
    Summary,
    name_of_item,
)
from exchange.policy.acknowledgement import fields
from exchange.policy.planning import width
from exchange.policy.policies import AckPolicy, bits_beside, header_bits
from exchange.wire.accounts import AccountCodec
from exchange.wire.factcodec import Bits, FactCodec, FieldSize, Reader, joined, natural, padded, read_natural
from exchange.wire.fragmentcodec import EPOCH_BITS, EPOCH_MASK, Before, FragmentCodec, Packing, refuse_epoch
from exchange.wire.sealing import DAMAGED, UNOPENED, Checksum, Seal, nonce_of
from worldmodel import EPOCHS, STATUS, Block, PropertyValue, TBox

GRAMMAR = 2
"""Version of the layout; increase it with every change, since the hash covers widths only."""
HASH_BITS = 8
"""Size of the definition hash in one packet."""
HASH_BYTES = 4
"""Bytes of the definition hash; a packet carries one of them, by its frame."""
FRAME_BITS = 2
"""Size of the frame counter (frame modulo 4)."""
FRAMES = 1 << FRAME_BITS
END_BITS = (0b111, 3)
SIGNAL_VALUE_BITS = 8
ERAS = EPOCHS >> EPOCH_BITS
"""Number of eras. The head carries the epoch modulo 4, the hash byte the era (epoch // 4)."""
ERA_FACTORS = (0x01, 0x9D, 0x3B, 0xE7)
"""Factor by byte of the hash: era times factor, modulo 256, is XORed into the byte.

No era imitates another frame in all four bytes.
"""
ERA_INVERSES = (0x01, 0xB5, 0xF3, 0xD7)
SIGNAL_BITS, SUMMARY_BITS = (0b1100, 4), (0b1101, 4)
RECENT_S = 30.0
"""Default age (s) of observations up to which a time takes the fewest bits."""


class Widths(NamedTuple):
    """Parameters of field widths beside the sizes of fleet and mission.

    ``exchanged`` attributes, which some vehicle needs, get short names; None for all. Times of an age up to
    ``recent_s``, such as a TDMA frame, take the fewest bits.
    """

    time_resolution_s: float = 0.1
    exchanged: Collection[int] | None = None
    recent_s: float = RECENT_S


class Framing(NamedTuple):
    """Size of the checksum (0, 8, 16 or 32 bits), and fleet key, None for no encryption."""

    crc_bits: int = 0
    key: bytes | None = None


USUAL_WIDTHS = Widths()
USUAL_FRAMING = Framing()


def _guard_listing(seal: Seal | None, head_padding_bits: int, checksum: Checksum | None) -> list[FieldSize]:
    sizes = []
    if seal is not None:
        sizes.append(FieldSize("packet", "head to a byte", head_padding_bits, "the head stays in clear"))
        sizes.append(FieldSize("packet", "tag", seal.size_bits, "of the encrypted rest; it covers head and slot too"))
    if checksum is not None:
        sizes.append(FieldSize("packet", "checksum", checksum.size_bits, "of all before it"))
    return sizes


class Codec:
    """Packet codec of one fleet: fixed TBox, node count, instance count and policy.

    Args:
        n_instances: instance uids 0..n_instances-1 have wire names.
        n_nodes: 2..256, by the byte that names a sender to the encryption.
        n_items: expected items per vehicle and epoch; later ones take more bits.
        duration_s: latest expected time of observation; later ones take more bits.

    Raises ConfigurationError for an invalid checksum or key size, or no encryption library.
    """

    def __init__(
        self,
        tbox: TBox,
        n_instances: int,
        n_nodes: int,
        policy: AckPolicy,
        n_items: int,
        duration_s: float,
        widths: Widths = USUAL_WIDTHS,
        framing: Framing = USUAL_FRAMING,
    ) -> None:
        crc_bits, key = framing
        self._n_nodes = n_nodes
        self._policy = policy
        self._facts = FactCodec(tbox, n_instances, widths.exchanged)
        resolution_s = widths.time_resolution_s
        self.fragments = FragmentCodec(self._facts, n_nodes, n_items, duration_s, resolution_s, widths.recent_s)
        """Codec of fragments."""
        self.fragment_bits = self.fragments.most_bits
        """``fragment_bits(fragment, relayed=True)``: upper bound of a fragment's size in any packet."""
        self._role_bits = self._facts.subject_bits
        self.signal_bits = SIGNAL_BITS[1] + self._role_bits + SIGNAL_VALUE_BITS
        """Size of one influence signal."""
        self._node_bits = width(n_nodes)
        self._clear_bits = HASH_BITS + self._node_bits + EPOCH_BITS + FRAME_BITS
        self._clear_bytes = -(-self._clear_bits // 8)
        self._kind = kind = policy.acknowledgement
        self._acks_bits = header_bits(policy, n_nodes)
        self._most_acks = self._acks_bits - bits_beside(kind)
        self.accounts = AccountCodec(self.fragments, n_nodes, kind.codes) if kind.states else None
        """Codec of holdings sections; None if the policy does not report received sets."""
        fleet = tbox.hash, n_instances, n_nodes, n_items, self._acks_bits
        times = duration_s, resolution_s, self._facts.names.exchanged, self.fragments.near_bits
        shape = GRAMMAR, *fleet, *times, crc_bits, key is not None
        shape = *shape, *(((kind.name, kind.codes),) if kind.states else ())
        self._checksum = None if crc_bits == 0 else Checksum(crc_bits, DAMAGED if key is None else UNOPENED)
        self._seal = None if key is None else Seal(key)
        self.head_bits = 8 * self._clear_bytes if self._seal is not None else self._clear_bits
        """Bits before the acknowledgements; whole bytes if the remainder is encrypted."""
        guard_bits = sum(guard.size_bits for guard in (self._checksum, self._seal) if guard is not None)
        self.overhead_bits = self.head_bits + self._acks_bits + END_BITS[1] + guard_bits
        """Bits of a packet without sections, with the largest acknowledgement header."""
        self.encode_summary = lru_cache(maxsize=256)(self._encode_summary)
        """Encode a summary (cached, since its size is asked before); raise ConfigurationError for an invalid epoch."""
        self.is_sealed = key is not None
        """True if a key encrypts the packets."""
        self.definition = zlib.crc32(repr(shape).encode()).to_bytes(HASH_BYTES, "big")
        """Definition hash (4 bytes) of grammar, TBox, fleet, policy and widths."""
        self.head = lru_cache(maxsize=32)(self._head)
        """``head(data) -> Head``, epoch and frame modulo 4; raises PeerFault if invalid."""
        self.decode = lru_cache(maxsize=32)(self._decode)
        """``decode(data, frame=0, slot_start_s=0.0, era=0) -> DecodedPacket``, cached for all receivers.

        Raises DefinitionFault if the hash byte is that of another definition, frame or era of the sender.
        """

    # Sizes ---------------------------------------------------------------------------------------

    def packing(self, sender: int, epoch: int, slot_start_s: float, room_bits: int) -> Packing:
        """Return an empty packing for the fragments of a packet."""
        return Packing(self.fragments, sender, epoch, slot_start_s, room_bits)

    def spare_bits(self, sender: int, frame: int) -> int:
        """Return the bits that the acknowledgements of ``sender`` in a TDMA frame leave of the largest header."""
        return self._most_acks - len(fields(self._kind, self._n_nodes, frame % self._kind.period_frames, sender))

    def listing(self) -> tuple[FieldSize, ...]:
        """List every field in wire order with its size in this fleet.

        Group ``packet`` occurs once per packet, ``fragment`` per fragment, ``fact`` per fact.
        """
        frames, senders = range(self._kind.period_frames), range(self._n_nodes)
        varies = any(self.spare_bits(sender, frame) for frame in frames for sender in senders)
        policy = f"policy {self._policy.name}" + (", the largest" if varies else "")
        of_hash = f"of {8 * HASH_BYTES} bits a byte in turn: grammar, TBox, fleet, policy"
        return (
            FieldSize("packet", "definition hash", HASH_BITS, of_hash),
            FieldSize("packet", "sender", self._node_bits, f"one of {self._n_nodes} nodes"),
            FieldSize("packet", "epoch", EPOCH_BITS, "incarnation of the sender, modulo 4; the hash byte has the rest"),
            FieldSize("packet", "frame", FRAME_BITS, f"TDMA frame modulo {FRAMES}: with the sender it names the slot"),
            FieldSize("packet", "acknowledgements", self._acks_bits, policy),
            FieldSize("packet", "end", END_BITS[1], "after the last section"),
            *_guard_listing(self._seal, self.head_bits - self._clear_bits, self._checksum),
            *self.fragments.listing(),
            *self._facts.listing(),
            FieldSize("signal", "signal", SIGNAL_BITS[1], "prefix"),
            FieldSize("signal", "role", self._role_bits, "its instance"),
            FieldSize("signal", "value", SIGNAL_VALUE_BITS, "-128 to 127"),
            FieldSize("summary", "summary", SUMMARY_BITS[1], "prefix"),
            FieldSize("summary", "origin", self.fragments.origin_bits, "whose items"),
            FieldSize("summary", "origin's epoch", EPOCH_BITS, "more bits from 3 on"),
            FieldSize("summary", "highest", self.fragments.sequence_bits, "all up to it are held; more bits beyond"),
            FieldSize("summary", "mask", MASK_BITS, "which of those behind the first gap are held"),
        )

    # To bits -------------------------------------------------------------------------------------

    def _hash_byte(self, frame: int, era: int) -> int:
        number = frame % HASH_BYTES
        return self.definition[number] ^ (frame // FRAMES & 0xFF) ^ (era * ERA_FACTORS[number] & 0xFF)

    def era_of(self, data: bytes, frame: int) -> int | None:
        """Return the sender's era by the hash byte of a packet of that frame; None if invalid."""
        number = frame % HASH_BYTES
        era = (data[0] ^ self._hash_byte(frame, 0)) * ERA_INVERSES[number] & 0xFF
        return era if era < ERAS else None

    def encode_acks(self, sender: int, acks: int, frame: int) -> Bits:
        """Encode the acknowledgements that the header carries, as a matrix with its first row most significant."""
        n_nodes, bits = self._n_nodes, 0
        carried = fields(self._kind, n_nodes, frame % self._kind.period_frames, sender)
        for row, _, ago in carried:
            place = (frame * n_nodes + sender - ago) % (2 * n_nodes)
            bits = bits << 1 | acks >> place * n_nodes + row & 1
        return bits, len(carried)

    def encode_head(self, head: Head) -> int:
        """Encode the head in ``head_bits`` bits from whole frame and epoch numbers."""
        if not 0 <= head.epoch < EPOCHS:
            refuse_epoch(head.epoch)
        first = self._hash_byte(head.frame, head.epoch >> EPOCH_BITS)
        bits = (first << self._node_bits | head.sender) << EPOCH_BITS | head.epoch & EPOCH_MASK
        bits = bits << FRAME_BITS | head.frame % FRAMES
        return bits << self.head_bits - self._clear_bits

    def _encode_summary(self, summary: Summary) -> Bits:
        refuse_epoch(summary.epoch)
        life = self.fragments.encode_life(summary.origin, summary.epoch)
        highest = natural(summary.highest + 1, self.fragments.sequence_bits)
        return joined(SUMMARY_BITS, life, highest, (summary.mask, MASK_BITS))

    def encode(
        self,
        sender: int,
        acks: int,
        fragments: Iterable[Fragment] = (),
        signals: Sequence[InfluenceSignal] = (),
        frame: int = 0,
        epoch: int = 0,
        slot_start_s: float = 0.0,
        summary: Sequence[Summary] = (),
        account: Account = NO_ACCOUNT,
    ) -> bytes:
        """Encode a packet.

        ``acks`` as in ``Packet``; ``frame`` is the whole TDMA frame number, which selects the header layout;
        ``slot_start_s`` the start of the sender's slot in it. ``account`` is ignored if the policy does not report
        received sets. Raises ConfigurationError if a value, epoch or signal has no wire format.
        """
        packing = self.packing(sender, epoch, slot_start_s, 1 << 40)
        for fragment in fragments:
            packing.add(fragment)
        head, header = Head(sender, epoch, frame), self.encode_acks(sender, acks, frame)
        if self.accounts is not None:
            header = joined(header, self.accounts.encode(account, sender))
        return self.assembled(head, slot_start_s, header, packing.wired()[0], signals, summary)

    def assembled(
        self,
        head: Head,
        slot_start_s: float,
        acks: Bits,
        fragments: Iterable[Bits],
        signals: Iterable[InfluenceSignal],
        summary: Iterable[Summary],
    ) -> bytes:
        """Assemble a packet; ``head`` has whole frame and epoch numbers.

        Raises ConfigurationError for a signal outside -128..127 or an invalid epoch.
        """
        parts = [(self.encode_head(head), self.head_bits), acks, *fragments]
        for role, value in signals:
            if not -128 <= value <= 127:
                raise ConfigurationError(f"influence signal {value}: a signed byte holds -128 to 127")
            word = (SIGNAL_BITS[0] << self._role_bits | role) << SIGNAL_VALUE_BITS | value & 0xFF
            parts.append((word, self.signal_bits))
        data = padded(joined(*parts, *map(self.encode_summary, summary), END_BITS))
        if self._seal is not None:
            nonce = nonce_of(head.sender, head.epoch, head.frame, slot_start_s, self.definition)
            clear = data[: self._clear_bytes]
            data = clear + self._seal.sealed(head.sender, clear, data[self._clear_bytes :], nonce)
        if self._checksum is not None:
            data = self._checksum.added(data, head.frame)
        return data

    # From bits -----------------------------------------------------------------------------------

    def _head(self, data: bytes) -> Head:
        n_bytes = self._clear_bytes
        if len(data) < n_bytes:
            raise PeerFault("packet ends inside a field")
        bits = int.from_bytes(data[:n_bytes], "big") >> 8 * n_bytes - self._clear_bits
        epoch, frame = bits >> FRAME_BITS & EPOCH_MASK, bits & FRAMES - 1
        sender = bits >> FRAME_BITS + EPOCH_BITS & (1 << self._node_bits) - 1
        if sender >= self._n_nodes:
            raise PeerFault(f"sender {sender} is not one of {self._n_nodes} nodes")
        return Head(sender, epoch, frame)

    def _decode(self, data: bytes, frame: int = 0, slot_start_s: float = 0.0, era: int = 0) -> DecodedPacket:
        packet, own_row, heard = self._read(data, frame, slot_start_s, era)
        latest_s, concerns, relays, lives = -math.inf, 0, False, set[Life]()
        items: list[Named | Block] = []
        statuses: list[Block] = []
        for fragment in packet.fragments:
            latest_s, concerns = max(latest_s, fragment.time_s), concerns | 1 << fragment.origin
            relays = relays or fragment.origin != packet.sender
            if fragment.sequence == STATUS:
                statuses.append(fragment.block)
                items.append(statuses[-1])
            else:
                items.append(name_of_item(fragment))
                lives.add((fragment.origin, fragment.epoch))
        for summary in packet.summary:
            concerns |= -1 if summary.is_alarm else 1 << summary.origin
        of_items = tuple(statuses), tuple(items) if lives else ()
        return DecodedPacket(packet, latest_s, concerns, relays, *of_items, own_row, heard, frozenset(lives))

    def _read(self, data: bytes, frame: int, slot_start_s: float, era: int) -> tuple[Packet, int, int]:
        """Return a packet, its own and all acknowledged nodes; raise PeerFault for an invalid packet."""
        if self._checksum is not None:  # first: damage must not mark a peer as incompatible
            data = self._checksum.stripped(data, frame)
        if data and data[0] != self._hash_byte(frame, era):
            raise DefinitionFault("definition hash differs: sender uses another TBox or other field widths")
        head, clear_bits = self.head(data), self._clear_bits
        epoch = era << EPOCH_BITS | head.epoch
        if self._seal is not None:
            nonce, clear_bits = nonce_of(head.sender, epoch, frame, slot_start_s, self.definition), 0
            data = self._seal.opened(head.sender, data[: self._clear_bytes], data[self._clear_bytes :], nonce)
        reader = Reader(data, clear_bits)
        if head.frame != frame % FRAMES:
            raise PeerFault(f"a packet of frame {head.frame} modulo {FRAMES} in frame {frame}")
        acks, own_row, heard = self._read_acks(reader, head.sender, frame)
        account = NO_ACCOUNT if self.accounts is None else self.accounts.read(reader, head.sender)
        base, own = self.fragments.base_of(slot_start_s), (head.sender, epoch)
        before: Before = {}
        fragments: list[Fragment] = []
        signals: list[InfluenceSignal] = []
        summary: list[Summary] = []
        longer = reader.bits << 1  # the end has a bit less than the prefixes have
        while True:
            prefix = longer >> reader.left - END_BITS[1] & 0b1111 if reader.left >= END_BITS[1] else 0
            if prefix < 0b1000:
                fragments.append(self.fragments.read_single(reader, own, base, before))
            elif prefix < 0b1100:
                fragments.append(self.fragments.read_other(reader, own, base, before))
            elif prefix == SIGNAL_BITS[0]:
                word = reader.take(self.signal_bits)
                role, value = word >> SIGNAL_VALUE_BITS & (1 << self._role_bits) - 1, word & 0xFF
                signals.append(InfluenceSignal(role, value - 256 if value > 127 else value))
            elif prefix == SUMMARY_BITS[0]:
                summary.append(self._read_summary(reader))
            else:
                break
        reader.left -= END_BITS[1]
        if reader.left >= 8 or reader.bits & (1 << reader.left) - 1:
            raise PeerFault("bits left over behind the packet")
        beside = tuple(signals), epoch, frame, tuple(summary), account
        return Packet(head.sender, acks, tuple(fragments), *beside), own_row, heard

    def _read_acks(self, reader: Reader, sender: int, frame: int) -> tuple[int, int, int]:
        """Decode acknowledgements; return also the nodes acknowledged by the sender, and by any node (bit masks)."""
        n_nodes, acks, own, heard = self._n_nodes, 0, 0, 0
        carried = fields(self._kind, n_nodes, frame % self._kind.period_frames, sender)
        bits = reader.take(len(carried))
        for row, column, ago in reversed(carried):
            if bits & 1:
                place = (frame * n_nodes + sender - ago) % (2 * n_nodes)
                acks |= 1 << place * n_nodes + row
                own |= (row == sender) << column
                heard |= 1 << column
            bits >>= 1
        return acks, own, heard

    def _read_summary(self, reader: Reader) -> Summary:
        reader.left -= SUMMARY_BITS[1]
        origin, epoch = self.fragments.read_life(reader)
        number = read_natural(reader.take, self.fragments.sequence_bits)
        return Summary(origin, epoch, number - 1, reader.take(MASK_BITS))


def renewed(codec: Codec, salt_of: Callable[[int], bytes | None] | None = None) -> Codec:
    """Copy a codec with other salts (see ``Seal``), for another mission under the same key."""
    copied = copy(codec)
    copied._seal = None if codec._seal is None else codec._seal.renewed(salt_of)
    # The cached method of the original is bound to the original and so to its salts.
    copied.decode = lru_cache(maxsize=32)(copied._decode)
    return copied


def refuse_longer_texts(codec: Codec, room_bits: int) -> None:
    """Raise ConfigurationError if a text of an exchanged attribute may exceed ``room_bits``."""
    for kind in codec.fragments.facts.exchanged_texts():
        fact = PropertyValue(0, kind.uid, "x" * kind.most_bytes)
        size_bits = codec.fragment_bits(Fragment(0, 0, 0.0, (fact,), 0, 2))
        if size_bits > room_bits:
            raise ConfigurationError(
                f"a text of {kind.name} may take {size_bits} bits, a packet has room for {room_bits}: lower its "
                "rm:maxBytes, or take a modem with a larger payload"
            )
