"""Which item is which column: the acknowledgement state speaks of columns, the packets of item UIDs.

An item set is one Python integer: bit c stands for column c. Columns are never used twice, so a set
keeps its meaning for good.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from exchange.ack import Words
from exchange.packets import Fragment, ItemUid
from worldmodel import PropertyValue

ADDRESSED_SHARE = 10
"""An item that those hold to whom it is addressed is needed so many times less by others."""


@dataclass(slots=True)
class Entry:
    """One item as this node sees it; of one that it does not send, the fragment is all.

    ``about`` are the facts by which it is judged who needs it: of its whole block, where this node knows that.
    ``bits``/``size_bits`` is its wire form, relayed or own. ``addressed`` are the peers (bit word) to which this node
    addresses it, beside those that need it.
    """

    fragment: Fragment
    about: tuple[PropertyValue, ...]
    bits: int = 0
    size_bits: int = 0
    priority: int = 0
    weight: int = 0
    addressed: int = 0


class Ledger:
    """Item UID <-> column, and the entry of each column."""

    def __init__(self, n_nodes: int) -> None:
        self._column_of: dict[ItemUid, int] = {}
        self.entries: list[Entry] = []
        self.origins = [0] * n_nodes
        """Item set that originated at each node."""
        self.unneeded = [0] * n_nodes
        """Item set, of those that this node may send, that each peer has no need of."""

    def __contains__(self, uid: ItemUid) -> bool:
        return uid in self._column_of

    def __len__(self) -> int:
        return len(self.entries)

    def column(self, uid: ItemUid) -> int | None:
        """Column of an item; None if this node has never held it."""
        return self._column_of.get(uid)

    def fragment(self, uid: ItemUid) -> Fragment | None:
        """The item as this node holds it; None if it never has."""
        column = self._column_of.get(uid)
        return None if column is None else self.entries[column].fragment

    def uid(self, column: int) -> ItemUid:
        """The item of a column."""
        return self.entries[column].fragment.uid

    def add(self, entry: Entry) -> int:
        """Take in a new item; returns its column."""
        column = len(self.entries)
        self._column_of[entry.fragment.uid] = column
        self.entries.append(entry)
        self.origins[entry.fragment.origin] |= 1 << column
        return column

    def note_heard(self, columns: Iterable[int], believes: Words) -> None:
        """See which of the items all peers hold to which they are addressed: others need them less.

        Args:
            columns: of items that this node goes on sending.
            believes: item set that each node is believed to hold.
        """
        for column in columns:
            entry = self.entries[column]
            peers = [peer for peer in range(len(self.unneeded)) if entry.addressed >> peer & 1]
            if peers and all(believes[peer] >> column & 1 for peer in peers):
                entry.addressed = 0
                entry.priority = max(1, entry.priority // ADDRESSED_SHARE)

    def uids(self, items: int) -> Iterator[ItemUid]:
        """UIDs of an item set, by column."""
        while items:
            lowest = items & -items
            yield self.uid(lowest.bit_length() - 1)
            items ^= lowest
