"""Relaying of items whose origin has a poor link to a peer that this vehicle reaches.

Without repeats, an origin sends an item until all nodes that need it hold it. Over a link with nearly total loss this
never ends, and an origin that receives nothing of the peer takes it for lost. Loss between others follows from their
acknowledgements. The value of a link is the delivery rate of its worse direction. A vehicle relays an origin's items if
its link to the peer is worth `FAVOUR` times the origin's link, and no other relay is much better. Origins count only if
joined to this vehicle without the peer, in the maximum spanning tree of the link values: of two nodes behind one bad
link, neither has what is to be relayed. Absent nodes do not count. Equal links make no relays. Policies with repeats
need no relays.

If the policy carries no third-party acknowledgements, the origin would resend over its bad link for ever. A sender
therefore leaves such a peer to a node on the best path to it. That node was received passing on the item, or a later
one of that origin. While no other node lacks the item and that relay is received, the item is *suspended*: open, not
counted as delivered, not sent. In case the relay has discarded it, an item is sent again when its age is `AGED` times
that at its last transmission.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from exchange.manager.beliefs import Beliefs
from exchange.manager.interests import Interests
from exchange.manager.peers import HEARD, LOST
from exchange.packets import Packet
from exchange.policy.acknowledgement import members
from exchange.policy.planning import KEPT, loss_of
from worldmodel import Block, WorldModel

LOOK_FRAMES = 4
"""TDMA frames between evaluations of link loss."""
FAVOUR = 4.0
"""Value of a relay's link to a peer over that of the origin."""
EQUAL = 0.8
"""Share of the best link value that suffices, since nodes judge by different packets."""
AGED = 4.0
"""Age of a suspended item, in ages at its last transmission, at which it is sent again."""


class Relaying:
    """Relaying of one vehicle: origins it relays, peers it leaves to other relays."""

    def __init__(self, beliefs: Beliefs, interests: Interests, model: WorldModel) -> None:
        self._me = beliefs.me
        self._nodes = range(beliefs.n_nodes)
        self._beliefs = beliefs
        self._peers = beliefs.peers
        self._interests = interests
        self._model = model
        self.origins = 0
        """Origins (bit mask) whose items and statuses this vehicle relays, until the next evaluation."""
        self._passed_on_s: dict[tuple[int, int], float] = {}  # times of the newest statuses relayed
        self.rows: list[list[int]] = [[] for _ in self._nodes]
        """Acknowledgement rows since the last evaluation, by peer."""
        # As `LossEstimate`, a thousand links in a fleet of 32 nodes: by receiver and sender, and by receiver.
        self._lost = [[0.0] * len(self._nodes) for _ in self._nodes]
        self._weight = [0.0] * len(self._nodes)
        self.due_frame = LOOK_FRAMES
        """TDMA frame of the next evaluation."""
        self.left: list[tuple[int, int]] = []
        """Peers with a poor link to this vehicle, each with every node on the best path to it."""
        self._passed_on = [0 for _ in self._nodes]  # by node: item set of others that it relays

    def look(self, frame: int, now_s: float) -> None:
        """Evaluate the links between others and update the relayed origins."""
        self.due_frame = frame + LOOK_FRAMES
        least, most = 1.0, 0.0
        for receiver, rows in enumerate(self.rows):
            lost_of = self._lost[receiver]
            for row in rows:
                self._weight[receiver] = KEPT * self._weight[receiver] + 1.0
                for sender in self._nodes:
                    lost_of[sender] = KEPT * lost_of[sender] + (HEARD if row >> sender & 1 else LOST)
            rows.clear()
            others, weight = lost_of[:receiver] + lost_of[receiver + 1 :], self._weight[receiver]
            least, most = min(least, loss_of(min(others), weight)), max(most, loss_of(max(others), weight))
        if FAVOUR * (1.0 - most) >= 1.0 - least:  # no link is that much better than another
            self.left, self.origins = [], 0
            return
        lost = [[loss_of(n, self._weight[receiver]) for n in self._lost[receiver]] for receiver in self._nodes]
        worth = [[1.0 - max(lost[node][other], lost[other][node]) for other in self._nodes] for node in self._nodes]
        tree, away, relayed = tree_of(worth), self._peers.away, 0
        ways = ways_from(tree, self._me)
        for receiver in self._nodes:
            if receiver != self._me and not away >> receiver & 1:
                near = [node for node, path in ways if receiver not in (node, *path)]
                relayed |= self._cut_off_from(worth[receiver], sum([1 << node for node in near], 1 << self._me), away)
        cut_off = [(peer, path) for peer, path in ways if worth[peer][path[-1]] > FAVOUR * worth[peer][self._me]]
        # Any node of the path will do: each that passes on an item has it on its way to the peer.
        self.left = [(peer, by) for peer, path in cut_off for by in path]
        self.origins = relayed
        for origin in members(relayed):
            self._interests.adopt(members(self._beliefs.lacked(self._beliefs.origins[origin])), now_s)
        if relayed:  # the node that should send orphaned items may have poor links as well
            self._interests.adopt(self._beliefs.orphans(of_others=True), now_s)

    def pass_on(self, statuses: Iterable[Block]) -> None:
        """Relay statuses of these origins, the newest of each property once."""
        for status in statuses:
            if self.origins >> status.origin & 1 and self._is_news(status):
                self._interests.take_status(status)

    def _is_news(self, status: Block) -> bool:
        """True once per status newer than the known one, which other nodes may have rejected."""
        slot = status.facts[0].subject, status.facts[0].attribute
        known = self._model.latest(*slot)
        newest_s = max(-math.inf if known is None else known.block.time_s, self._passed_on_s.get(slot, -math.inf))
        if newest_s >= status.time_s:
            return False
        self._passed_on_s[slot] = status.time_s
        return True

    def note(self, packet: Packet) -> None:
        """Record which items, with earlier ones of their origins, the sender of a packet passes on."""
        for fragment in packet.fragments:
            column = self._beliefs.column_of.get(fragment.uid)
            if fragment.origin != packet.sender and column is not None:
                self._passed_on[packet.sender] |= self._beliefs.origins[fragment.origin] & (2 << column) - 1

    def resting(self, items: int, frame: int, now_s: float) -> int:
        """Return the open items lacked only by peers that are left to a relay."""
        peers, beliefs, left = self._peers, self._beliefs, list[tuple[int, int]]()
        for peer, by in self.left:
            heard_frame = peers.heard_frame[by]
            if heard_frame is not None and frame - heard_frame <= peers.incoming[by].longest_silence:
                left.append((peer, by))
        resting = items
        for peer in members((1 << beliefs.n_nodes) - 1 & ~peers.away):
            served = beliefs.held[peer] | beliefs.spared[peer]
            for cut_off, by in left:
                if cut_off == peer:
                    served |= self._passed_on[by] & ~beliefs.spared[by]
            resting &= served
        for column in members(resting):
            sent = beliefs.entry(column).candidate
            if sent is None or now_s - sent.observed_s > AGED * (sent.since_s - sent.observed_s):
                resting ^= 1 << column
        return resting

    def _cut_off_from(self, worth: list[float], near: int, away: int) -> int:
        """Return origins (bit mask) with poor links to a peer that this vehicle reaches well.

        ``worth`` has the values of the links between that peer and each node; ``near`` the nodes (bit mask) joined to
        this vehicle without that peer.
        """
        own = worth[self._me]
        if own < EQUAL * max([worth[node] for node in members(near & ~away)]):
            return 0
        hardly = sum([1 << node for node in self._nodes if own > FAVOUR * worth[node]])
        return hardly & (near | away)


def tree_of(worth: list[list[float]]) -> list[int]:
    """Neighbours of each node (bit masks) in the maximum spanning tree (Prim 1957).

    >>> tree_of([[0.0, 0.9, 0.1], [0.9, 0.0, 0.5], [0.1, 0.5, 0.0]])
    [2, 5, 2]
    """
    tree, left = [0] * len(worth), dict.fromkeys(range(1, len(worth)), 0)  # by node outside: best neighbour inside
    while left:
        node = max(left, key=lambda outside: worth[outside][left[outside]])
        inside = left.pop(node)
        tree[node] |= 1 << inside
        tree[inside] |= 1 << node
        left = {out: node if worth[out][node] > worth[out][best] else best for out, best in left.items()}
    return tree


def ways_from(tree: list[int], start: int) -> list[tuple[int, list[int]]]:
    """Path from ``start`` to each other node of a tree, without its end.

    >>> ways_from([2, 5, 2], 0)
    [(1, [0]), (2, [0, 1])]
    """
    ways: list[tuple[int, list[int]]] = [(start, [])]
    for node, path in ways:
        ways += [(beyond, [*path, node]) for beyond in members(tree[node]) if beyond not in path]
    return ways[1:]
