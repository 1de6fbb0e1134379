"""Items known to one vehicle, and the nodes that it believes to hold each.

An item is a *column*, a number that is never used twice; packets name it by `ItemUid`. The holders of an item are a set
of nodes, an integer of which bit j is node j. The acknowledgements of packets add to it (`exchange.ack.PacketLog`).
It is corrected here where more is known: a peer began anew, or two vehicles use one number. Whole blocks that this
vehicle holds are counted by origin and epoch (`Holdings`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from exchange.ack import Acknowledgement, PacketLog, members
from exchange.blocks import joined_block
from exchange.packets import Fragment, ItemUid, Named
from exchange.peering.peers import PeerStates
from exchange.values import Waiting
from worldmodel import Block, PropertyValue
from worldmodel.facts import Guid

if TYPE_CHECKING:
    from exchange.peering.summaries import Summaries

_new = tuple.__new__  # makes a named tuple of a tuple, in half the time

Life = tuple[int, int]
"""An origin and its epoch."""
ADDRESSED_SHARE = 10
"""An item that those hold to whom it is addressed is needed so many times less by others."""


@dataclass(slots=True)
class Sendable:
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


class Beliefs:
    """Items, their holders, and the peers, as one vehicle knows them.

    Args:
        me: own node index.
        n_nodes: size of the fleet.
        kind: acknowledgement of the policy.
        epoch: of the own life.
    """

    def __init__(self, me: int, n_nodes: int, kind: Acknowledgement, epoch: int = 0) -> None:
        self.me, self.n_nodes = me, n_nodes
        self._mine, self._all = 1 << me, (1 << n_nodes) - 1
        self.log = PacketLog(kind, me, n_nodes)
        """Packets of the last two frames."""
        self.peers = PeerStates(me, n_nodes, kind)
        """Lives and links of the other nodes."""
        self.column_of: dict[ItemUid, int] = {}
        """Column of each item that this node has ever held."""
        self.fragments: list[Fragment] = []
        """By column, the item; it is held here."""
        self.uids: list[ItemUid] = []
        """By column, its name."""
        self.holders: list[int] = []
        """By column, the nodes believed to hold it, this one among them."""
        self.spared: list[int] = []
        """By column, peers that have no need of it, of those items that this node may send."""
        self.sendable: dict[int, Sendable] = {}
        """By column, details of those that this node may send."""
        self.before: dict[int, int] = {}
        """By column, what ``holders`` was before the packet that is heard now changed it."""
        self.unsettled: set[int] = set()
        """Columns of which more is believed than when `Interests.settle` was last called."""
        self.held_by_all = 0
        """Item set: those that all nodes are believed to hold."""
        self.origins = [0] * n_nodes
        """Item set that each node has recorded in the life that it is in: these it holds."""
        self.ends: dict[Life, int] = {}
        """By origin and epoch, the sequence behind the highest of which anything is known."""
        self._parts: dict[Guid, tuple[int, ...]] = {}  # of blocks of several
        self.own = Holdings()
        """Whole blocks that this vehicle holds."""
        self.shared: set[Life] = set()
        """Lives that two vehicles share."""
        self.summaries: Summaries | None = None
        """What peers are told and tell of what is held; None if that is taken out."""
        if epoch:
            self.begin(me, epoch)

    # Items ---------------------------------------------------------------------------------------

    def fragment(self, uid: ItemUid) -> Fragment | None:
        """The item as this node holds it; None if it never has."""
        column = self.column_of.get(uid)
        return None if column is None else self.fragments[column]

    def entry(self, column: int) -> Sendable:
        """Details of an item that this node may send."""
        entry = self.sendable.get(column)
        if entry is None:
            fragment = self.fragments[column]
            entry = self.sendable[column] = Sendable(fragment, fragment.facts)
        return entry

    def about(self, column: int) -> tuple[PropertyValue, ...]:
        """The facts by which it is judged who needs an item."""
        entry = self.sendable.get(column)
        return self.fragments[column].facts if entry is None else entry.about

    def parts(self, guid: Guid) -> tuple[int, ...]:
        """Columns of the parts of a block, as far as they are known."""
        parts = self._parts.get(guid)
        if parts is None:
            origin, epoch, sequence = guid
            column = self.column_of.get(_new(ItemUid, (origin, sequence, 0, epoch)))
            return () if column is None else (column,)
        return parts

    def known(self, life: Life, first: int, end: int) -> list[tuple[int, tuple[int, ...]]]:
        """Numbers, ``first`` to before ``end``, and columns of the parts that are known of the blocks of a life."""
        (origin, epoch), found, column_of = life, list[tuple[int, tuple[int, ...]]](), self.column_of
        for sequence in range(first, end):
            parts = self._parts.get((origin, epoch, sequence))
            if parts is not None:
                found.append((sequence, parts))
            elif (column := column_of.get(_new(ItemUid, (origin, sequence, 0, epoch)))) is not None:
                found.append((sequence, (column,)))
        return found

    def add(self, item: Named, entry: Sendable | None = None) -> int:
        """Hold a new item, with details where they are more than it says; returns its column."""
        column, (fragment, uid, guid, _) = len(self.fragments), item
        origin, epoch, sequence = guid
        if fragment.count > 1 or guid in self._parts:
            self._parts[guid] = *self.parts(guid), column
        self.column_of[uid] = column
        self.uids.append(uid)
        self.fragments.append(fragment)
        self.holders.append(0)
        self.spared.append(0)
        self.believe(column, self._mine)
        if entry is not None:
            self.sendable[column] = entry
        self.ends[origin, epoch] = max(self.ends.get((origin, epoch), 0), sequence + 1)
        if epoch == self.peers.epochs[origin]:
            self.origins[origin] |= 1 << column
        if self.summaries is not None:
            self.believe(column, self.summaries.holders(uid))
        return column

    def is_whole(self, guid: Guid) -> bool:
        """True if every part of a block is known."""
        parts = self.parts(guid)
        return bool(parts) and len(parts) == self.fragments[parts[0]].count

    def block(self, guid: Guid) -> Block:
        """A block of which every part is known."""
        fragments = [self.fragments[column] for column in self.parts(guid)]
        return joined_block(sorted(fragments, key=lambda fragment: fragment.index))

    # Holders -------------------------------------------------------------------------------------

    def believe(self, column: int, nodes: int) -> None:
        """Believe that these nodes hold an item, too."""
        before = self.holders[column]
        nodes |= before
        if nodes != before:
            self.before.setdefault(column, before)
            self.unsettled.add(column)
            self.holders[column] = nodes
            if nodes == self._all:
                self.held_by_all |= 1 << column

    def deny(self, column: int, node: int) -> None:
        """Believe that a node lacks an item."""
        self.holders[column] &= ~(1 << node)
        self.held_by_all &= ~(1 << column)

    def take(self, columns: Iterable[int], sender: int) -> None:
        """Believe who holds the items of a packet.

        5.: "Information contained within a successfully received packet is always added to the local world model".

        Args:
            columns: of the items.
            sender: node that is taken to hold what it sends, too, one bit; 0 for none.
        """
        for column in columns:
            origin = self.uids[column].origin
            is_own = self.origins[origin] >> column & 1  # of an earlier life, its origin may have lost it
            nodes = sender | 1 << origin if is_own else sender
            if nodes & ~self.holders[column]:
                self.believe(column, nodes)

    def is_held(self, columns: Iterable[int], node: int) -> bool:
        """True if a node is believed to hold all of these items."""
        return all(self.holders[column] >> node & 1 for column in columns)

    def is_lacked(self, column: int) -> bool:
        """True if a node that needs an item, and is there, is not believed to hold it."""
        return self.holders[column] | self.spared[column] | self.peers.away != self._all

    def gained(self) -> tuple[tuple[int, ItemUid], ...]:
        """Peers and items of which it is believed since ``before`` was cleared that they hold them, in order."""
        gained = []
        for column, before in self.before.items():
            gained += [(peer, column) for peer in members(self.holders[column] & ~(before | self._mine))]
        return tuple([(peer, self.uids[column]) for peer, column in sorted(gained)])

    def ease(self, column: int) -> bool:
        """True if all peers hold an item to which it is addressed, from now on: others need it less."""
        entry = self.entry(column)
        if not entry.addressed or entry.addressed & ~self.holders[column]:
            return False
        entry.addressed, entry.is_eased = 0, True
        entry.priority = max(1, entry.priority // ADDRESSED_SHARE)
        return True

    def begin(self, node: int, epoch: int) -> None:
        """A node is in another life: it holds what it has recorded in it, and nothing else is known."""
        self.peers.begin(node, epoch)
        self.forget(node)
        if self.summaries is not None:
            self.summaries.forget(node)
        own = [column for column, uid in enumerate(self.uids) if (uid.origin, uid.epoch) == (node, epoch)]
        self.origins[node] = sum([1 << column for column in own])
        for column in own:
            self.believe(column, 1 << node)

    def forget(self, node: int) -> None:
        """Believe nothing of what a node holds or has received."""
        self.holders = [nodes & ~(1 << node) for nodes in self.holders]
        self.held_by_all = 0
        self.log.forget(node)

    def doubt(self, node: int, frame: int, by_alarm: bool = False) -> bool:
        """Two vehicles use the number of a node; True if that was not known before.

        Args:
            node: the number.
            frame: TDMA frame in which that was noticed.
            by_alarm: another one has said so; else this node says it.
        """
        is_new = self.peers.doubt(node, frame)
        for peer in range(self.n_nodes) if is_new or node == self.me else (node,):
            if peer != self.me:
                self.forget(peer)
        if node == self.me:
            self.log.forget(node)
        life = node, self.peers.epochs[node]
        self.shared.add(life)
        if self.summaries is not None:
            self.summaries.telling.silence(life, by_alarm)
            self.summaries.forget()
        if is_new or node == self.me:
            for peer, items in enumerate(self.origins):
                if peer != node or node == self.me:
                    for column in members(items):
                        self.believe(column, 1 << peer)
        return is_new

    def orphans(self, life: Life | None = None, of_others: bool = False) -> list[int]:
        """Columns of items that their origin cannot be relied on to send, of which this node is the one to do so.

        Their origin is away or has begun anew. Of those that are believed to hold one and are there, the node with
        the lowest index sends it.

        Args:
            life: of these alone.
            of_others: those, too, that another node is to send.
        """
        before = 0 if of_others else self._mine - 1 & ~self.peers.away
        return [
            column
            for column, (origin, _, _, epoch) in enumerate(self.uids)
            if (life is None or life == (origin, epoch))
            and self.peers.is_over(origin, epoch)
            and not self.holders[column] & before
        ]

    # Whole blocks --------------------------------------------------------------------------------

    def complete(self, guid: Guid) -> None:
        """A block is whole here."""
        origin, epoch, sequence = guid
        self.own.add((origin, epoch), sequence)

    def give_up(self, guids: Iterable[Guid]) -> None:
        """Blocks were forgotten for want of what they rest on: say so, that they may come again."""
        for origin, epoch, sequence in guids:
            if sequence >= 0 and self.own.has((origin, epoch), sequence):
                self.own.give_up((origin, epoch), sequence)
                if self.summaries is not None:
                    self.summaries.telling.urge((origin, epoch))

    def given_up(self) -> Iterator[tuple[int, ItemUid]]:
        """This node, and blocks, by their first items, that it has given up and that have not come again."""
        for (origin, epoch), given_up in self.own.given_up.items():
            yield from ((self.me, ItemUid(origin, sequence, 0, epoch)) for sequence in sorted(given_up))

    def come_again(self, guid: Guid) -> Block | None:
        """The block, if it was given up and a part of it is heard again; the other parts are known."""
        origin, epoch, sequence = guid
        if sequence not in self.own.given_up.get((origin, epoch), ()) or not self.is_whole(guid):
            return None
        self.complete(guid)
        return self.block(guid)


def item_set(columns: Sequence[int]) -> int:
    """Set of the items of some columns, which differ."""
    return sum([1 << column for column in columns])
