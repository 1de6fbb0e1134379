"""Relaying: items of others go on where their origin is hardly heard and this vehicle is.

A policy without repeats leaves it to the origin to send an item until all who need it hold it. Over a link that loses
nearly all that takes for ever, while a third vehicle reaches both. What the link from an origin to a peer loses the
peer tells all who hear it: its packets say whose last packets it has received. Where a vehicle is received by the
peer `FAVOUR` times as often as the origin is, and no other vehicle much more often still, it sends the items of that
origin, too. Links that lose alike make nobody relay. Policies with repeats need none of this, since all send all.
"""

from __future__ import annotations

from exchange.peering.listening import Listener
from exchange.peering.peers import HEARD, LOST, LossEstimate, PeerStates

LOOK_FRAMES = 4
"""TDMA frames between two looks at what links lose."""
FAVOUR = 4.0
"""How much more of its packets than of those of the origin a peer has to receive of who relays."""
EQUAL = 0.8
"""Who is received so much as often as the best of those who may relay does so, too: all judge by what they heard."""


class Relaying:
    """Whose items one vehicle relays, beside its own.

    Args:
        me: own node index.
        n_nodes: size of the fleet.
        peers, listener: of this node.
    """

    def __init__(self, me: int, n_nodes: int, peers: PeerStates, listener: Listener) -> None:
        self._me = me
        self._nodes = range(n_nodes)
        self._peers = peers
        self._listener = listener
        self.rows: list[list[int]] = [[] for _ in self._nodes]
        """By peer, what its packets have said since the last look of whose packets it has received."""
        self._links = [[LossEstimate() for _ in self._nodes] for _ in self._nodes]  # by receiver and sender
        self.due_frame = LOOK_FRAMES
        """TDMA frame of the next look."""

    def look(self, frame: int, now_s: float) -> None:
        """Judge the links between others by what was heard since the last look, and relay accordingly.

        Args:
            frame: TDMA frame of the own slot that opens.
            now_s: the time (s).
        """
        self.due_frame = frame + LOOK_FRAMES
        relayed = 0
        for receiver in self._nodes:
            rows = self.rows[receiver]
            for sender, link in enumerate(self._links[receiver]):
                link.samples += [HEARD if row >> sender & 1 else LOST for row in rows]
            rows.clear()
            if receiver != self._me and not self._peers.away >> receiver & 1:
                relayed |= self._cut_off_from(receiver)
        self._listener.relay(relayed, now_s)

    def _cut_off_from(self, receiver: int) -> int:
        """Origins, one bit each, whose packets hardly reach a peer that receives those of this vehicle."""
        links = self._links[receiver]
        received = [1.0 - link.link.p_reckoned for link in links]
        best = max(share for node, share in enumerate(received) if node != receiver)
        if received[self._me] < EQUAL * best:
            return 0
        return sum(
            [
                1 << origin
                for origin, share in enumerate(received)
                if origin not in (receiver, self._me) and received[self._me] > FAVOUR * share
            ]
        )
