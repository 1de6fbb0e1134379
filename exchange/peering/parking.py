"""Parking: what a peer needs is not waited for while it is silent for longer than loss explains.

It is heard again, and catches up. Of whom nobody is heard, the silence says that this vehicle is deaf or far away: it
parks none, and takes whoever is heard next for one that comes back.
"""

from __future__ import annotations

from exchange.ledger import Ledger
from exchange.peering.listening import Listener
from exchange.peering.peers import PeerStates

PARKED = "parked"
"""Event of a peer that is not waited for from now on."""


class Parking:
    """Parks the peers of one vehicle.

    Args:
        me: own node index.
        n_nodes: size of the fleet.
        peers, ledger, listener: of this node.
    """

    def __init__(self, me: int, n_nodes: int, peers: PeerStates, ledger: Ledger, listener: Listener) -> None:
        self._me = me
        self._all = (1 << n_nodes) - 1 & ~(1 << me)
        self._peers = peers
        self._ledger = ledger
        self._listener = listener
        self._is_alone = False

    def look(self, frame: int, now_s: float) -> tuple[tuple[int, str], ...]:
        """Park who is silent for too long as an own slot opens; return who is parked from now on, and that event.

        Asked only where somebody is silent for longer than ``SHORTEST_SILENCE``.

        Args:
            frame: TDMA frame of the slot.
            now_s: the time (s).
        """
        peers = self._peers
        parked = tuple([node for node, n in peers.silences(frame) if n > peers.longest_silence(node)])
        if not parked:
            return ()
        peers.away |= sum([1 << node for node in parked])
        is_alone = self._all and peers.away == self._all
        if is_alone:
            peers.away, self._is_alone = 0, True
            peers.heard_frame[:] = [frame] * len(peers.heard_frame)
        peers.awaited = self._all if self._is_alone else peers.away
        if self._ledger.away != peers.away:
            self._ledger.away = peers.away
            self._listener.reopen(now_s) if is_alone else self._listener.settle()
        return () if is_alone else tuple([(node, PARKED) for node in parked])

    def end(self, node: int) -> None:
        """A peer is heard again."""
        self._is_alone = False
        self._peers.away &= ~(1 << node)
        self._peers.awaited = self._peers.away
