"""Who needs which items, as one node believes: what it sends, and what of what it hears it keeps.

Needs may follow from something that changes, such as who belongs to which group. So an item is judged when it comes in,
and all of them again when needs have changed: one that was settled without a peer which needs it now is sent again, and
one that nobody lacks any more is sent no longer. A peer that is believed to hold an item never gets it twice for that.

A node may be selective: it passes on nothing that it has no need of, and sets aside what it hears of that kind. What it
set aside it holds as others believe; if it comes to need it, it takes it from there.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Iterable
from dataclasses import dataclass

from exchange.ack import Words
from exchange.codec import Codec
from exchange.ledger import Entry, Ledger
from exchange.packets import ItemUid
from worldmodel import Block, Needs, PropertyValue, WorldModel


@dataclass(frozen=True, slots=True)
class Renewal:
    """What changed needs mean for one vehicle.

    Attributes:
        blocks: heard before and set aside, of use now; items: that completed them.
        settled: items that all who need them are believed to hold now.
    """

    blocks: tuple[Block, ...] = ()
    items: tuple[ItemUid, ...] = ()
    settled: tuple[ItemUid, ...] = ()


class Interests:
    """The needs of all nodes, applied to the items of one.

    Args:
        me: own node index.
        model: own world model, which knows the classes of instances.
        needs: of all nodes, this one among them.
        ledger: of this node, where it is noted who has no need of an item.
        codec: makes the wire form of what is sent.
        selective: True if this node neither keeps nor passes on what it has no need of.
    """

    def __init__(self, me: int, model: WorldModel, needs: Needs, ledger: Ledger, codec: Codec, selective: bool) -> None:
        self._me = me
        self._model = model
        self._needs = needs
        self._ledger = ledger
        self._codec = codec
        self._selective = selective
        self._may_send: list[int] = []
        self.open: list[int] = []
        """Columns of the items that this node goes on sending, by item UID."""
        self._aside: list[tuple[Block, ItemUid]] = []

    def of(self, facts: Iterable[PropertyValue]) -> tuple[int, int]:
        """Nodes (bit word) that need any of the facts, and the highest priority among them."""
        nodes, priority = 0, 0
        facts = tuple(facts)
        for fact in facts:
            instance = self._model.instance(fact.subject)
            if instance is None:  # announced by this very block
                announced = next((f.value for f in facts if f.subject == fact.subject and f.attribute == 0), 0)
                class_uid = int(announced) if isinstance(announced, int) else 0
            else:
                class_uid = instance.class_uid
            word, value = self._needs.priority_of(fact, class_uid)
            nodes |= word
            priority = max(priority, value)
        return nodes, priority

    def of_others(self, facts: Iterable[PropertyValue]) -> tuple[int, int]:
        """The same without this node, which tells itself nothing."""
        nodes, priority = self.of(facts)
        return nodes & ~(1 << self._me), priority

    # What is sent --------------------------------------------------------------------------------

    def take(self, column: int) -> None:
        """Take an item that this node may send, new to it."""
        self._may_send.append(column)
        if self._judge(column):
            self._send(column)

    def settle(self, done: int, believes: Words) -> tuple[ItemUid, ...]:
        """Close the open items among those ``done``, which all who need them are believed to hold.

        Args:
            believes: item set that each node is believed to hold.
        """
        ledger = self._ledger
        settled = tuple(ledger.uid(column) for column in self.open if done >> column & 1)
        if settled:
            self.open = [column for column in self.open if not done >> column & 1]
        ledger.note_heard(self.open, believes)
        return settled

    def renew(self, believes: Words) -> Renewal:
        """Judge all items anew: who needs what has changed.

        Args:
            believes: item set that each node is believed to hold.
        """
        before, self.open = set(self.open), []
        settled: list[ItemUid] = []
        for column in self._may_send:
            entry, was_open = self._ledger.entries[column], column in before
            priority = entry.priority
            if not self._judge(column):
                continue
            if self._is_lacked(column, believes):
                if was_open:
                    entry.priority = priority  # it may be lower, see ``Ledger.note_heard``
                self._send(column)
            elif was_open:
                settled.append(self._ledger.uid(column))
        blocks, items = self._taken_up()
        return Renewal(tuple(blocks), tuple(items), tuple(settled))

    def _send(self, column: int) -> None:
        entry = self._ledger.entries[column]
        if not entry.size_bits:
            entry.bits, entry.size_bits = self._codec.encode_fragment(entry.fragment, self._me, self._model.epoch)
        insort(self.open, column, key=self._ledger.uid)

    def _judge(self, column: int) -> bool:
        """Note who needs an item; True if anybody else does."""
        entry, item = self._ledger.entries[column], 1 << column
        nodes, entry.priority = self._judged(entry)
        for peer in range(len(self._ledger.unneeded)):
            if nodes >> peer & 1 or peer == self._me:
                self._ledger.unneeded[peer] &= ~item
            else:
                self._ledger.unneeded[peer] |= item
        return bool(nodes)

    def _judged(self, entry: Entry) -> tuple[int, int]:
        """Nodes beside this one that are to have an item, and how urgent it is."""
        nodes, of_block = self.of(entry.about)
        priority = self.of(entry.fragment.facts)[1] or of_block
        mine = nodes >> self._me & 1 or entry.fragment.origin == self._me
        if priority == 0 or (self._selective and not mine):
            return 0, priority
        return (nodes | entry.addressed) & ~(1 << self._me), priority

    def _is_lacked(self, column: int, believes: Words) -> bool:
        """True if a node that needs an item is not believed to hold it."""
        unneeded = self._ledger.unneeded
        return any(not (believes[node] | unneeded[node]) >> column & 1 for node in range(len(unneeded)))

    # What is kept --------------------------------------------------------------------------------

    def keeps(self, block: Block, completed_by: ItemUid) -> bool:
        """True if this node has a use for a block it has heard; else it sets the block aside.

        Args:
            completed_by: the last of its items to be heard.
        """
        if not self._selective or self.of(block.facts)[0] >> self._me & 1:
            return True
        self._aside.append((block, completed_by))
        return False

    def _taken_up(self) -> tuple[list[Block], list[ItemUid]]:
        """Blocks that were set aside and are of use now, and the items that completed them."""
        found = [one for one in self._aside if self.of(one[0].facts)[0] >> self._me & 1]
        self._aside = [one for one in self._aside if one not in found]
        return [block for block, _ in found], [uid for _, uid in found]
