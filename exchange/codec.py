"""Packets as bits, by field tables that follow from the TBox.

Layout, most significant bit first (sizes in bits; ``w(n) = ceil(log2 n)``)::

    packet    head | acknowledgements (bits that the policy's kind says are carried) | sections | 111 | zeros to a byte
              [| tag 32] [| checksum 8, 16 or 32], see ``exchange.sealing``; with a tag all behind the head is encrypted
    head      definition hash 8 | sender w(nodes) | epoch 2 | frame mod 4 2 [| slot w(slots) | packets - 1 w(slots)]
              [| zeros to a byte]; in brackets first what a slot list needs, then what encryption does
    section   0 age, fact, sequence: an own fragment that is a whole block of a single fact
              100 age, part, facts, sequence: any other own fragment
              101 origin w(nodes), epoch 2, age, part, facts, sequence: a relayed fragment
              1100 role w(instances), value 8 (two's complement): an influence signal
              1101 origin w(nodes), epoch 2, highest + 1 w(items), mask 8: a summary of what the sender holds
    part      part of a larger block 1 [index 4, count - 1 4]
    facts     fact | another follows 1 [fact | another follows 1 ...]
    fact      subject w(instances) | attribute w(those exchanged + 1), another's is longer | value
              [| uncertain 1 [| uncertainty]]

What a packet has not costs it nothing. One that was cut short anywhere lacks its end, and is refused.
An age counts from the start of the slot that the head names; ``exchange.codes`` has its code and that of sequences. Of
one origin and epoch the first sequence in a packet is written as it is, the others by the step from the one before.
A status has no sequence, and no bit says so: a whole block is one if, and only if, all its attributes are latest-only.
Relayed is what is not of the sender in its present epoch. A value out of range is sent exactly, in more bits.

The hash covers the TBox and every width in 32 bits, of which the packet of frame k carries byte k mod 4: two vehicles
with different definitions notice it within four frames, see ``exchange.definitions``. The byte is crossed with the
higher bits of the frame, so that a packet from another frame has another byte, even where the counter is the same.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Collection, Iterable, Sequence
from copy import copy
from functools import lru_cache

from exchange.bits import Reader
from exchange.errors import ConfigurationError, DefinitionFault, PeerFault
from exchange.factcodec import FactCodec
from exchange.fragmentcodec import EPOCH_BITS, Before, FragmentCodec, refuse_epoch
from exchange.header import AckHeader
from exchange.names import width
from exchange.packets import Fragment, Head, InfluenceSignal, Packet
from exchange.packing import Packing
from exchange.policies import AckPolicy
from exchange.sealing import DAMAGED, UNOPENED, Checksum, Seal, nonce_of
from exchange.sidecodec import SideCodec
from exchange.sizes import FieldSize
from exchange.summaries import Summary
from worldmodel import PropertyValue, TBox

HASH_BITS = 8
"""Bits of the definition hash in one packet."""
HASH_BYTES = 4
"""Bytes of the definition hash; a packet carries one of them, by its frame."""
FRAME_BITS = 2
"""Bits of the frame counter: frames are told apart modulo 4."""
FRAMES = 1 << FRAME_BITS
END_BITS = (0b111, 3)
RECENT_S = 30.0
"""Age of an observation up to which it is stated in the fewest bits, unless a codec is told otherwise."""


def _place_listing(n_slots: int) -> tuple[FieldSize, ...]:
    """Fields of the head by a list of so many slots; none without a list."""
    if not n_slots:
        return ()
    return (
        FieldSize("packet", "slot", width(n_slots), f"one of {n_slots} of the frame"),
        FieldSize("packet", "packets", width(n_slots), "of the sender in this frame, less 1"),
    )


def _guard_listing(seal: Seal | None, head_padding_bits: int, crc_bits: int) -> tuple[FieldSize, ...]:
    """Fields of the packet that protect it, if there are any."""
    sealed = (
        ()
        if seal is None
        else (
            FieldSize("packet", "head to a byte", head_padding_bits, "the head stays in clear"),
            FieldSize("packet", "tag", seal.size_bits, "of the encrypted rest; it covers head and slot too"),
        )
    )
    return (*sealed, *([FieldSize("packet", "checksum", crc_bits, "of all before it")] if crc_bits else []))


class Codec:
    """Encodes and decodes packets for one fleet: fixed TBox, node count, instance count and policy.

    Args:
        tbox: the compiled TBox that every vehicle carries.
        n_instances: instance uids 0..n_instances-1 can be told apart on the wire.
        n_nodes: number of vehicles, 2..64.
        policy: fixes the acknowledgement bits of the header.
        n_items: how many items one vehicle is expected to tell in one epoch; later ones take more bits.
        duration_s: latest expected time of an observation; later ones take more bits.
        time_resolution_s: step of these times.
        exchanged: uids of the attributes that somebody needs, which get short names; None for all.
        recent_s: age up to which a time takes the fewest bits; a TDMA frame, say.
        crc_bits: of the checksum of each packet: 0, 8, 16 or 32.
        key: of the fleet, by which all behind the head is encrypted, with a fresh salt; None for in clear.
        n_slots: slots of a frame of which the head names one; 0 where the sender's name says its slot.
        is_by_frame: acknowledgements are about whole frames.

    Raises:
        ConfigurationError: there is no such checksum or key, or no library to encrypt.
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
        recent_s: float = RECENT_S,
        crc_bits: int = 0,
        key: bytes | None = None,
        n_slots: int = 0,
        is_by_frame: bool = False,
    ) -> None:
        self._n_slots = n_slots
        self._place_bits = width(n_slots) if n_slots else 0
        self._n_nodes = n_nodes
        self._policy = policy
        self._facts = FactCodec(tbox, n_instances, exchanged)
        self.fragments = FragmentCodec(self._facts, n_nodes, n_items, duration_s, time_resolution_s, recent_s)
        """Encodes and decodes fragments."""
        self._side = SideCodec(self.fragments)
        self._node_bits = self.fragments.node_bits
        self._clear_bits = HASH_BITS + self._node_bits + EPOCH_BITS + FRAME_BITS + 2 * self._place_bits
        self.header = AckHeader(policy.acknowledgement, n_nodes)
        """Layout of the acknowledgements."""
        fleet = tbox.hash, n_instances, n_nodes, n_items, self.header.largest_bits
        times = duration_s, time_resolution_s, self._facts.names.exchanged, self.fragments.near_bits
        shape = *fleet, *times, crc_bits, key is not None, *((n_slots,) if is_by_frame else ())
        self._checksum = Checksum(crc_bits, DAMAGED if key is None else UNOPENED)
        self._seal = None if key is None else Seal(key)
        self.head_bits = self._clear_bits if self._seal is None else self._clear_bits + -self._clear_bits % 8
        """Bits of a packet before the acknowledgements; whole bytes if what follows is encrypted."""
        self._hash = zlib.crc32(repr(shape).encode()).to_bytes(HASH_BYTES, "big")
        self.decode = lru_cache(maxsize=32)(self._decode)
        """``decode(data, frame=0, slot_start_s=0.0) -> Packet``; all receivers of one broadcast decode the same."""

    @property
    def definition(self) -> bytes:
        """The definition hash, 4 bytes: of TBox, fleet, policy and widths."""
        return self._hash

    # Sizes ---------------------------------------------------------------------------------------

    @property
    def overhead_bits(self) -> int:
        """Bits of a packet without sections, with the largest header of acknowledgements."""
        guard_bits = self._checksum.size_bits + (0 if self._seal is None else self._seal.size_bits)
        return self.head_bits + self.header.largest_bits + END_BITS[1] + guard_bits

    @property
    def signal_bits(self) -> int:
        """Bits of one influence signal."""
        return self._side.signal_bits

    def summary_bits(self, summary: Summary) -> int:
        """Bits of a summary."""
        return self._side.encode_summary(summary)[1]

    def fragment_bits(self, fragment: Fragment, relayed: bool = True) -> int:
        """The most bits that a fragment takes, by default as a relay has to send it, in whatever packet."""
        return self.fragments.most_bits(fragment, relayed)

    def packing(self, sender: int, epoch: int, frame: int, slot_start_s: float, room_bits: int) -> Packing:
        """The room of a packet for fragments, to be filled."""
        return Packing(self, sender, epoch, frame, slot_start_s, room_bits)

    def listing(self) -> tuple[FieldSize, ...]:
        """Every field of a packet in the order of the wire, with its size in this fleet.

        Fields of ``packet`` come once. Those of ``fragment`` come for each fragment, those of ``fact`` for each fact in
        it: subject and attribute, the value of that attribute, and whether another follows.
        """
        named = f"policy {self._policy.name}" + (", the largest" if self.header.varies else "")
        of_hash = f"of {8 * HASH_BYTES} bits a byte in turn: TBox, fleet, policy"
        return (
            FieldSize("packet", "definition hash", HASH_BITS, of_hash),
            FieldSize("packet", "sender", self._node_bits, f"one of {self._n_nodes} nodes"),
            FieldSize("packet", "epoch", EPOCH_BITS, "of the sender: which of its lives"),
            FieldSize("packet", "frame", FRAME_BITS, f"TDMA frame modulo {FRAMES}: with the sender it names the slot"),
            *_place_listing(self._n_slots),
            FieldSize("packet", "acknowledgements", self.header.largest_bits, named),
            FieldSize("packet", "end", END_BITS[1], "behind all that follows"),
            *_guard_listing(self._seal, self.head_bits - self._clear_bits, self._checksum.size_bits),
            *self.fragments.listing(),
            *self._facts.listing(),
            *self._side.listing(),
        )

    def forget(self) -> None:
        """Forget the bits of facts and the packets that are remembered, so that the next ones cost what new ones do."""
        self.decode.cache_clear()
        self._facts.forget()

    # To bits -------------------------------------------------------------------------------------

    def _hash_byte(self, frame: int) -> int:
        return self._hash[frame % HASH_BYTES] ^ (frame // FRAMES & 0xFF)

    def encode_head(self, sender: int, frame: int, epoch: int = 0, place: int = 0, n_turns: int = 1) -> int:
        """The ``head_bits`` bits of the head of a packet, see ``encode``."""
        refuse_epoch(epoch)
        bits = (self._hash_byte(frame) << self._node_bits | sender) << EPOCH_BITS | epoch
        bits = bits << FRAME_BITS | frame % FRAMES
        if self._n_slots:
            bits = (bits << self._place_bits | place) << self._place_bits | n_turns - 1
        return bits << self.head_bits - self._clear_bits

    def encode(
        self,
        sender: int,
        rows: Sequence[int],
        fragments: Iterable[Fragment] = (),
        signals: Sequence[InfluenceSignal] = (),
        frame: int = 0,
        epoch: int = 0,
        slot_start_s: float = 0.0,
        summary: Sequence[Summary] = (),
        place: int = 0,
        n_turns: int = 1,
    ) -> bytes:
        """Bytes of a packet.

        Args:
            sender: node that speaks.
            rows: one acknowledgement bit word per node, shape (n_nodes,).
            fragments: in any order; they arrive by origin and sequence, own ones first.
            signals: influence signals.
            frame: TDMA frame in which the packet is sent; the policy may choose its header by it.
            epoch: of the sender.
            slot_start_s: start of the sender's slot in that frame.
            summary: what the sender holds, by origin.
            place: of its slot in the frame; n_turns: packets that it sends in it. Both go where slots are listed.

        Raises:
            ConfigurationError: a signal that is no signed byte, an epoch too many, or what has no form on the wire.
        """
        head, head_bits = self.encode_head(sender, frame, epoch, place, n_turns), self.head_bits
        bits, size = self.header.encode(sender, rows, frame), self.header.size_bits(sender, frame)
        base = self.fragments.base_of(slot_start_s)
        for _, part, part_bits in self.fragments.encode_all(fragments, sender, epoch, base):
            bits, size = bits << part_bits | part, size + part_bits
        beside = [*map(self._side.encode_signal, signals), *map(self._side.encode_summary, summary)]
        for part, part_bits in beside:
            bits, size = bits << part_bits | part, size + part_bits
        bits, size = bits << END_BITS[1] | END_BITS[0], size + END_BITS[1]
        if self._seal is None:
            bits, size = head << size | bits, size + head_bits
        padding = -size % 8
        data = (bits << padding).to_bytes((size + padding) // 8, "big")
        if self._seal is not None:
            clear = head.to_bytes(head_bits // 8, "big")
            nonce = nonce_of(sender, epoch, frame, slot_start_s, self._hash)
            data = clear + self._seal.sealed(sender, clear, data, nonce)
        return self._checksum.added(data, frame)

    # From bits -----------------------------------------------------------------------------------

    def head(self, data: bytes) -> Head:
        """Who speaks in a packet, in which of its lives and in which frame modulo 4.

        Raises:
            PeerFault: it is too short, or no node has that number.
        """
        return self._read_head(Reader(data))

    def _read_head(self, reader: Reader) -> Head:
        reader.take(HASH_BITS)
        sender = reader.take(self._node_bits)
        if sender >= self._n_nodes:
            raise PeerFault(f"sender {sender} is not one of {self._n_nodes} nodes")
        epoch, frame = reader.take(EPOCH_BITS), reader.take(FRAME_BITS)
        if not self._n_slots:
            return Head(sender, epoch, frame)
        place, more = reader.take(self._place_bits), reader.take(self._place_bits)
        if max(place, more) >= self._n_slots:
            raise PeerFault(f"slot {place} and {more + 1} packets in a frame of {self._n_slots} slots")
        return Head(sender, epoch, frame, place, more + 1)

    def _decode(self, data: bytes, frame: int = 0, slot_start_s: float = 0.0) -> Packet:
        """The packet of ``data``.

        Args:
            data: as it was heard.
            frame: in which it was sent.
            slot_start_s: start of the slot in which it was sent.

        Raises:
            DefinitionFault: its sender uses another definition, or it is of another frame.
            PeerFault: it cannot be a packet of this fleet.
        """
        told = self._checksum.stripped(data, frame)  # first: damage makes nobody a stranger
        if told and told[0] != self._hash_byte(frame):
            raise DefinitionFault("definition hash differs: sender uses another TBox or other field widths")
        reader = Reader(told)
        head = self._read_head(reader)
        if self._seal is not None:
            clear = told[: self.head_bits // 8]
            nonce = nonce_of(*head[:2], frame, slot_start_s, self._hash)
            reader = Reader(self._seal.opened(head.sender, clear, told[len(clear) :], nonce))
        if head.frame != frame % FRAMES:
            raise PeerFault(f"a packet of frame {head.frame} modulo {FRAMES} in frame {frame}")
        rows = self.header.decode(head.sender, frame, reader.take)
        base, own = self.fragments.base_of(slot_start_s), (head.sender, head.epoch)
        before: Before = {}
        fragments: list[Fragment] = []
        signals: list[InfluenceSignal] = []
        summary: list[Summary] = []
        while True:
            if not reader.bit():
                fragments.append(self.fragments.read_single(reader, own, base, before))
            elif not reader.take(1):
                fragments.append(self.fragments.read_other(reader, own, base, before))
            elif reader.take(1):
                break
            elif not reader.take(1):
                signals.append(self._side.read_signal(reader))
            else:
                summary.append(self._side.read_summary(reader))
        if not reader.padding_is_clean():
            raise PeerFault("bits left over behind the packet")
        beside = tuple(signals), head.epoch, frame, tuple(summary), head.n_turns
        return Packet(head.sender, rows, tuple(fragments), *beside)


def renewed(codec: Codec, salt_of: Callable[[int], bytes | None] | None = None) -> Codec:
    """The codec for another mission under the same key, whose packets the first one does not open.

    Args:
        codec: of a fleet with a key.
        salt_of: the salt of each sender, None for one that is not known yet; without it a fresh one for all.
    """
    found = copy(codec)
    found._seal = None if codec._seal is None else codec._seal.renewed(salt_of)
    found.decode = lru_cache(maxsize=32)(found._decode)
    return found


def refuse_longer_texts(codec: Codec, room_bits: int) -> None:
    """Raise ConfigurationError if a text that may be told is larger than the room of a packet."""
    for kind in codec.fragments.facts.exchanged_texts():
        fact = PropertyValue(0, kind.uid, "x" * kind.most_bytes)
        size_bits = codec.fragment_bits(Fragment(0, 0, 0.0, (fact,), 0, 2))
        if size_bits > room_bits:
            raise ConfigurationError(
                f"a text of {kind.name} may take {size_bits} bits, a packet has room for {room_bits}: lower its "
                "rm:maxBytes, or take a modem with a larger payload"
            )
