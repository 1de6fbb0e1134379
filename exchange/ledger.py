"""Which item is which column: the acknowledgement state speaks of columns, the packets of item UIDs.

An item set is one Python integer: bit c stands for column c. Columns are never used twice, so a set
keeps its meaning for good. `Holdings` count whole blocks of each origin and epoch instead, by their sequence.
"""

from __future__ import annotations

from dataclasses import dataclass

from exchange.ack import Words
from exchange.blocks import joined_block
from exchange.packets import Fragment, ItemUid, Named
from exchange.values import Waiting
from worldmodel import Block, PropertyValue
from worldmodel.facts import Guid

_new = tuple.__new__  # makes a named tuple of a tuple, in half the time

Life = tuple[int, int]
"""An origin and its epoch."""
ADDRESSED_SHARE = 10
"""An item that those hold to whom it is addressed is needed so many times less by others."""


@dataclass(slots=True)
class LedgerEntry:
    """An item that this node may send, as it sees it.

    ``about`` are the facts by which it is judged who needs it: of its whole block, where this node knows that.
    ``addressed`` are the peers (bit word) to which this node addresses it, beside those that need it; ``is_eased`` says
    that these hold it, so that it is needed less by others. ``waiting`` is what it is valued by.
    """

    fragment: Fragment
    about: tuple[PropertyValue, ...]
    priority: int = 0
    addressed: int = 0
    is_eased: bool = False
    waiting: Waiting | None = None


class Ledger:
    """Item UID <-> column, and the item of each column.

    Args:
        n_nodes: size of the fleet.
    """

    def __init__(self, n_nodes: int) -> None:
        self.column_of: dict[ItemUid, int] = {}
        """Column of each item; without one that this node has never held."""
        self.fragments: list[Fragment] = []
        """The item of each column."""
        self.entries: dict[int, LedgerEntry] = {}
        """By column, what this node makes of those that it may send."""
        self.uids: list[ItemUid] = []
        """The name of each."""
        self.n_nodes = n_nodes
        self.origins = [0] * n_nodes
        """Item set that each node has recorded in the life that it is in: these it holds."""
        self._epochs = [0] * n_nodes
        self._parts: dict[Guid, tuple[int, ...]] = {}  # of blocks of several
        self.ends: dict[Life, int] = {}
        """By origin and epoch, the sequence behind the highest of which anything is known."""
        self.unneeded = [0] * n_nodes
        """Item set, of those that this node may send, that each peer has no need of."""
        self.away = 0
        """Bit mask of suspended peers: their needs are not waited for."""

    @property
    def spared(self) -> list[int]:
        """Item set that each peer need not be told now: it has no need of it, or is away."""
        if not self.away:
            return self.unneeded
        return [-1 if self.away >> node & 1 else items for node, items in enumerate(self.unneeded)]

    def __contains__(self, uid: ItemUid) -> bool:
        return uid in self.column_of

    def __len__(self) -> int:
        return len(self.fragments)

    def fragment(self, uid: ItemUid) -> Fragment | None:
        """The item as this node holds it; None if it never has."""
        column = self.column_of.get(uid)
        return None if column is None else self.fragments[column]

    def entry(self, column: int) -> LedgerEntry:
        """What this node makes of an item that it may send."""
        entry = self.entries.get(column)
        if entry is None:
            fragment = self.fragments[column]
            entry = self.entries[column] = LedgerEntry(fragment, fragment.facts)
        return entry

    def about(self, column: int) -> tuple[PropertyValue, ...]:
        """The facts by which it is judged who needs an item."""
        entry = self.entries.get(column)
        return self.fragments[column].facts if entry is None else entry.about

    def parts(self, guid: Guid) -> tuple[int, ...]:
        """Columns of the parts of a block, as far as they are known."""
        origin, epoch, sequence = guid
        return self.known((origin, epoch), sequence, sequence + 1).get(sequence, ())

    def known(self, life: Life, first: int, end: int) -> dict[int, tuple[int, ...]]:
        """Columns of the parts that are known of the blocks of a life, by sequence: ``first`` to before ``end``."""
        (origin, epoch), found, column_of = life, dict[int, tuple[int, ...]](), self.column_of
        for sequence in range(first, end):
            parts = self._parts.get((origin, epoch, sequence))
            if parts is not None:
                found[sequence] = parts
            elif (column := column_of.get(_new(ItemUid, (origin, sequence, 0, epoch)))) is not None:
                found[sequence] = (column,)
        return found

    def add(self, item: Named, entry: LedgerEntry | None = None) -> int:
        """Take in a new item, with what this node makes of it where that is more than it says; returns its column."""
        column, (fragment, uid, guid, _) = len(self.fragments), item
        if fragment.count > 1 or guid in self._parts:
            self._parts[guid] = *self.parts(guid), column
        self.column_of[uid] = column
        self.uids.append(uid)
        self.fragments.append(fragment)
        if entry is not None:
            self.entries[column] = entry
        origin, epoch, sequence = guid
        self.ends[origin, epoch] = max(self.ends.get((origin, epoch), 0), sequence + 1)
        if epoch == self._epochs[origin]:
            self.origins[origin] |= 1 << column
        return column

    def begin(self, node: int, epoch: int) -> None:
        """A node is in another life: it holds the items that it has recorded in this one, as far as is known."""
        self._epochs[node] = epoch
        uids = enumerate(self.uids)
        self.origins[node] = sum(1 << column for column, uid in uids if (uid.origin, uid.epoch) == (node, epoch))

    def is_whole(self, guid: Guid) -> bool:
        """True if every part of a block is known."""
        parts = self.parts(guid)
        return bool(parts) and len(parts) == self.fragments[parts[0]].count

    def block(self, guid: Guid) -> Block:
        """A block of which every part is known."""
        fragments = [self.fragments[column] for column in self.parts(guid)]
        return joined_block(sorted(fragments, key=lambda fragment: fragment.index))

    def ease(self, column: int, believes: Words) -> bool:
        """See whether all peers hold an item to which it is addressed: others need it less. True if so from now on.

        Args:
            column: of the item.
            believes: item set that each node is believed to hold.
        """
        entry = self.entry(column)
        peers = [peer for peer in range(len(self.unneeded)) if entry.addressed >> peer & 1]
        if not peers or not all(believes[peer] >> column & 1 for peer in peers):
            return False
        entry.addressed, entry.is_eased = 0, True
        entry.priority = max(1, entry.priority // ADDRESSED_SHARE)
        return True


def columns_of(items: int) -> list[int]:
    """Columns of an item set, in order.

    >>> columns_of(0b1011)
    [0, 1, 3]
    """
    columns = []
    while items:
        lowest = items & -items
        columns.append(lowest.bit_length() - 1)
        items ^= lowest
    return columns


class Holdings:
    """Whole blocks that one vehicle holds, by origin and epoch: one bit for each sequence."""

    def __init__(self) -> None:
        self.held: dict[Life, int] = {}
        """By origin and epoch, one bit for each sequence."""
        self.given_up: dict[Life, set[int]] = {}
        """Blocks that were held and are no longer, until they come again."""

    def add(self, life: Life, sequence: int) -> None:
        """Hold a block from now on."""
        self.held[life] = self.held.get(life, 0) | 1 << sequence
        self.given_up.get(life, set()).discard(sequence)

    def give_up(self, life: Life, sequence: int) -> None:
        """Hold a block no longer, so that it may come again."""
        self.held[life] = self.held.get(life, 0) & ~(1 << sequence)
        self.given_up.setdefault(life, set()).add(sequence)

    def has(self, life: Life, sequence: int) -> bool:
        """True if the block is held."""
        return bool(self.held.get(life, 0) >> sequence & 1)
