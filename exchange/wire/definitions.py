"""Which peers speak by the definition of this node: TBox, fleet, policy and widths of fields, by a hash of 32 bits.

A packet carries one byte of it, in turn. A packet whose byte differs is refused. That alone would let one packet in 256
of a stranger pass, or three in four where three bytes agree. So the four bytes of each peer are compared once: until
all have agreed, a peer one of whose bytes differed is refused with all that it says, until that byte agrees too, which
is never that of a stranger. Where all have agreed, a byte that differs is damage, and costs the one packet.

The byte is that of the definition and of the sender's era, which grows with every fourth of its lives. A peer may be in
another era than was known: it has begun anew, or this node has and knows none of its peers. One byte does not tell:
that of an old packet, played again four frames later, may be right for the next era. So another era counts when all
four bytes have been right for it, and none for the era known in between. One stranger in 2**26 passes for a peer in
another era.
"""

from __future__ import annotations

from exchange.errors import DefinitionFault
from exchange.wire.codec import HASH_BYTES

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
