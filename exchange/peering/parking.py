"""Parking: what a peer needs is not waited for while it is silent for longer than loss explains.

It is heard again, and catches up. Of whom nobody is heard, the silence says that this vehicle is deaf or far away: it
parks none, and takes whoever is heard next for one that comes back.
"""

from __future__ import annotations

from exchange.peering.beliefs import Beliefs
from exchange.peering.listening import Listener

PARKED = "parked"
"""Event of a peer that is not waited for from now on."""


class Parking:
    """Parks the peers of one vehicle.

    Args:
        beliefs, listener: of this node.
    """

    def __init__(self, beliefs: Beliefs, listener: Listener) -> None:
        self._all = (1 << beliefs.n_nodes) - 1 & ~(1 << beliefs.me)
        self._peers = beliefs.peers
        self._listener = listener

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
        before = peers.away
        peers.away |= sum([1 << node for node in parked])
        is_alone = self._all and peers.away == self._all
        if is_alone:
            peers.away, peers.is_alone = 0, True
            peers.heard_frame[:] = [frame] * len(peers.heard_frame)
        peers.awaited = self._all if peers.is_alone else peers.away
        if peers.away != before:
            self._listener.reopen(now_s) if is_alone else self._listener.settle()
        return () if is_alone else tuple([(node, PARKED) for node in parked])
