"""What a vehicle makes of a sound packet: items and blocks, who holds what, and what its sender has to catch up."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from exchange import ack
from exchange.blocks import Assembly, fragments_of, joined_block
from exchange.interests import Interests
from exchange.ledger import Ledger, LedgerEntry, columns_of
from exchange.packets import Fragment, ItemUid, Judged, Met, Named, Packet, Reception, name_of_item
from exchange.peering.holders import Holders
from exchange.peering.peers import Ageing, PeerStates
from exchange.peering.summaries import Summaries
from exchange.policies import AckPolicy, may_send
from worldmodel import STATUS, Block, WorldModel
from worldmodel.facts import MOST_ITEMS

if TYPE_CHECKING:
    from exchange.peering.stating import Stating


def _contradiction(fragment: Fragment, ledger: Ledger, assembly: Assembly) -> Block | None:
    """The block by which an item that is known with other content has another one, if that is whole."""
    known = ledger.fragment(fragment.uid)
    if known is not None and fragment.count != known.count:
        return assembly.add(fragment)
    fragments = [ledger.fragment(fragment.uid._replace(part=part)) for part in range(fragment.count)]
    fragments[fragment.index] = fragment
    parts = [part for part in fragments if part is not None]
    return joined_block(parts)._replace(time_s=fragment.time_s) if len(parts) == fragment.count else None


class _Taken(NamedTuple):
    """What the fragments of a packet brought; ``content`` is the set of items, known ones too, if they are as known.

    ``is_ambiguous`` if two vehicles have told different things under the name of one of them.
    """

    content: int
    blocks: Sequence[Block]
    items: Sequence[ItemUid] = ()
    aside: Sequence[Fragment] = ()
    is_ambiguous: bool = False


class Listener:
    """Takes in what one vehicle hears.

    Args:
        me: own node index.
        model: own world model, read only.
        state: of the acknowledgements of this node.
        ledger, interests, holders, peers, ageing: of this node.
        policy: the same at every vehicle.
        carrier_evidence: take a peer that carries an item as holding it.
        summaries: of this node, one of them at most.
        frame_s: length of a TDMA frame.
    """

    def __init__(
        self,
        me: int,
        model: WorldModel,
        state: ack.AckState,
        ledger: Ledger,
        interests: Interests,
        holders: Holders,
        peers: PeerStates,
        ageing: Ageing,
        policy: AckPolicy,
        carrier_evidence: bool,
        summaries: Sequence[Summaries],
        frame_s: float,
    ) -> None:
        self._me = me
        self._model = model
        self._ledger = ledger
        self._interests = interests
        self._holders = holders
        self._peers = peers
        self._ageing = ageing
        self._state = state
        self._n_nodes = len(ledger.origins)
        self._repeat = policy.repeat
        self._carrier_evidence = carrier_evidence
        self._summaries = summaries
        self._frame_s = frame_s
        self._relayed = 0  # nodes whose items this node sends, too, one bit each
        self._passed_on_s: dict[tuple[int, int], float] = {}  # times of the newest statuses that it was to relay
        self.assembly = Assembly()
        self.stating: list[Stating] = []
        """What it states of its holdings: one of them where the policy does so."""

    def register(self, item: Named, now_s: float, entry: LedgerEntry | None = None) -> int:
        """Hold an item that is new here, see ``Ledger.add``, and send it if this vehicle is to; returns its column."""
        column, fragment = self._ledger.add(item, entry), item.fragment
        self._holders.take(column)
        is_relayed = self._relayed >> fragment.origin & 1
        if is_relayed or may_send(self._repeat, 1 << column, self._ledger.origins[self._me]):
            self._interests.take(column, now_s)
        return column

    def listen(self, judged: Judged, slot: int, met: Met, is_second: bool, now_s: float) -> Reception:
        """Learn from a sound packet what it tells, who holds what, and whether its sender needs to catch up.

        Args:
            judged: what was heard.
            slot: in which it was sent.
            met: what is known of its sender.
            is_second: True if another packet of its sender was heard in the same slot.
            now_s: the time (s).
        """
        packet, state, peers = judged.packet, self._state, self._peers
        frame, sender = packet.frame, packet.sender
        conflict: int | None = None
        begun: Sequence[tuple[int, int]] = ()
        if is_second or judged.concerns >> self._me & 1:
            conflict = self._twin(packet, is_second, now_s)
        if judged.relays or packet.epoch != peers.epochs[sender]:
            begun = self._lives_told(packet)
        for node, epoch in begun:
            self._begin(node, epoch)
        before = [*state.believes]
        missed = judged.heard & ~(state.heard[0] | 1 << sender | 1 << self._me)
        told = self._told(packet, missed, now_s) if missed or judged.relays else ()
        taken = self._take_in(judged.items, now_s) if judged.items else _Taken(0, judged.statuses)
        lacked: list[int] = []
        if taken.is_ambiguous or (frame < peers.trusted_from and peers.is_doubted(sender, frame)):
            state.believes[self._me] |= taken.content  # neither acknowledged nor heeded
        else:
            spoken_of = self._ageing.spoken_of(slot)
            heeded, origins = peers.heed(packet, frame, *spoken_of), self._ledger.origins
            self._ageing.absorb(packet, slot, heeded, taken.content, self._carrier_evidence, origins)
            for stating in self.stating:
                taken, lacked = self._take_account(stating, packet, slot, spoken_of.is_asked, taken, now_s)
            for summaries in self._summaries:
                for summary in packet.summary:
                    if summary[:2] in self._holders.shared:
                        continue
                    lacked += summaries.note(sender, summary)
                    if not self._repeat and peers.is_over(*summary[:2]):
                        self._interests.adopt(self._holders.orphans(summary[:2]), state.believes, now_s)
        for status in judged.statuses if self._relayed else ():
            if self._relayed >> status.origin & 1 and self._is_news(status):
                self._interests.take_status(status)
        if begun or met is Met.BACK:
            self._catch_up(sender, now_s)
        elif lacked:
            self.reopen(now_s)
        for stating in self.stating:
            stating.note_news(packet, before, slot)
        beliefs = self._gained(before) if before != state.believes else ()
        settled = self._interests.settle(self._done, state.believes) if beliefs or begun else ()
        return Reception(
            slot, sender, tuple(taken.blocks), packet.signals, tuple(taken.items), beliefs, settled, tuple(taken.aside),
            met=met, conflict=conflict, told=told,
        )  # fmt: skip

    def _begin(self, node: int, epoch: int) -> None:
        """A node is in another life."""
        self._holders.begin(node, epoch)
        for stating in self.stating:
            stating.forget(node)

    def _take_account(
        self, stating: Stating, packet: Packet, slot: int, is_asked: bool, taken: _Taken, now_s: float
    ) -> tuple[_Taken, list[int]]:
        """Learn what a packet says of holdings; returns all that it brought, and what its sender lacks.

        Args:
            stating: of this node.
            packet: heard; slot: in which it was sent.
            is_asked: its acknowledgements, if it has any, are about the own last packet.
            taken: what its fragments brought.
            now_s: the time (s).
        """
        vouched = self._peers.vouched(packet.sender, packet.frame)
        answers = self._peers.answers(packet.sender, packet.frame)
        decoded, lacked = stating.hear(packet, slot, is_asked and answers, answers, vouched, now_s)
        if not decoded:
            return taken, lacked
        more, believes = self._take_in(decoded, now_s), self._state.believes
        for node, origin_items in enumerate(self._ledger.origins):
            if node != self._me:  # an origin holds what it has told
                believes[node] |= origin_items & more.content
        items, aside = (*taken.items, *more.items), (*taken.aside, *more.aside)
        return taken._replace(blocks=(*taken.blocks, *more.blocks), items=items, aside=aside), lacked

    def _told(self, packet: Packet, missed: int, now_s: float) -> tuple[tuple[int, float], ...]:
        """When, at the earliest, nodes spoke of which a packet tells, and which this vehicle missed.

        Args:
            packet: heard.
            missed: nodes, one bit each, whose packets others have heard in the TDMA frame before.
            now_s: the time (s).
        """
        told = [(node, now_s - self._frame_s) for node in columns_of(missed)]
        passed_on = [fragment for fragment in packet.fragments if fragment.origin not in (packet.sender, self._me)]
        return (*told, *[(fragment.origin, min(fragment.time_s, now_s)) for fragment in passed_on])

    def _is_news(self, status: Block) -> bool:
        """True, once, if nothing as new is known of what a status says first; it may be that nobody believes it."""
        slot = status.facts[0].subject, status.facts[0].attribute
        known = self._model.latest(*slot)
        newest_s = max(-math.inf if known is None else known.block.time_s, self._passed_on_s.get(slot, -math.inf))
        if newest_s >= status.time_s:
            return False
        self._passed_on_s[slot] = status.time_s
        return True

    def _gained(self, before: list[int]) -> tuple[tuple[int, ItemUid], ...]:
        """The peers, and items, of which it is believed now that they hold them, and was not before."""
        beliefs: list[tuple[int, ItemUid]] = []
        believes = self._state.believes
        for peer, known in enumerate(before):
            items = believes[peer] & ~known
            if items and peer != self._me:  # what it holds itself it does not believe
                beliefs += [(peer, self._ledger.uids[column]) for column in columns_of(items)]
        return tuple(beliefs)

    def relay(self, origins: int, now_s: float) -> None:
        """Send, until this is said anew, also what these nodes tell, one bit each: somebody hardly hears them.

        Their newest status is said once, as that of this vehicle.
        """
        self._relayed = origins
        for origin in columns_of(origins):
            lacked = self._ledger.origins[origin] & self._state.believes[self._me] & ~self._done
            self._interests.adopt(columns_of(lacked), self._state.believes, now_s)
        if origins:  # whoever else is to send what is left of a life that is over may be hardly heard as well
            self._interests.adopt(self._holders.orphans(of_others=True), self._state.believes, now_s)

    def resume(self, room_bits: int, size_bits: Callable[[Fragment], int], now_s: float) -> None:
        """Take up what the world model holds.

        Args:
            room_bits: of a packet for one fragment.
            size_bits: of a fragment.
            now_s: the time (s).
        """
        for guid, block in self._model.items():
            self._holders.complete(guid)
            if block is not None:
                for fragment in fragments_of(block, room_bits, size_bits):
                    self.register(name_of_item(fragment), now_s, LedgerEntry(fragment, block.facts))

    def _twin(self, packet: Packet, is_second: bool, now_s: float) -> int | None:
        """The name under which two vehicles speak, if this packet is the first to show it."""
        noticed: list[tuple[int, bool]] = [(packet.sender, False)] if is_second else []
        if self._is_misquoted(packet):
            noticed.append((self._me, False))
        epochs = self._peers.epochs
        for summary in packet.summary:
            if summary.highest >= MOST_ITEMS and summary.epoch == epochs[summary.origin]:
                noticed.append((summary.origin, True))
        if not noticed:
            return None
        new = [node for node, by_alarm in noticed if self.doubt(node, packet.frame, now_s, by_alarm)]
        return new[0] if new else None

    def doubt(self, node: int, frame: int, now_s: float, by_alarm: bool = False) -> bool:
        """Two vehicles speak under the name of a node; True if that was not known before: then all is said again.

        Args:
            node: the name; frame: TDMA frame in which that was noticed.
            now_s: the time (s).
            by_alarm: another one has said so; else this vehicle says it.
        """
        is_new = self._holders.doubt(node, frame, by_alarm)
        for stating in self.stating:
            stating.forget()
        if is_new:
            self.reopen(now_s)
        return is_new

    def _is_misquoted(self, packet: Packet) -> bool:
        """True if a packet has items or summaries of this vehicle's life that it never told: another speaks as it."""
        own, n_told = (self._me, self._model.epoch), self._model.next_sequence
        for summary in packet.summary:
            if summary[:2] == own and summary.beyond(n_told):
                return True
        return any(map(self._is_misquote, [fragment for fragment in packet.fragments if fragment.origin == self._me]))

    def _is_misquote(self, fragment: Fragment) -> bool:
        """True for a fragment under the name of this vehicle if it is an item of its life that it never told."""
        if fragment.epoch != self._model.epoch or fragment.sequence == STATUS:
            return False
        return self._ledger.fragment(fragment.uid) != fragment

    def _lives_told(self, packet: Packet) -> list[tuple[int, int]]:
        """Nodes that are in another life than was known, by the packet's head and by items that are new here."""
        told, epochs = {packet.sender: packet.epoch}, self._peers.epochs
        for fragment in packet.fragments:
            origin = fragment.origin
            is_newer = fragment.epoch > epochs[origin] and origin not in told and origin != self._me
            if is_newer and fragment.sequence != STATUS and fragment.uid not in self._ledger:
                told[origin] = fragment.epoch
        return [(node, epoch) for node, epoch in told.items() if epoch != epochs[node]]

    def _take_in(self, told: Sequence[Named | Block], now_s: float) -> _Taken:
        """Take in the items and statuses of a packet."""
        ledger, content, is_ambiguous = self._ledger, 0, False
        blocks: list[Block] = []
        items: list[ItemUid] = []
        aside: list[Fragment] = []
        for item in told:
            if isinstance(item, Block):
                blocks.append(item)
                continue
            fragment, uid, guid, block = item
            column = ledger.column_of.get(uid)
            if fragment.origin == self._me and self._is_misquote(fragment):
                is_ambiguous = True
                continue
            if column is None:
                column = self.register(item, now_s)
                if block is None:
                    parts = [ledger.fragments[part] for part in ledger.parts(guid)]
                    block = self.assembly.add(fragment, parts)
                if block is not None:
                    self._holders.complete(guid)
                if block is not None and not self._interests.keeps(block, uid):
                    aside.append(fragment)
                    block = None
                else:
                    items.append(uid)
                if block is not None:
                    blocks.append(block)
                content |= 1 << column
            elif ledger.fragments[column] == fragment:
                content |= 1 << column
                if self._holders.own.given_up and (again := self._holders.come_again(guid)) is not None:
                    blocks.append(again)
                    items += [ledger.uids[part] for part in ledger.parts(guid)]
            elif guid[:2] in self._holders.shared:
                is_ambiguous = True
            elif (other := _contradiction(fragment, ledger, self.assembly)) is not None:
                is_in = self._model.arrived(other.guid) is not None
                blocks += [other] if is_in or self._interests.keeps(other, uid) else []
        return _Taken(content, blocks, items, aside, is_ambiguous)

    def _catch_up(self, peer: int, now_s: float) -> None:
        """A peer that was away, or begins anew, is there: it is told what it lacks, and what is held here."""
        self._ledger.away = self._peers.away
        for stating in self.stating:
            stating.miss(peer)
        if not self._repeat:
            self._interests.adopt(self._holders.orphans(), self._state.believes, now_s)
        self.reopen(now_s)
        for summaries in self._summaries:
            summaries.telling.urge()

    def reopen(self, now_s: float) -> None:
        """Send again what was settled and is lacked by somebody now."""
        self._interests.reopen(self._done, now_s)

    def settle(self) -> tuple[ItemUid, ...]:
        """Close the items that all who need them, and are there, are believed to hold."""
        return self._interests.settle(self._done, self._state.believes)

    @property
    def _done(self) -> int:
        """Item set that all who need them, and are there, are believed to hold."""
        ledger = self._ledger
        return ack.settled(self._state, self._n_nodes, ledger.spared if ledger.away else ledger.unneeded, 0)
