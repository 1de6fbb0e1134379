"""Relaying: items of others go on where their origin is hardly heard and this vehicle is.

A policy without repeats leaves it to the origin to send an item until all who need it hold it. Over a link that loses
nearly all that takes for ever, and so it does where the origin hears nothing of the peer and takes it for lost, while a
third vehicle reaches both. What links lose their receivers tell all who hear them: their packets say whose last packets
they have received. A link is worth what the worse of its directions lets through. Where that from a vehicle to the peer
is worth `FAVOUR` times as much as that from the origin, and no other much more still, it sends the items of the origin,
too. Of others count those that news reaches without that peer, on the best ways (the tree of the links that are worth
most): two behind one bad link hear each other best, and neither has what is to be relayed. Nor does who is away count,
who may be lost. Links that lose alike make nobody relay. Policies with repeats need none of this, since all send all.
"""

from __future__ import annotations

from exchange.ledger import columns_of
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
            frame: TDMA frame of a packet that was heard.
            now_s: the time (s).
        """
        self.due_frame = frame + LOOK_FRAMES
        for links, rows in zip(self._links, self.rows, strict=True):
            for sender, link in enumerate(links):
                link.samples += [HEARD if row >> sender & 1 else LOST for row in rows]
            rows.clear()
        lost = [[link.p_reckoned for link in links] for links in self._links]
        between = [share for one, shares in enumerate(lost) for other, share in enumerate(shares) if one != other]
        if FAVOUR * (1.0 - max(between)) >= 1.0 - min(between):  # no link is worth so much more than another
            self._listener.relay(0, now_s)
            return
        worth = [[1.0 - max(lost[one][other], lost[other][one]) for other in self._nodes] for one in self._nodes]
        tree, away, relayed = tree_of(worth), self._peers.away, 0
        for receiver in self._nodes:
            if receiver != self._me and not away >> receiver & 1:
                relayed |= self._cut_off_from(worth[receiver], joined(tree, self._me, 1 << receiver), away)
        self._listener.relay(relayed, now_s)

    def _cut_off_from(self, worth: list[float], near: int, away: int) -> int:
        """Origins, one bit each, whose items hardly get to a peer that takes those of this vehicle, and answers.

        Args:
            worth: of the links between that peer and each node.
            near: nodes, one bit each, that are joined with this vehicle without that peer.
            away: nodes, one bit each, that are not waited for.
        """
        own = worth[self._me]
        if own < EQUAL * max([worth[node] for node in columns_of(near & ~away)]):
            return 0
        hardly = sum([1 << node for node in self._nodes if own > FAVOUR * worth[node]])
        return hardly & (near | away)


def tree_of(worth: list[list[float]]) -> list[int]:
    """Neighbours of each node, one bit each, in the tree of the links that are worth most (Prim 1957).

    >>> tree_of([[0.0, 0.9, 0.1], [0.9, 0.0, 0.5], [0.1, 0.5, 0.0]])
    [2, 5, 2]
    """
    tree, left = [0] * len(worth), dict.fromkeys(range(1, len(worth)), 0)  # by node outside, the best one inside
    while left:
        node = max(left, key=lambda outside: worth[outside][left[outside]])
        inside = left.pop(node)
        tree[node] |= 1 << inside
        tree[inside] |= 1 << node
        left = {one: node if worth[one][node] > worth[one][best] else best for one, best in left.items()}
    return tree


def joined(tree: list[int], start: int, without: int) -> int:
    """Nodes that are joined with one in a tree without some, one bit each.

    >>> joined([2, 5, 2], 0, without=0b010)
    1
    """
    found = frontier = 1 << start
    while frontier:
        neighbours = 0
        for node in columns_of(frontier):
            neighbours |= tree[node]
        frontier = neighbours & ~(found | without)
        found |= frontier
    return found
