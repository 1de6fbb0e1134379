"""Which item is which column: the acknowledgement state speaks of columns, the packets of item UIDs.

An item set is one Python integer: bit c stands for column c. Columns are never used twice, so a set
keeps its meaning for good. `Holdings` count whole blocks of each origin and epoch instead, by their sequence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from exchange.ack import Words
from exchange.blocks import joined_block
from exchange.packets import Fragment, ItemUid, Named, name_of_item
from exchange.values import Waiting
from worldmodel import Block, PropertyValue
from worldmodel.facts import Guid

Life = tuple[int, int]
"""An origin and its epoch."""
ADDRESSED_SHARE = 10
"""An item that those hold to whom it is addressed is needed so many times less by others."""


@dataclass(slots=True)
class LedgerEntry:
    """One item as this node sees it; of one that it does not send, the fragment is all.

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
    """Item UID <-> column, and the entry of each column.

    Args:
        n_nodes: size of the fleet.
        speakers: of each origin beyond the nodes, in the order of their numbers, the node that tells what it told.
    """

    def __init__(self, n_nodes: int, speakers: Sequence[int] = ()) -> None:
        self.column_of: dict[ItemUid, int] = {}
        """Column of each item; without one that this node has never held."""
        self.entries: list[LedgerEntry] = []
        self.uids: list[ItemUid] = []
        """The item of each column."""
        self.n_nodes = n_nodes
        self.speakers = (*range(n_nodes), *speakers)
        """By origin the node that tells what it told: itself, or of an origin beyond the nodes a gateway."""
        self.brought = [0] * n_nodes
        """Item set of origins beyond the nodes that each node tells."""
        self.origins = [0] * n_nodes
        """Item set that each node has recorded in the life that it is in: these it holds."""
        self._epochs = [0] * n_nodes
        self.parts: dict[Guid, tuple[int, ...]] = {}
        """Columns of the parts of each block, as far as they are known."""
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
        return len(self.entries)

    def fragment(self, uid: ItemUid) -> Fragment | None:
        """The item as this node holds it; None if it never has."""
        column = self.column_of.get(uid)
        return None if column is None else self.entries[column].fragment

    def add(self, entry: LedgerEntry, item: Named | None = None) -> int:
        """Take in a new item, with its names where these are made already; returns its column."""
        column, (_, uid, guid, _) = len(self.entries), item or name_of_item(entry.fragment)
        self.column_of[uid] = column
        self.uids.append(uid)
        self.entries.append(entry)
        origin, epoch, sequence = guid
        self.parts[guid] = *self.parts.get(guid, ()), column
        self.ends[origin, epoch] = max(self.ends.get((origin, epoch), 0), sequence + 1)
        if origin >= self.n_nodes:
            self.brought[self.speakers[origin]] |= 1 << column
        elif epoch == self._epochs[origin]:
            self.origins[origin] |= 1 << column
        return column

    def begin(self, node: int, epoch: int) -> None:
        """A node is in another life: it holds the items that it has recorded in this one, as far as is known."""
        self._epochs[node] = epoch
        uids = enumerate(self.uids)
        self.origins[node] = sum(1 << column for column, uid in uids if (uid.origin, uid.epoch) == (node, epoch))

    def is_whole(self, guid: Guid) -> bool:
        """True if every part of a block is known."""
        parts = self.parts.get(guid)
        return parts is not None and len(parts) == self.entries[parts[0]].fragment.count

    def block(self, guid: Guid) -> Block:
        """A block of which every part is known."""
        fragments = [self.entries[column].fragment for column in self.parts[guid]]
        return joined_block(sorted(fragments, key=lambda fragment: fragment.index))

    def ease(self, column: int, believes: Words) -> bool:
        """See whether all peers hold an item to which it is addressed: others need it less. True if so from now on.

        Args:
            column: of the item.
            believes: item set that each node is believed to hold.
        """
        entry = self.entries[column]
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
