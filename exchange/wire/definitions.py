"""Which peers speak by the definition of this node: TBox, fleet, policy and widths of fields, by a hash of 32 bits.

A packet carries one byte of it, in turn. A packet whose byte differs is refused. That alone would let one packet in 256
of a stranger pass, or three in four where three bytes agree. So the four bytes of each peer are compared once: until
all have agreed, a peer one of whose bytes differed is refused with all that it says, until that byte agrees too, which
is never that of a stranger. Where all have agreed, a byte that differs is damage, and costs the one packet.
"""

from __future__ import annotations

from exchange.errors import PeerFault
from exchange.wire.codec import HASH_BYTES

ALL_BYTES = (1 << HASH_BYTES) - 1


class ComparedDefinitions:
    """What has been compared with the definitions of the peers of one node."""

    def __init__(self) -> None:
        self._agreed: dict[int, int] = {}  # by peer: its bytes that agreed, one bit each
        self._differs: dict[int, int] = {}  # by peer: the number of the byte that differed
        self.trusted: set[int] = set()
        """Peers all of whose bytes have agreed: nothing need be compared any more."""

    def agree(self, peer: int, frame: int) -> None:
        """The byte of this frame agrees.

        Raises:
            PeerFault: another has differed.
        """
        number = frame % HASH_BYTES
        self._agreed[peer] = self._agreed.get(peer, 0) | 1 << number
        if self._differs.get(peer) == number:
            del self._differs[peer]
        if peer in self._differs:
            raise PeerFault(f"node {peer} uses another TBox or other field widths, by an earlier packet")
        if self._agreed[peer] == ALL_BYTES:
            self.trusted.add(peer)

    def differ(self, peer: int, frame: int) -> bool:
        """The byte of this frame differs; True if this makes the peer a stranger."""
        if peer in self._differs or self._agreed.get(peer) == ALL_BYTES:
            return False
        self._differs[peer] = frame % HASH_BYTES
        return True
