"""The acknowledgements of TDMA-based exchange as rules on sets of nodes and sets of slots.

Source: Maurelli et al., "TDMA-based exchange policies for multi-robot communication of world information", sections 5
and 6; sentences in quotation marks are theirs. N nodes send in turn: node s owns the slots t with t mod N = s and sends
in each of them, with items or without. A header carries bits A[i][j], "node i received the message sent by j before the
transmission from i". Each bit is a fact about a slot, "node i received the packet of slot t", since the last slot of j
before that of i is known. So a node keeps, for each slot of the last two frames (the *ring*, slot mod 2N), the nodes
that received its packet. A set of nodes is an integer: bit j is node j.

What a header states is one rule, bit by bit (`Acknowledgement.header`): a bit of its words is a node in a vehicle, and
one of 64 trials in the policy study, which has loops of its own (`exchange.study.trials`). One thing always holds,
whatever is lost: no node believes that a peer holds an item which that peer lacks.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple, Protocol


class Acknowledgement(NamedTuple):
    """What a packet's header says about packets heard: a plug-in, made of plain functions.

    Attributes:
        name: short, as in `m-ack`; policies, figures and messages use it.
        title: a noun phrase for listings.
        carries: called with ``(n_nodes, frame, sender, row, column)``.
            True if the header that `sender` sends in that TDMA frame has the bit A[row][column]. Sender and receivers
            ask it alike, so that both know the header's layout and size. `frame` is below `period_frames`. Nobody
            acknowledges itself: row and column differ.
        header: called with ``(said, mine, received, held)`` for each slot of the last two frames.
            Return the nodes that the header states to have received its packet. `said`: what peers stated of that.
            `mine`: this node. `received`: all bits if this node received the packet, else none. `held`: nodes believed
            to hold all items of it, if it has any. Combines words by ``&``, ``|`` and ``~`` alone: the study calls it,
            compiled, with a trial in each bit. What the header cannot carry is left out.
        relays: nodes keep what headers state of the receptions of others; without it `said` is empty.
        infers: `header` goes by `held`; without it `held` is empty.
        period_frames: the layout of headers repeats after so many TDMA frames.
        states: packets state what their senders hold, too, and what they repeat is planned by that; see
            `exchange.planning`.
        codes: they repair by coded symbols, see `exchange.coding`.

    A kind of one's own that states every second frame only what the sender heard:

    >>> from exchange.policies import ACK, AckPolicy, header_bits
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
    states: bool = False
    codes: bool = False


def members(words: int) -> list[int]:
    """Numbers in a set, in order: nodes, columns of items, slots.

    >>> members(0b1011)
    [0, 1, 3]
    """
    numbers = []
    while words:
        lowest = words & -words
        numbers.append(lowest.bit_length() - 1)
        words ^= lowest
    return numbers


Acknowledged = tuple[int, int]
"""Place of a slot in the ring, and the nodes that received its packet."""


def slots_ago(n_nodes: int, sender: int, row: int, column: int) -> int:
    """How long before a slot of `sender` the packet was sent that the bit A[row][column] is about, in slots.

    >>> slots_ago(5, sender=3, row=3, column=1), slots_ago(5, sender=3, row=1, column=3), slots_ago(5, 3, 1, 2)
    (2, 5, 6)
    """
    return (sender - row) % n_nodes + (row - column) % n_nodes


@lru_cache(maxsize=4096)  # for each header of a fleet: asked in every own slot
def layout(kind: Acknowledgement, n_nodes: int, frame: int, sender: int) -> tuple[tuple[int, int], ...]:
    """Slots ago, and the nodes whose acknowledgement of that slot the header can carry."""
    carried: dict[int, int] = {}
    for row in range(n_nodes):
        for column in range(n_nodes):
            if row != column and kind.carries(n_nodes, frame % kind.period_frames, sender, row, column):
                ago = slots_ago(n_nodes, sender, row, column)
                carried[ago] = carried.get(ago, 0) | 1 << row
    return tuple(sorted(carried.items()))


def bits_carried(kind: Acknowledgement, n_nodes: int, frame: int, sender: int) -> int:
    """Size of the acknowledgement header that `sender` sends in a TDMA frame, in bits."""
    return sum([nodes.bit_count() for _, nodes in layout(kind, n_nodes, frame % kind.period_frames, sender)])


def acknowledged(rows: Sequence[int], n_nodes: int, slot: int) -> tuple[Acknowledged, ...]:
    """Facts that the matrix in a packet of that slot states; row i has bit j for A[i][j]."""
    facts: dict[int, int] = {}
    sender = slot % n_nodes
    for row, columns in enumerate(rows):
        for column in members(columns) if columns else ():
            place = (slot - (sender - row) % n_nodes - (row - column) % n_nodes) % (2 * n_nodes)
            facts[place] = facts.get(place, 0) | 1 << row
    return tuple(facts.items())


def passed(since: int, slot: int, n_nodes: int) -> int:
    """Set of the slots after `since` up to `slot`: their places in the ring are taken anew.

    >>> bin(passed(8, 11, 5))
    '0b1000000011'
    """
    ring = 2 * n_nodes
    count = min(slot - since, ring)
    bits = ((1 << count) - 1) << (slot + 1 - count) % ring if count > 0 else 0
    return (bits | bits >> ring) & ((1 << ring) - 1)


class Beliefs(Protocol):
    """What one node believes of the holders of items, which are numbered by column."""

    holders: list[int]
    """By column, the nodes believed to hold the item."""

    def believe(self, column: int, nodes: int) -> None:
        """Believe that these nodes hold the item, too."""


class PacketLog:
    """What one node knows of the packets of the last two frames.

    Args:
        kind: acknowledgement of the policy.
        me: this node.
        n_nodes: size of the fleet.
    """

    def __init__(self, kind: Acknowledgement, me: int, n_nodes: int) -> None:
        self._kind, self.me, self.n_nodes = kind, me, n_nodes
        self._others = (1 << n_nodes) - 1 & ~(1 << me)
        self._ring = 2 * n_nodes
        self.slot = -1
        """The slot to which time has come."""
        self.sent_slot: int | None = None
        """Of the last own packet."""
        self.known = 0
        """Slots of the ring whose packets this node received or sent."""
        self.heard = 0
        """Nodes whose last packet this node received."""
        self.items: list[Sequence[int]] = [()] * self._ring
        """By place in the ring, columns of the items in the packet."""
        self._said = [0] * self._ring  # by place, nodes that peers stated to have received it

    def open(self, slot: int) -> None:
        """Time comes to a slot: its place in the ring is taken anew, and so are those of slots passed since.

        5.3: "Just before the beginning of every TDMA slot k, each peer clears the bits in the ACK matrices it holds
        where the ACKed peer j = k, as well as the entire ACK matrix last received from peer k". What such a matrix says
        is about packets sent before it, and is gone when it can no longer be stated, so the second clearing follows.
        """
        if slot <= self.slot:
            return
        gone = passed(self.slot, slot, self.n_nodes)
        self.known &= ~gone
        self.heard &= ~(gone | gone >> self.n_nodes)
        if self._kind.relays:
            self._forget_said(gone | self._frame_away(gone))
        self.slot = slot

    def _frame_away(self, places: int) -> int:
        """The other packets of the same senders."""
        return (places << self.n_nodes | places >> self.n_nodes) & ((1 << self._ring) - 1)

    def _forget_said(self, places: int) -> None:
        for place in range(self._ring):
            if places >> place & 1:
                self._said[place] = 0

    @property
    def own_slot(self) -> int:
        """The last own slot to which time has come, below 0 if none."""
        return self.slot - (self.slot - self.me) % self.n_nodes

    def last(self, node: int) -> Sequence[int]:
        """Columns of the items in the last packet of a node, as far as it is known."""
        place = (self.slot - (self.slot - node) % self.n_nodes) % self._ring
        return self.items[place] if self.known >> place & 1 else ()

    def note(self, slot: int, items: Sequence[int]) -> None:
        """Remember the items of a packet that was received or sent in a slot."""
        place = slot % self._ring
        self.items[place] = items
        self.known |= 1 << place
        self.heard |= 1 << slot % self.n_nodes & self._others

    def compose(self, slot: int, items: Sequence[int], holders: Sequence[int]) -> list[int]:
        """Remember the own packet of a slot, and return its matrix.

        Args:
            slot: the own one, which is open.
            items: columns of the items in the packet.
            holders: by column, nodes believed to hold the item.
        """
        kind, me, n_nodes, ring = self._kind, self.me, self.n_nodes, self._ring
        self.sent_slot, mine, rows = slot, 1 << me, [0] * n_nodes
        for ago, may in layout(kind, n_nodes, slot // n_nodes % kind.period_frames, me):
            place = (slot - ago) % ring
            sender, received, held = place % n_nodes, 0, 0
            if sender != me and self.known >> place & 1:
                received = -1
                if kind.infers and self.items[place]:
                    held = may
                    for column in self.items[place]:
                        held &= holders[column]
            nodes = kind.header(self._said[place], mine, received, held) & may
            for row in members(nodes) if nodes else ():
                rows[row] |= 1 << sender
        self.note(slot, items)
        return rows

    def learn(self, slot: int, facts: Iterable[Acknowledged], heeded: int, beliefs: Beliefs) -> None:
        """Believe the acknowledgements of a packet received.

        5.: "if a packet sent by node A is acknowledged by node B, another node receiving that ACK (either A or C) will
        know that the ACKing peer now holds the information in the ACKed packet".

        Args:
            slot: of the packet; what it states of senders that have had a slot since is void.
            facts: that it states.
            heeded: nodes of which it is to be believed.
            beliefs: of this node.
        """
        void = 0
        if slot < self.slot:
            void = passed(slot, self.slot, self.n_nodes)
            void |= self._frame_away(void)
        for place, stated in facts:
            nodes = stated & heeded
            if nodes and not void >> place & 1:
                if self._kind.relays:
                    self._said[place] |= nodes
                if self.known >> place & 1:
                    for column in self.items[place]:
                        if nodes & ~beliefs.holders[column]:
                            beliefs.believe(column, nodes)

    def forget(self, node: int) -> None:
        """Forget what a node has received, and its packets."""
        self.known &= ~(1 << node | 1 << node + self.n_nodes)
        self.heard &= ~(1 << node)
        if node != self.me:
            self._said = [nodes & ~(1 << node) for nodes in self._said]
