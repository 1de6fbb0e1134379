"""Agreement of peers on definitions: comparison of protocol hashes, handshake of salts.

Each packet carries one byte of the 4-byte definition hash, in turn; a packet with another byte is refused. One byte
alone passes one foreign packet in 256, so all four are compared once per peer. Until all four have agreed, a differing
byte makes the peer incompatible until that byte agrees. After that, a differing byte is damage of one packet.

The byte also depends on the sender's era (epoch // 4). A peer in another era has restarted, or this node has restarted
and lost its peers. A replayed packet may match the next era by one byte. Another era therefore takes effect after all
four bytes match it and none matched the known era in between: a foreign sender passes with probability 2**-26.

Under a key, the hash byte is forgeable but the seal depends on definition, era and slot. A packet that opens proves all
bytes; one that does not open changes no state about a peer (`ProvenDefinitions`).

Each process draws a salt at its start. It seeds the encryption of its packets and is the freshness challenge that a
peer repeats (RFC 8613, appendix B.2). An introduction packet takes the place of a packet in an own slot::

    head | salt 64 | lacks 8 * ceil(nodes / 8) | node 8, first bytes of its salt 32 [...] | tag 64

``lacks`` has a bit per node whose packets do not open here. The list repeats the salts of nodes that lack the sender.
The tag is HMAC-SHA-256 over all before it and the whole slot number, under a key derived from fleet key and definition.
A receiver accepts a salt if the list repeats its own: the introduction was made after the receiver's start, by a key
holder, in this slot. Replays fail: another mission repeats another salt, this mission names another slot.

A vehicle introduces itself in its first slot, to each node that lacks it, and on a packet of a node whose salt it
lacks. Forged packets of a known peer trigger none.

Sans-io, as the manager: bits and ``now_s`` in, bits out; a log replays it.
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
    """Comparison of the definitions of peers, as one node knows it."""

    def __init__(self) -> None:
        self._agreed: dict[int, int] = {}  # by peer: bit set of bytes that agreed
        self._differs: dict[int, int] = {}  # by peer: the number of the byte that differed
        self._claims: dict[int, tuple[int, int]] = {}  # by peer: an era, bit set of matching bytes
        self._strangers: set[int] = set()  # incompatible peers already reported

    def agree(self, peer: int, frame: int) -> None:
        """Record a byte that matches the known era; raise DefinitionFault if another byte differed."""
        number = frame % HASH_BYTES
        self._claims.pop(peer, None)
        self._agreed[peer] = self._agreed.get(peer, 0) | 1 << number
        if self._differs.get(peer) == number:
            del self._differs[peer]
            self._strangers.discard(peer)
        if peer in self._differs:
            raise DefinitionFault(f"node {peer} uses another TBox or other field widths, as an earlier packet showed")

    def differ(self, peer: int, frame: int) -> bool:
        """Record that the byte of this frame differs; return True if the peer becomes incompatible."""
        if self._agreed.get(peer) == ALL_BYTES:
            return False
        self._differs.setdefault(peer, frame % HASH_BYTES)
        # A peer without an agreed byte may be in a later era, as long as its bytes match one.
        may_be_era = peer in self._claims and peer not in self._agreed
        if peer in self._strangers or may_be_era:
            return False
        self._strangers.add(peer)
        return True

    def claim(self, peer: int, frame: int, era: int | None) -> bool:
        """Record the era that matches this frame's byte; return True once all bytes prove it.

        ``era`` is None if the byte matches no era.
        """
        before, numbers = self._claims.pop(peer, (era, 0))
        if era is None or era != before:
            return False
        numbers |= 1 << frame % HASH_BYTES
        self._claims[peer] = era, numbers
        if numbers != ALL_BYTES:
            return False
        self._agreed[peer] = ALL_BYTES
        self._differs.pop(peer, None)
        return True


class ProvenDefinitions(ComparedDefinitions):
    """Definitions under a key: opened packets are proven, others change no state."""

    def differ(self, peer: int, frame: int) -> bool:
        """Ignore the byte, which is not authenticated."""
        return False

    def claim(self, peer: int, frame: int, era: int | None) -> bool:
        """Allow any era to be tried: a packet opens in the true one alone."""
        return True


ECHO_BYTES = 4
"""Bytes of a repeated salt: they match one of another mission with probability 2**-32."""
ENTRY_BYTES = 1 + ECHO_BYTES
TAG_BYTES = 8
"""Tag of an introduction: one forgery in 2**64 passes."""
N_AT_ONCE = 2
"""Introductions allowed at the start before ``LEAST_FRAMES`` applies."""
LEAST_FRAMES = 3
"""Minimum frames between later introductions; odd, as every such distance."""


class Introductions:
    """Salt handshake of one vehicle; ``tolerance_s`` is the largest clock difference.

    Raises ConfigurationError if an introduction does not fit a packet.
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
        """Restart with another salt; forget all peers."""
        self._salts = {self._me: salt}  # of nodes whose packets open
        self._claims: dict[int, bytes] = {}  # salt announced last, by sender
        self._owed: dict[int, None] = {}  # peers that lack the own salt, in order of request
        self._is_due = True
        self._made: list[int] = []  # TDMA frames of the introductions made

    def salt_of(self, node: int) -> bytes | None:
        """Return the accepted salt of a node; None before its introduction."""
        return self._salts.get(node)

    def miss(self, node: int) -> None:
        """Record an unopened packet of ``node``; make an introduction due if its salt is lacking."""
        self._is_due |= self._lacks(node)

    def packet(self, slot: int) -> bytes | None:
        """Return the introduction for an own slot; None to leave the slot to another packet."""
        frame = self._schedule.frame_of(slot)
        if not (self._is_due or self._owed) or not self._may_go(frame):
            return None
        self._is_due = False
        self._made.append(frame)
        echoed = list(self._owed)[: self._most]
        for peer in echoed:
            del self._owed[peer]
        lacks = sum(1 << node for node in range(self._schedule.n_nodes) if self._lacks(node))
        body = self._codec.encode_head(Head(self._me, 0, frame)).to_bytes(self._head_bytes, "big")
        body += self._salts[self._me] + lacks.to_bytes(self._lacks_bytes, "big")
        body += b"".join(bytes((peer,)) + self._claims[peer][:ECHO_BYTES] for peer in echoed)
        return body + self._tag(body, slot)

    def _may_go(self, frame: int) -> bool:
        # An odd distance leaves even and odd frames, whose headers may differ, to other packets; after the first two
        # introductions these always get slots between.
        since = frame - self._made[-1] if self._made else LEAST_FRAMES
        return since % 2 == 1 and (since >= LEAST_FRAMES or len(self._made) < N_AT_ONCE)

    def hear(self, data: bytes, now_s: float) -> bool:
        """Process an introduction received at ``now_s``; return False if it is invalid now."""
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
        # Recorded before it is accepted, since the own introduction repeats it to the sender.
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
        """True if the salt of ``node`` is unknown or no longer the one it announced."""
        known = self._salts.get(node)
        return known is None or self._claims.get(node, known) != known

    def _entries(self, body: bytes) -> list[bytes]:
        return [body[start : start + ENTRY_BYTES] for start in range(self._list_at, len(body), ENTRY_BYTES)]

    def _tag(self, body: bytes, slot: int) -> bytes:
        return hmac.digest(self._tag_key, slot.to_bytes(8, "big") + body, "sha256")[:TAG_BYTES]
