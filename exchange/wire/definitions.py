"""Definitions that peers have to share: protocol hash, and the handshake of salts.

A packet carries one byte of it, in turn. A packet whose byte differs is refused. That alone would let one packet in 256
of a stranger pass, or three in four where three bytes agree. So the four bytes of each peer are compared once: until
all have agreed, a peer one of whose bytes differed is refused with all that it says, until that byte agrees too, which
is never that of a stranger. Where all have agreed, a byte that differs is damage, and costs the one packet.

The byte is that of the definition and of the sender's era, which grows with every fourth of its lives. A peer may be in
another era than was known: it has begun anew, or this node has and knows none of its peers. One byte does not tell:
that of an old packet, played again four frames later, may be right for the next era. So another era counts when all
four bytes have been right for it, and none for the era known in between. One stranger in 2**26 passes for a peer in
another era.

Under a key none of this is needed. The byte stands in clear, so anybody may write it, and a few packets of noise would
make strangers of all peers. But the seal depends on the definition, the era and the slot. So a packet that opens proves
all bytes at once, and one that does not open changes nothing that is held true of a peer (`ProvenDefinitions`).

Each process draws a salt when it starts. It is two things at once: what its own packets are encrypted by, and what a
peer has to repeat to show that it speaks now, as in RFC 8613, appendix B.2. A packet that tells it is an introduction;
it takes the place of another packet in an own slot::

    head | salt 64 | lacks 8 * ceil(nodes / 8) | node 8, first bytes of its salt 32 [...] | tag 64

``lacks`` has a bit for each node whose packets do not open here yet. The list repeats the salts of those who lack the
sender. The tag is HMAC-SHA-256 by a key that follows from that of the fleet and the definition, over all before it and
the whole number of the slot, of which the head has a part. A hearer takes a salt if the list repeats its own: so the
introduction was made after its own start, by somebody with the key, in the slot in which it was heard. One of another
mission repeats another salt; one of this mission that is played again names another slot.

A vehicle introduces itself in its first slot, then to each who lacks it, and when it hears a packet of one whose salt
it lacks. Noise in the name of a peer that is known makes no introduction due. Two that follow each other are an odd
number of frames apart, so that other packets go in even and in odd frames, whose headers may differ. After the first
two there are slots for what it has to tell between any two introductions.

Sans-io, as the manager: bits and ``now_s`` go in, bits come out, and a log of them repeats it.
"""

from __future__ import annotations

import hmac

from exchange.errors import ConfigurationError, DefinitionFault, PeerFault
from exchange.packets import Head
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import HASH_BYTES, Codec
from exchange.wire.sealing import SALT_BYTES, derived

ALL_BYTES = (1 << HASH_BYTES) - 1


class ComparedDefinitions:
    """What has been compared with the definitions of the peers of one node."""

    def __init__(self) -> None:
        self._agreed: dict[int, int] = {}  # by peer: its bytes that agreed, one bit each
        self._differs: dict[int, int] = {}  # by peer: the number of the byte that differed
        self._claims: dict[int, tuple[int, int]] = {}  # by peer: an era, and the bytes right for it, one bit each
        self._strangers: set[int] = set()  # of those that differ, who has been told of
        self.trusted: set[int] = set()
        """Peers all of whose bytes have agreed, with none right for another era since: nothing need be compared."""

    def agree(self, peer: int, frame: int) -> None:
        """The byte of this frame agrees, so the peer is in the era known and in no other.

        Raises:
            DefinitionFault: another has differed.
        """
        number = frame % HASH_BYTES
        self._claims.pop(peer, None)
        self._agreed[peer] = self._agreed.get(peer, 0) | 1 << number
        if self._differs.get(peer) == number:
            del self._differs[peer]
            self._strangers.discard(peer)
        if peer in self._differs:
            raise DefinitionFault(f"node {peer} uses another TBox or other field widths, by an earlier packet")
        if self._agreed[peer] == ALL_BYTES:
            self.trusted.add(peer)

    def differ(self, peer: int, frame: int) -> bool:
        """The byte of this frame differs; True if this makes the peer a stranger."""
        if self._agreed.get(peer) == ALL_BYTES:
            return False
        self._differs.setdefault(peer, frame % HASH_BYTES)
        may_be_era = peer in self._claims and peer not in self._agreed
        if peer in self._strangers or may_be_era:
            return False
        self._strangers.add(peer)
        return True

    def claim(self, peer: int, frame: int, era: int | None) -> bool:
        """The byte of this frame is right for another era of the peer than the one known; True if it is in that era.

        Args:
            peer: who speaks; frame: in which.
            era: for which the byte is right; None for no era.
        """
        before, numbers = self._claims.pop(peer, (era, 0))
        if era is None or era != before:
            return False
        numbers |= 1 << frame % HASH_BYTES
        self._claims[peer] = era, numbers
        self.trusted.discard(peer)  # so that the next byte that agrees ends the claim
        if numbers != ALL_BYTES:
            return False
        self._agreed[peer] = ALL_BYTES
        self._differs.pop(peer, None)
        return True


class ProvenDefinitions(ComparedDefinitions):
    """Under a key: what opens is proven, and nothing is noted of what does not."""

    def differ(self, peer: int, frame: int) -> bool:
        """Nobody is a stranger by a byte that anybody may write."""
        return False

    def claim(self, peer: int, frame: int, era: int | None) -> bool:
        """Any era may be tried: the packet opens in the true one alone."""
        return True


ECHO_BYTES = 4
"""Of a salt that is repeated: one introduction in 2**32 of another mission repeats that of a hearer by chance."""
ENTRY_BYTES = 1 + ECHO_BYTES
TAG_BYTES = 8
"""Of an introduction: no packet passes for one, and no forgery but one in 2**64."""
N_AT_ONCE = 2
"""Introductions that a vehicle may make in slots that follow each other, when it begins."""
LEAST_FRAMES = 3
"""From one introduction to the next behind these; odd, as all numbers of frames between two of them."""


class Introductions:
    """The introductions of one vehicle.

    Args:
        me: own node index.
        key: of the fleet.
        salt: own, fresh.
        codec: of the fleet; schedule: TDMA.
        payload_bits: size of a packet on the modem.
        tolerance_s: by how much clocks may be apart (s).

    Raises:
        ConfigurationError: a packet has no room for an introduction.
    """

    def __init__(
        self,
        me: int,
        key: bytes,
        salt: bytes,
        codec: Codec,
        schedule: TdmaSchedule,
        payload_bits: int,
        tolerance_s: float,
    ) -> None:
        self._me, self._codec, self._schedule, self._tolerance_s = me, codec, schedule, tolerance_s
        self._head_bytes = codec.head_bits // 8
        self._lacks_bytes = -(-schedule.n_nodes // 8)
        self._list_at = self._head_bytes + SALT_BYTES + self._lacks_bytes
        self._most = (payload_bits // 8 - self._list_at - TAG_BYTES) // ENTRY_BYTES
        if self._most < 1:
            least = self._list_at + ENTRY_BYTES + TAG_BYTES
            raise ConfigurationError(
                f"a packet of {payload_bits // 8} bytes has no room for the {least} by which a vehicle introduces "
                "itself under a key: take a modem with a larger payload"
            )
        self._tag_key = derived(key, b"", b"remoras introductions" + codec.definition, 32)
        self.begin(salt)

    def begin(self, salt: bytes) -> None:
        """Begin anew, with another salt: of the peers nothing is known."""
        self._salts = {self._me: salt}  # of those whose packets open
        self._claims: dict[int, bytes] = {}  # as told last, by all who were heard
        self._owed: dict[int, None] = {}  # peers that lack this vehicle, in the order in which they said so
        self._is_due = True
        self._made: list[int] = []  # TDMA frames of the introductions made

    def salt_of(self, node: int) -> bytes | None:
        """The salt of a node; None for one that has not introduced itself to this vehicle."""
        return self._salts.get(node)

    def miss(self, node: int) -> None:
        """Note that a packet was heard in the name of a node and could not be taken."""
        self._is_due |= self._lacks(node)

    def packet(self, slot: int) -> bytes | None:
        """The introduction that goes in the own slot that opens; None if this is for another packet.

        Args:
            slot: its number.
        """
        frame = self._schedule.frame_of(slot)
        if not (self._is_due or self._owed) or not self._may_go(frame):
            return None
        self._is_due = False
        self._made.append(frame)
        told = list(self._owed)[: self._most]
        for peer in told:
            del self._owed[peer]
        lacks = sum(1 << node for node in range(self._schedule.n_nodes) if self._lacks(node))
        body = self._codec.encode_head(Head(self._me, 0, frame)).to_bytes(self._head_bytes, "big")
        body += self._salts[self._me] + lacks.to_bytes(self._lacks_bytes, "big")
        body += b"".join(bytes((peer,)) + self._claims[peer][:ECHO_BYTES] for peer in told)
        return body + self._tag(body, slot)

    def _may_go(self, frame: int) -> bool:
        """True if an introduction may go in a TDMA frame: an odd number of them after the last, and seldom."""
        since = frame - self._made[-1] if self._made else LEAST_FRAMES
        return since % 2 == 1 and (since >= LEAST_FRAMES or len(self._made) < N_AT_ONCE)

    def hear(self, data: bytes, now_s: float) -> bool:
        """Take in an introduction that arrives at ``now_s``; False if it is none of this fleet, slot and time."""
        body, tag = data[:-TAG_BYTES], data[-TAG_BYTES:]
        if len(body) < self._list_at or (len(body) - self._list_at) % ENTRY_BYTES:
            return False
        try:
            head = self._codec.head(data)
        except PeerFault:
            return False
        slot = self._schedule.slot_named(head, now_s)
        is_true = hmac.compare_digest(tag, self._tag(body, slot))
        if not is_true or head.sender == self._me or not self._schedule.may_arrive(slot, now_s, self._tolerance_s):
            return False
        salt_at, lacks_at = self._head_bytes, self._head_bytes + SALT_BYTES
        salt = self._claims[head.sender] = body[salt_at:lacks_at]
        if int.from_bytes(body[lacks_at : self._list_at], "big") >> self._me & 1:
            self._owed[head.sender] = None
        else:
            self._owed.pop(head.sender, None)
        if bytes((self._me,)) + self._salts[self._me][:ECHO_BYTES] in self._entries(body):
            self._salts[head.sender] = salt
        self._is_due |= self._lacks(head.sender)
        return True

    def _lacks(self, node: int) -> bool:
        """True for a node whose packets do not open here, or no more, since it says that its salt is another now."""
        known = self._salts.get(node)
        return known is None or self._claims.get(node, known) != known

    def _entries(self, body: bytes) -> list[bytes]:
        return [body[at : at + ENTRY_BYTES] for at in range(self._list_at, len(body), ENTRY_BYTES)]

    def _tag(self, body: bytes, slot: int) -> bytes:
        return hmac.digest(self._tag_key, slot.to_bytes(8, "big") + body, "sha256")[:TAG_BYTES]
