"""Acknowledgement rules of TDMA-based exchange, on bit sets of nodes and slots.

Source: Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world information", sections 5
and 6; sentences in quotation marks are theirs. Of N nodes, node s owns the slots t with t mod N = s and sends in each,
with items or without. A header carries bits A[i][j], "node i received the message sent by j before the transmission
from i". Each bit is a fact about a slot, "node i received the packet of slot t", since the last slot of j before that
of i is known. A node stores, per slot of the last two frames (the *ring*, slot mod 2N), the receivers of its packet. A
set of nodes is an integer: bit j is node j.

One bitwise rule composes headers (`Acknowledgement.header`): a bit of its words is a node in a vehicle, and one of 64
trials in the policy study (`exchange.study.trials`). Invariant under any loss: no node believes that a peer holds an
item which that peer lacks.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import permutations
from typing import NamedTuple


class Acknowledgement(NamedTuple):
    """Kind of acknowledgement: plug-in of plain functions.

    Attributes:
        name: short, as in `m-ack`; part of policy names.
        title: a noun phrase for listings.
        carries: ``carries(n_nodes, frame, sender, row, column)`` is True if the header of `sender` in that TDMA frame
            has the bit A[row][column]. It fixes the layout for sender and receivers. `frame` is below `period_frames`;
            row and column differ, as no node acknowledges itself.
        header: ``header(reported, own, received, holders)`` returns the nodes that a header reports as receivers of a
            packet, for all slots of the last two frames at once. `reported`: receivers reported by peers. `own`: this
            node. `received`: all bits where this node received the packet. `holders`: nodes believed to hold all items
            of a packet with any. Only ``&``, ``|`` and ``~`` are allowed: the study compiles it with a trial in each
            bit. Bits that the header cannot carry are masked afterwards.
        relays: nodes store what headers report about others; otherwise `reported` is empty.
        infers: `header` uses `holders`; otherwise it is empty.
        period_frames: TDMA frames until the header layout repeats.
        lasts: what headers report about a packet is kept while a header can name it; the paper clears it in the next
            slot of its sender.
        states: packets also report received sets, which determine the repeats; see `exchange.policy.planning`.
        codes: repairs are coded symbols, see `exchange.policy.coding`.

    A user's kind that reports own receptions in every second frame only:

    >>> from exchange.policy.policies import ACK, AckPolicy, header_bits
    >>> def every_other_frame(n_nodes, frame, sender, row, column):
    ...     return frame == 0 and row == sender
    >>> title = "acknowledgements in every second frame"
    >>> sparse = Acknowledgement("sparse", title, every_other_frame, ACK.header, period_frames=2)
    >>> [header_bits(AckPolicy(sparse, repeat=False), 5, frame) for frame in (0, 1, 2)]
    [4, 0, 4]
    """

    name: str
    title: str
    carries: Callable[[int, int, int, int, int], bool]
    header: Callable[[int, int, int, int], int]
    relays: bool = False
    infers: bool = False
    period_frames: int = 1
    lasts: bool = False
    states: bool = False
    codes: bool = False


def members(words: int) -> list[int]:
    """Return the elements of a bit set in order.

    >>> members(0b1011)
    [0, 1, 3]
    """
    numbers = []
    while words:
        lowest = words & -words
        numbers.append(lowest.bit_length() - 1)
        words ^= lowest
    return numbers


def slots_ago(n_nodes: int, sender: int, row: int, column: int) -> int:
    """Slots between the packet that A[row][column] refers to and a slot of `sender`.

    >>> slots_ago(5, sender=3, row=3, column=1), slots_ago(5, sender=3, row=1, column=3), slots_ago(5, 3, 1, 2)
    (2, 5, 6)
    """
    return (sender - row) % n_nodes + (row - column) % n_nodes


@lru_cache(maxsize=4096)  # per header of a fleet; N * N calls of ``carries``
def fields(kind: Acknowledgement, n_nodes: int, frame: int, sender: int) -> tuple[tuple[int, int, int], ...]:
    """Return row, column and slots ago of each bit of a header, in wire order."""
    bits = [bit for bit in permutations(range(n_nodes), 2) if kind.carries(n_nodes, frame, sender, *bit)]
    return tuple([(row, column, slots_ago(n_nodes, sender, row, column)) for row, column in bits])


@lru_cache(maxsize=4096)  # 0.9 % of a mission: per header of a fleet; used in every own slot
def layout(kind: Acknowledgement, n_nodes: int, frame: int, sender: int) -> tuple[tuple[int, int], ...]:
    """Return pairs of slots ago and nodes whose acknowledgement of it the header can carry."""
    carried: dict[int, int] = {}
    for row, _, ago in fields(kind, n_nodes, frame, sender):
        carried[ago] = carried.get(ago, 0) | 1 << row
    return tuple(sorted(carried.items()))


class PacketLog:
    """Packets of the last two frames, as one node knows them.

    Sets of nodes by ring place are one integer, so that a rule applies to all slots at once: bit
    ``place * n_nodes + node`` says that the node received the packet of that place.
    """

    def __init__(self, kind: Acknowledgement, me: int, n_nodes: int) -> None:
        self._kind, self.me, self.n_nodes = kind, me, n_nodes
        self._ring, self._all = 2 * n_nodes, (1 << n_nodes) - 1
        self._both = self._all << n_nodes * n_nodes | self._all  # all nodes at the two places of node 0
        self._each = sum([1 << place * n_nodes for place in range(self._ring)])  # node 0 at each place
        self.slot = -1
        """Latest slot opened."""
        self.sent_slot: int | None = None
        """Slot of the last own packet; None before the first."""
        self.heard = 0
        """Nodes whose last packet this node received (bit mask)."""
        self._items = [0] * self._ring  # item set of a packet received or sent, by place
        self._loaded = 0  # all nodes, at the places of packets with items
        self._received = 0  # all nodes, at the places of packets received
        self._reported = 0  # receivers reported by peers

    def open(self, slot: int) -> None:
        """Advance to a slot; clear its ring place and those of slots passed since.

        5.3: "Just before the beginning of every TDMA slot k, each peer clears the bits in the ACK matrices it holds
        where the ACKed peer j = k, as well as the entire ACK matrix last received from peer k".
        """
        # The second clearing is implied: a matrix is about earlier packets, whose places are cleared before it can
        # no longer be reported. Slots more than a ring ago share their places with later ones.
        n_nodes, ring = self.n_nodes, self._ring
        for passed in range(max(self.slot + 1, slot + 1 - ring), slot + 1):
            sender, place = passed % n_nodes, passed % ring
            self.heard &= ~(1 << sender)
            void = ~(self._all << place * n_nodes)
            self._loaded &= void
            self._received &= void
            if self._reported:
                self._reported &= ~self._void(passed)
            self._items[place] = 0
        self.slot = max(slot, self.slot)

    def _void(self, slot: int) -> int:
        """Return the facts that a slot makes void: of all packets of its sender, or of the ring place that it takes."""
        if self._kind.lasts:
            return self._all << slot % self._ring * self.n_nodes
        return self._both << slot % self.n_nodes * self.n_nodes

    @property
    def own_slot(self) -> int:
        """Last own slot up to the latest slot; below 0 if none."""
        return self.slot - (self.slot - self.me) % self.n_nodes

    def last(self, node: int) -> int:
        """Return the item set of a node's last packet; empty if this node missed it."""
        return self._items[(self.slot - (self.slot - node) % self.n_nodes) % self._ring]

    def compose(self, slot: int, items: int, held: Sequence[int]) -> int:
        """Record the own packet of the open slot; return the receivers that it reports, by ring place.

        ``held`` has by node the items that it is believed to hold.
        """
        kind, me, n_nodes, ring = self._kind, self.me, self.n_nodes, self._ring
        self.sent_slot, may = slot, 0
        for ago, nodes in layout(kind, n_nodes, slot // n_nodes % kind.period_frames, me):
            may |= nodes << (slot - ago) % ring * n_nodes
        inferred = self._inferred(may & self._received, held) if kind.infers else 0
        self._load(slot % ring, items)
        return kind.header(self._reported, self._each << me, self._received, inferred) & may

    def _load(self, place: int, items: int) -> None:
        """Set the item set of the packet of a ring place."""
        nodes = self._all << place * self.n_nodes
        self._items[place] = items
        self._loaded = self._loaded | nodes if items else self._loaded & ~nodes

    def _inferred(self, may: int, held: Sequence[int]) -> int:
        """Return the nodes, of those at each place, that are believed to hold all items of the packet."""
        inferred = 0
        for bit in members(may & self._loaded):
            place, node = divmod(bit, self.n_nodes)
            if not self._items[place] & ~held[node]:
                inferred |= 1 << bit
        return inferred

    def learn(self, slot: int, items: int, acks: int, heeded: int) -> list[tuple[int, int]]:
        """Record a received packet with ``items`` (set); return nodes and the items that its ``acks`` confirm.

        5.: "if a packet sent by node A is acknowledged by node B, another node receiving that ACK (either A or C) will
        know that the ACKing peer now holds the information in the ACKed packet".

        Acknowledgements of the nodes in ``heeded`` (bit mask) count.
        """
        place = slot % self._ring
        self._load(place, items)
        self.heard |= 1 << slot % self.n_nodes
        self._received |= self._all << place * self.n_nodes
        # The packet may arrive late, when later slots have made some of its facts void.
        for later in range(max(slot, self.slot - self.n_nodes) + 1, self.slot + 1):
            acks &= ~self._void(later)
        acks &= heeded * self._each  # the product repeats the mask at each ring place
        if self._kind.relays:
            self._reported |= acks
        confirmed = []
        for bit in members(acks & self._loaded):
            place, node = divmod(bit, self.n_nodes)
            confirmed.append((node, self._items[place]))
        return confirmed

    def forget(self, node: int) -> None:
        """Clear the receptions and packets of a node."""
        self._items[node] = self._items[node + self.n_nodes] = 0
        self._loaded &= ~(self._both << node * self.n_nodes)
        self._received &= ~(self._both << node * self.n_nodes)
        self.heard &= ~(1 << node)
        self._reported &= ~(self._each << node)
