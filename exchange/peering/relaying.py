"""Relaying: items of others go on where their origin is hardly heard and this vehicle is.

A policy without repeats leaves it to the origin to send an item until all who need it hold it. Over a link that loses
nearly all that takes for ever, and so it does where the origin hears nothing of the peer and takes it for lost, while a
third vehicle reaches both. What links lose their receivers tell all who hear them: their packets say whose last packets
they have received. A link is worth what the worse of its directions lets through. Where that from a vehicle to the peer
is worth `FAVOUR` times as much as that from the origin, and no other much more still, it sends the items of the origin,
too. Of others count those that news reaches without that peer, on the best ways (the tree of the links that are worth
most): two behind one bad link hear each other best, and neither has what is to be relayed. Nor does who is away count,
who may be lost. Links that lose alike make nobody relay. Policies with repeats need none of this, since all send all.

Under a policy by which nobody tells the origin that a peer holds what was relayed to it, the origin would say that over
its nearly cut link to no end. So whoever sends an item leaves such a peer to a node on the best way there that it heard
pass on the item, or a later one of its origin: that one sends it until all hold it. While nobody else lacks the item,
and that node is heard, it *rests*: it stays open, is not taken for known to the peer, and is not said. Who is judged to
have cause to pass it on is not enough, since others heard other packets, and judge otherwise. In case that a node has
given it up, what is some times as old as when it was said last is said once more.
"""

from __future__ import annotations

from array import array

from exchange.ack import members
from exchange.packets import Packet
from exchange.peering.beliefs import Beliefs
from exchange.peering.listening import Listener
from exchange.peering.peers import HEARD, LOST
from exchange.planning import KEPT, PRIOR_LOSS, PRIOR_WEIGHT

LOOK_FRAMES = 4
"""TDMA frames between two looks at what links lose."""
FAVOUR = 4.0
"""How much more the link from who relays to a peer is worth than that from the origin."""
EQUAL = 0.8
"""Whose link is worth so much of the best relays, too: all judge by what they heard."""
AGED = 4.0
"""What rests is said once more when it is so many times as old as when it was said last."""


class LossesAt:
    """Running estimates of what one receiver loses of each sender, of all of whom a packet of it tells at once.

    Each is as a `LossEstimate` has it; of 32 nodes a vehicle keeps a thousand.

    Args:
        n_nodes: size of the fleet.

    >>> losses = LossesAt(2)
    >>> losses.note([0b01, 0b01, 0b11])
    >>> [round(share, 2) for share in losses.p_reckoned]
    [0.2, 0.6]
    """

    __slots__ = ("_lost", "_weight")

    def __init__(self, n_nodes: int) -> None:
        self._lost = array("d", [0.0] * n_nodes)
        self._weight = 0.0

    def note(self, rows: list[int]) -> None:
        """Take note of what packets have said of whose packets were received, one bit each, in their order."""
        for row in rows:
            self._weight = KEPT * self._weight + 1.0
            for sender, lost in enumerate(self._lost):
                self._lost[sender] = KEPT * lost + (HEARD if row >> sender & 1 else LOST)

    @property
    def p_reckoned(self) -> list[float]:
        """By sender, the share of lost packets to be reckoned with."""
        weight = self._weight + PRIOR_WEIGHT
        return [(lost + PRIOR_LOSS * PRIOR_WEIGHT) / weight for lost in self._lost]


class Relaying:
    """Whose items one vehicle relays beside its own, and which it leaves to others to relay.

    Args:
        beliefs, listener: of this node.
    """

    def __init__(self, beliefs: Beliefs, listener: Listener) -> None:
        self._me = beliefs.me
        self._nodes = range(beliefs.n_nodes)
        self._beliefs = beliefs
        self._peers = beliefs.peers
        self._listener = listener
        self.rows: list[list[int]] = [[] for _ in self._nodes]
        """By peer, what its packets have said since the last look of whose packets it has received."""
        self._losses = [LossesAt(len(self._nodes)) for _ in self._nodes]  # by receiver
        self.due_frame = LOOK_FRAMES
        """TDMA frame of the next look."""
        self.left: list[tuple[int, int]] = []
        """Peers that are nearly cut off from this vehicle, each with every node on the best way to it."""
        self._passed_on = [0 for _ in self._nodes]  # by node, items of others that it sends once it holds them

    def look(self, frame: int, now_s: float) -> None:
        """Judge the links between others by what was heard since the last look, and relay accordingly.

        Args:
            frame: TDMA frame of a packet that was heard.
            now_s: the time (s).
        """
        self.due_frame = frame + LOOK_FRAMES
        for losses, rows in zip(self._losses, self.rows, strict=True):
            losses.note(rows)
            rows.clear()
        lost = [losses.p_reckoned for losses in self._losses]
        between = [share for one, shares in enumerate(lost) for other, share in enumerate(shares) if one != other]
        if FAVOUR * (1.0 - max(between)) >= 1.0 - min(between):  # no link is worth so much more than another
            self.left = []
            self._listener.relay(0, now_s)
            return
        worth = [[1.0 - max(lost[one][other], lost[other][one]) for other in self._nodes] for one in self._nodes]
        tree, away, relayed = tree_of(worth), self._peers.away, 0
        ways = ways_from(tree, self._me)
        for receiver in self._nodes:
            if receiver != self._me and not away >> receiver & 1:
                relayed |= self._cut_off_from(worth[receiver], joined(tree, self._me, 1 << receiver), away)
        cut_off = [(peer, way) for peer, way in ways if worth[peer][way[-1]] > FAVOUR * worth[peer][self._me]]
        self.left = [(peer, by) for peer, way in cut_off for by in way]
        self._listener.relay(relayed, now_s)

    def note(self, packet: Packet) -> None:
        """Note that the sender of a packet that was heard passes on these items, and earlier ones of their origins."""
        for fragment in packet.fragments:
            column = self._beliefs.column_of.get(fragment.uid)
            if fragment.origin != packet.sender and column is not None:
                self._passed_on[packet.sender] |= self._beliefs.origins[fragment.origin] & (2 << column) - 1

    def resting(self, items: int, frame: int, now_s: float) -> int:
        """Those of the open items that only those lack who are left to another.

        Args:
            items: item set of those that are open.
            frame: TDMA frame of the own slot that opens.
            now_s: the time (s).
        """
        peers, beliefs, left = self._peers, self._beliefs, list[tuple[int, int]]()
        for peer, by in self.left:
            heard = peers.heard_frame[by]
            if heard is not None and frame - heard <= peers.longest_silence(by):
                left.append((peer, by))
        everybody = (1 << beliefs.n_nodes) - 1
        for column in members(items):
            served = beliefs.holders[column] | beliefs.spared[column] | peers.away
            for peer, by in left:
                if self._passed_on[by] >> column & 1 and not beliefs.spared[column] >> by & 1:
                    served |= 1 << peer
            waiting = beliefs.entry(column).waiting
            is_due = waiting is None or now_s - waiting.observed_s > AGED * (waiting.since_s - waiting.observed_s)
            if served != everybody or is_due:
                items ^= 1 << column
        return items

    def _cut_off_from(self, worth: list[float], near: int, away: int) -> int:
        """Origins, one bit each, whose items hardly get to a peer that takes those of this vehicle, and answers.

        Args:
            worth: of the links between that peer and each node.
            near: nodes, one bit each, that are joined with this vehicle without that peer.
            away: nodes, one bit each, that are not waited for.
        """
        own = worth[self._me]
        if own < EQUAL * max([worth[node] for node in members(near & ~away)]):
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


def ways_from(tree: list[int], start: int) -> list[tuple[int, list[int]]]:
    """The other nodes of a tree, each with the way to it from one of them, which that one begins.

    >>> ways_from([2, 5, 2], 0)
    [(1, [0]), (2, [0, 1])]
    """
    ways: list[tuple[int, list[int]]] = [(start, [])]
    for node, way in ways:
        ways += [(beyond, [*way, node]) for beyond in members(tree[node]) if beyond not in way]
    return ways[1:]


def joined(tree: list[int], start: int, without: int) -> int:
    """Nodes that are joined with one in a tree without some, one bit each.

    >>> joined([2, 5, 2], 0, without=0b010)
    1
    """
    found = frontier = 1 << start
    while frontier:
        neighbours = 0
        for node in members(frontier):
            neighbours |= tree[node]
        frontier = neighbours & ~(found | without)
        found |= frontier
    return found
