"""Relaying: items of others go on where their origin is hardly heard and this vehicle is.

A policy without repeats leaves it to the origin to send an item until all who need it hold it. Over a link that loses
nearly all that takes for ever, and so it does where the origin hears nothing of the peer and takes it for lost, while a
third vehicle reaches both. What links lose their receivers tell all who hear them: their packets say whose last packets
they have received. A link is worth what the worse of its directions lets through. Where that from a vehicle to the peer
is worth `FAVOUR` times as much as that from the origin, and no other much more still, it sends the items of the origin,
too. Links that lose alike make nobody relay. Policies with repeats need none of this, since all send all.
"""

from __future__ import annotations

from exchange.peering.listening import Listener
from exchange.peering.peers import HEARD, LOST, LossEstimate, PeerStates

LOOK_FRAMES = 4
"""TDMA frames between two looks at what links lose."""
FAVOUR = 4.0
"""How much more the link from who relays to a peer is worth than that from the origin."""
EQUAL = 0.8
"""Whose link is worth so much of the best relays, too: all judge by what they heard."""


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
        """Origins, one bit each, whose items hardly get to a peer that takes those of this vehicle, and answers."""
        links, back = self._links[receiver], [of_sender[receiver] for of_sender in self._links]
        shares = [
            1.0 - max(link.link.p_reckoned, answer.link.p_reckoned) if node != receiver else 0.0
            for node, (link, answer) in enumerate(zip(links, back, strict=True))
        ]
        own = shares[self._me]
        if own < EQUAL * max(shares):
            return 0
        others = [(1 << origin, share) for origin, share in enumerate(shares) if origin not in (receiver, self._me)]
        return sum([origin for origin, share in others if own > FAVOUR * share])
