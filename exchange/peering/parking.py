"""Suspension for absent peers: items do not wait for a peer whose silence exceeds loss.

The peer resynchronises at its next packet. If no peer is received, this vehicle is deaf or far away: it suspends none,
and treats the next peer as returning.
"""

from __future__ import annotations

from exchange.peering.beliefs import Beliefs
from exchange.peering.listening import Listener

PARKED = "parked"
"""Event of a peer that becomes absent."""


class Parking:
    """Suspension of absent peers by one vehicle."""

    def __init__(self, beliefs: Beliefs, listener: Listener) -> None:
        self._all = (1 << beliefs.n_nodes) - 1 & ~(1 << beliefs.me)
        self._peers = beliefs.peers
        self._listener = listener

    def look(self, frame: int, now_s: float) -> tuple[tuple[int, str], ...]:
        """Mark peers as absent whose silence exceeds loss; return them with the event."""
        peers, silent = self._peers, self._peers.silences(frame)
        if not silent:
            return ()
        parked = tuple([node for node, n in silent if n > peers.longest_silence(node)])
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
