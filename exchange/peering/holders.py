"""Who holds what beside acknowledgements: what this vehicle holds itself, and whose life is over.

The acknowledgement state has a word of items for each node. Here it is corrected where more is known than packets and
their acknowledgements say: a peer began anew, two vehicles speak under one name. Summaries correct it further.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from exchange.ack import AckState
from exchange.ledger import Holdings, Ledger, Life
from exchange.packets import ItemUid
from exchange.peering.peers import PeerStates
from exchange.peering.summaries import Summaries
from worldmodel import Block
from worldmodel.facts import Guid


class Holders:
    """What one node knows of the holdings of all.

    Args:
        me: own node index.
        state: acknowledgement state of this node.
        ledger: of this node.
        peers: of this node.
        own: what this vehicle holds.
        summaries: of this node, one of them at most.
    """

    def __init__(
        self, me: int, state: AckState, ledger: Ledger, peers: PeerStates, own: Holdings, summaries: Sequence[Summaries]
    ) -> None:
        self._me = me
        self._state = state
        self._ledger = ledger
        self._peers = peers
        self.own = own
        self._summaries = summaries
        self.shared: set[Life] = set()
        """Lives that two vehicles share."""

    # What this vehicle holds -----------------------------------------------------------------------

    def take(self, column: int) -> None:
        """An item is new to this vehicle."""
        self._state.believes[self._me] |= 1 << column
        for summaries in self._summaries:
            summaries.take(self._ledger.uids[column], column)

    def complete(self, guid: Guid) -> None:
        """A block is whole here."""
        origin, epoch, sequence = guid
        self.own.add((origin, epoch), sequence)

    def give_up(self, guids: Iterable[Guid]) -> None:
        """Blocks were forgotten for want of what they rest on: say so, that they may come again."""
        for origin, epoch, sequence in guids:
            if sequence >= 0 and self.own.has((origin, epoch), sequence):
                self.own.give_up((origin, epoch), sequence)
                for summaries in self._summaries:
                    summaries.telling.urge((origin, epoch))

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
        for summaries in self._summaries:
            summaries.forget(node)
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
        self.shared.add(life)
        for summaries in self._summaries:
            summaries.telling.silence(life, by_alarm)
            summaries.forget()
        if is_new or node == self._me:
            for peer, items in enumerate(self._ledger.origins):
                if peer != node or node == self._me:
                    self._state.believes[peer] |= items
        return is_new

    def orphans(self, life: Life | None = None, of_others: bool = False) -> list[int]:
        """Columns of items that their origin cannot be relied on to send, of which this node is the one to do so.

        Their origin is away or has begun anew. Of those that are believed to hold one and are there, the node with
        the lowest index sends it.

        Args:
            life: of these alone.
            of_others: those, too, that another node is to send.
        """
        ledger, away, columns = self._ledger, self._peers.away, list[int]()
        for column in range(len(ledger)):
            uid = ledger.uids[column]
            if not self._peers.is_over(uid.origin, uid.epoch) or (life is not None and life != (uid.origin, uid.epoch)):
                continue
            before = 0 if of_others else self._me
            if not any(self._state.believes[node] >> column & 1 and not away >> node & 1 for node in range(before)):
                columns.append(column)
        return columns
