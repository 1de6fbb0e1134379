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

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple, Protocol


class Acknowledgement(NamedTuple):
    """Kind of acknowledgement: plug-in of plain functions.

    Attributes:
        name: short, as in `m-ack`; part of policy names.
        title: a noun phrase for listings.
        carries: ``carries(n_nodes, frame, sender, row, column)`` is True if the header of `sender` in that TDMA frame
            has the bit A[row][column]. It fixes the layout for sender and receivers. `frame` is below `period_frames`;
            row and column differ, as no node acknowledges itself.
        header: ``header(said, mine, received, held)`` returns the nodes reported as receivers of a packet, for each
            slot of the last two frames. `said`: receivers reported by peers. `mine`: this node. `received`: all bits if
            this node received the packet, else none. `held`: nodes believed to hold all its items, if it has any. Only
            ``&``, ``|`` and ``~`` are allowed: the study compiles it with a trial in each bit. Bits that the header
            cannot carry are masked afterwards.
        relays: nodes store what headers report about others; otherwise `said` is empty.
        infers: `header` uses `held`; otherwise it is empty.
        period_frames: TDMA frames until the header layout repeats.
        states: packets also report received sets, which determine the repeats; see `exchange.planning`.
        codes: repairs are coded symbols, see `exchange.coding`.

    A user's kind that reports own receptions in every second frame only:

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


Acknowledged = tuple[int, int]
"""Ring place of a slot, and the nodes that received its packet."""


def slots_ago(n_nodes: int, sender: int, row: int, column: int) -> int:
    """Slots between the packet that A[row][column] refers to and a slot of `sender`.

    >>> slots_ago(5, sender=3, row=3, column=1), slots_ago(5, sender=3, row=1, column=3), slots_ago(5, 3, 1, 2)
    (2, 5, 6)
    """
    return (sender - row) % n_nodes + (row - column) % n_nodes


@lru_cache(maxsize=4096)  # per header of a fleet; used in every own slot
def layout(kind: Acknowledgement, n_nodes: int, frame: int, sender: int) -> tuple[tuple[int, int], ...]:
    """Return pairs of slots ago and nodes whose acknowledgement of it the header can carry."""
    carried: dict[int, int] = {}
    for row in range(n_nodes):
        for column in range(n_nodes):
            if row != column and kind.carries(n_nodes, frame % kind.period_frames, sender, row, column):
                ago = slots_ago(n_nodes, sender, row, column)
                carried[ago] = carried.get(ago, 0) | 1 << row
    return tuple(sorted(carried.items()))


def bits_carried(kind: Acknowledgement, n_nodes: int, frame: int, sender: int) -> int:
    """Size of the acknowledgement header that `sender` sends in a TDMA frame."""
    return sum([nodes.bit_count() for _, nodes in layout(kind, n_nodes, frame % kind.period_frames, sender)])


def acknowledged(rows: Sequence[int], n_nodes: int, slot: int) -> tuple[Acknowledged, ...]:
    """Convert the matrix of a packet into facts by ring place; row i has bit j for A[i][j]."""
    facts: dict[int, int] = {}
    sender = slot % n_nodes
    for row, columns in enumerate(rows):
        for column in members(columns) if columns else ():
            place = (slot - (sender - row) % n_nodes - (row - column) % n_nodes) % (2 * n_nodes)
            facts[place] = facts.get(place, 0) | 1 << row
    return tuple(facts.items())


def passed(since: int, slot: int, n_nodes: int) -> int:
    """Return the ring places (bit set) of the slots after `since` up to `slot`.

    >>> bin(passed(8, 11, 5))
    '0b1000000011'
    """
    ring = 2 * n_nodes
    count = min(slot - since, ring)
    bits = ((1 << count) - 1) << (slot + 1 - count) % ring if count > 0 else 0
    return (bits | bits >> ring) & ((1 << ring) - 1)


class Beliefs(Protocol):
    """Holders of items as one node believes, by column."""

    holders: list[int]
    """Believed holders (bit mask) by column."""

    def believe(self, column: int, nodes: int) -> None:
        """Add believed holders of an item."""


class PacketLog:
    """Packets of the last two frames, as one node knows them."""

    def __init__(self, kind: Acknowledgement, me: int, n_nodes: int) -> None:
        self._kind, self.me, self.n_nodes = kind, me, n_nodes
        self._others = (1 << n_nodes) - 1 & ~(1 << me)
        self._ring = 2 * n_nodes
        self.slot = -1
        """Latest slot opened."""
        self.sent_slot: int | None = None
        """Slot of the last own packet; None before the first."""
        self.known = 0
        """Ring places of packets that this node received or sent (bit set)."""
        self.heard = 0
        """Nodes whose last packet this node received (bit mask)."""
        self.items: list[Sequence[int]] = [()] * self._ring
        """Columns of a packet's items, by ring place."""
        self._said = [0] * self._ring  # by place, receivers reported by peers

    def open(self, slot: int) -> None:
        """Advance to a slot; clear its ring place and those of slots passed since.

        5.3: "Just before the beginning of every TDMA slot k, each peer clears the bits in the ACK matrices it holds
        where the ACKed peer j = k, as well as the entire ACK matrix last received from peer k". Such a matrix is about
        earlier packets, whose places are cleared by the time it can no longer be reported: the second clearing is
        implied.
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
        """Return the ring places of the other packets of the same senders."""
        return (places << self.n_nodes | places >> self.n_nodes) & ((1 << self._ring) - 1)

    def _forget_said(self, places: int) -> None:
        for place in range(self._ring):
            if places >> place & 1:
                self._said[place] = 0

    @property
    def own_slot(self) -> int:
        """Last own slot up to the latest slot; below 0 if none."""
        return self.slot - (self.slot - self.me) % self.n_nodes

    def last(self, node: int) -> Sequence[int]:
        """Return the columns of a node's last packet; empty if this node missed it."""
        place = (self.slot - (self.slot - node) % self.n_nodes) % self._ring
        return self.items[place] if self.known >> place & 1 else ()

    def note(self, slot: int, items: Sequence[int]) -> None:
        """Record the items of a packet received or sent."""
        place = slot % self._ring
        self.items[place] = items
        self.known |= 1 << place
        self.heard |= 1 << slot % self.n_nodes & self._others

    def compose(self, slot: int, items: Sequence[int], holders: Sequence[int]) -> list[int]:
        """Record the own packet of the open slot; return its acknowledgement matrix."""
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
        """Apply the acknowledgements of a received packet to the beliefs.

        5.: "if a packet sent by node A is acknowledged by node B, another node receiving that ACK (either A or C) will
        know that the ACKing peer now holds the information in the ACKed packet".

        Args:
            slot: of the packet; facts about senders with a later slot up to now are void.
            heeded: nodes (bit mask) whose acknowledgements count.
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
        """Clear the receptions and packets of a node."""
        self.known &= ~(1 << node | 1 << node + self.n_nodes)
        self.heard &= ~(1 << node)
        if node != self.me:
            self._said = [nodes & ~(1 << node) for nodes in self._said]
