"""Who holds what beside acknowledgements: what this vehicle holds itself, what summaries say, whose life is over.

The acknowledgement state has a word of items for each node. Here it is corrected where more is known than packets and
their acknowledgements say: a peer began anew, two vehicles speak under one name, a summary names what is held.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from exchange.ack import AckState
from exchange.ledger import Ledger
from exchange.packets import ItemUid
from exchange.peers import Peers
from exchange.summaries import Holdings, Life, Summary, Telling
from worldmodel import Block
from worldmodel.facts import Guid


class Holders:
    """What one node knows of the holdings of all.

    Args:
        me: own node index.
        state: acknowledgement state of this node.
        ledger: of this node.
        peers: of this node.
        size_bits: of a summary on the wire.
    """

    def __init__(
        self, me: int, state: AckState, ledger: Ledger, peers: Peers, size_bits: Callable[[Summary], int]
    ) -> None:
        self._me = me
        self._state = state
        self._ledger = ledger
        self._peers = peers
        self.own = Holdings()
        self.telling = Telling(self.own, size_bits)
        self._noted: dict[int, dict[Life, Summary]] = {}  # by peer

    # What this vehicle holds -----------------------------------------------------------------------

    def take(self, column: int) -> None:
        """An item is new to this vehicle: a peer that told that it holds it need not be told."""
        uid, believes = self._ledger.uid(column), self._state.believes
        believes[self._me] |= 1 << column
        for peer, noted in self._noted.items():
            summary = noted.get((uid.origin, uid.epoch))
            if summary is not None and summary.holds(uid.sequence):
                believes[peer] |= 1 << column

    def complete(self, guid: Guid) -> None:
        """A block is whole here."""
        origin, epoch, sequence = guid
        self.own.add((origin, epoch), sequence)

    def give_up(self, guids: Iterable[Guid]) -> None:
        """Blocks were forgotten for want of what they rest on: say so, that they may come again."""
        for origin, epoch, sequence in guids:
            if sequence >= 0 and self.own.has((origin, epoch), sequence):
                self.own.give_up((origin, epoch), sequence)
                self.telling.urge((origin, epoch))

    def given_up(self) -> Iterator[tuple[int, ItemUid]]:
        """This node, and blocks, by their first items, that it has given up and that have not come again."""
        for (origin, epoch), given_up in self.own.given_up.items():
            yield from ((self._me, ItemUid(origin, sequence, 0, epoch)) for sequence in sorted(given_up))

    def come_again(self, guid: Guid) -> Block | None:
        """The block, if it was given up and a part of it is heard again; the other parts are known."""
        origin, epoch, sequence = guid
        if sequence not in self.own.given_up.get((origin, epoch), ()) or not self._ledger.is_whole(guid):
            return None
        self.complete(guid)
        return self._ledger.block(guid)

    # What the others hold --------------------------------------------------------------------------

    def begin(self, node: int, epoch: int) -> None:
        """A node is in another life: it holds what it has recorded in it, and nothing else is known."""
        self._peers.begin(node, epoch)
        self._ledger.begin(node, epoch)
        self._noted.pop(node, None)
        self._state.believes[node] = self._ledger.origins[node]

    def doubt(self, node: int, frame: int, by_alarm: bool = False) -> bool:
        """Two vehicles speak under the name of a node; True if that was not known before.

        Args:
            node: the name.
            frame: TDMA frame in which that was noticed.
            by_alarm: another one has said so; else this node says it.
        """
        is_new = self._peers.doubt(node, frame)
        life = node, self._peers.epochs[node]
        self.telling.silenced.add(life)
        if not by_alarm:
            self.telling.alarm(life)
        self._noted.clear()
        if is_new or node == self._me:
            for peer, items in enumerate(self._ledger.origins):
                if peer != node or node == self._me:
                    self._state.believes[peer] |= items
        return is_new

    def note(self, sender: int, summary: Summary) -> list[int]:
        """Believe what a peer says it holds, and no more; return the columns that it turns out to lack.

        Args:
            sender: of the summary.
            summary: one of its own.
        """
        noted = self._noted.setdefault(sender, {})
        known, noted[summary.life] = noted.get(summary.life), summary
        first = known.highest + 1 if known is not None and known.highest <= summary.highest else 0
        believes, lacked = self._state.believes, list[int]()
        for sequence in self._ledger.blocks_from(summary.life, first, summary.end):
            guid = (*summary.life, sequence)
            columns = self._ledger.parts_of(guid)
            items = sum(1 << column for column in columns)
            if summary.holds(sequence):
                believes[sender] |= items
            elif believes[sender] & items == items and self._ledger.is_whole(guid):
                believes[sender] &= ~items
                lacked += columns
        return lacked

    def orphans(self, life: Life | None = None) -> list[int]:
        """Columns of items that their origin cannot be relied on to send, of which this node is the one to do so.

        Their origin is away or has begun anew. Of those that are believed to hold one and are there, the node with
        the lowest index sends it.

        Args:
            life: of these alone.
        """
        ledger, away, found = self._ledger, self._peers.away, list[int]()
        for column in range(len(ledger)) if life is None or self._is_over(*life) else ():
            uid = ledger.uid(column)
            if not self._is_over(uid.origin, uid.epoch) or (life is not None and life != (uid.origin, uid.epoch)):
                continue
            if not any(self._state.believes[node] >> column & 1 and not away >> node & 1 for node in range(self._me)):
                found.append(column)
        return found

    def _is_over(self, origin: int, epoch: int) -> bool:
        """True if the origin is in another life, or away."""
        return epoch != self._peers.epochs[origin] or bool(self._peers.away >> origin & 1)
