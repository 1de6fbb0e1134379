"""Processing of a valid packet: items, acknowledgements, resynchronisation of its sender."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from exchange.manager.beliefs import Beliefs, Sendable
from exchange.manager.interests import Interests
from exchange.packets import (
    DecodedPacket,
    Fragment,
    ItemUid,
    Met,
    Named,
    Packet,
    Reception,
    joined_block,
)
from exchange.policy.acknowledgement import members
from worldmodel import STATUS, Block, WorldModel

if TYPE_CHECKING:
    from exchange.manager.holdings import HoldingsReports
    from exchange.manager.relaying import Relaying


def _contradiction(fragment: Fragment, beliefs: Beliefs) -> Block | None:
    """Return the block that contradicts a known item, if it is whole."""
    fragments = [beliefs.fragment(fragment.uid._replace(part=part)) for part in range(fragment.count)]
    fragments[fragment.index] = fragment
    parts = [part for part in fragments if part is not None and part.count == fragment.count]
    return joined_block(parts)._replace(time_s=fragment.time_s) if len(parts) == fragment.count else None


@dataclass(slots=True)
class _Taken:
    """Blocks, items and filtered fragments that a packet brings.

    ``is_ambiguous``: a duplicate node id sent different content under one name.
    """

    blocks: list[Block] = field(default_factory=list)
    items: list[ItemUid] = field(default_factory=list)
    aside: list[Fragment] = field(default_factory=list)
    is_ambiguous: bool = False


class Receiver:
    """Receiver of one vehicle; with ``repeats`` it also sends items of others."""

    def __init__(
        self,
        model: WorldModel,
        beliefs: Beliefs,
        interests: Interests,
        repeats: bool,
        carrier_evidence: bool,
        frame_s: float,
    ) -> None:
        self._me = beliefs.me
        self._model = model
        self._beliefs = beliefs
        self._peers = beliefs.peers
        self._interests = interests
        self._repeats = repeats
        self._carrier_evidence = carrier_evidence
        self._frame_s = frame_s
        self.reports: HoldingsReports | None = None
        """Holdings reports; None without the policy."""
        self.relaying: Relaying | None = None
        """Relaying; None if off."""

    def register(self, item: Named, now_s: float, entry: Sendable | None = None) -> int:
        """Add a new item and queue it if this vehicle sends it; return its column."""
        column, origin, beliefs = self._beliefs.add(item, entry), item.fragment.origin, self._beliefs
        is_own = origin == self._me and beliefs.origins[origin] >> column & 1
        is_relayed = self.relaying is not None and self.relaying.origins >> origin & 1
        if self._repeats or is_own or is_relayed:
            self._interests.take(column, now_s)
        return column

    def apply(self, decoded: DecodedPacket, slot: int, met: Met, is_second: bool, now_s: float) -> Reception:
        """Apply a valid packet; ``is_second`` if the slot had another packet of its sender."""
        packet, beliefs, peers, log = decoded.packet, self._beliefs, self._peers, self._beliefs.log
        frame, sender = packet.frame, packet.sender
        conflict: int | None = None
        if is_second or decoded.concerns >> self._me & 1:
            conflict = self._twin(packet, is_second, now_s)
        is_new_life = met is Met.NEW_LIFE
        for origin, epoch in decoded.lives:
            is_new_life |= epoch > peers.epochs[origin]
        has_begun = is_new_life and self._begin_lives(packet)
        # After these, since beliefs that a new incarnation restores are no gain of this packet.
        beliefs.news.clear()
        missed = decoded.heard & ~(log.heard | 1 << sender | 1 << self._me)
        evidence = self._told(packet, missed, now_s) if missed or decoded.relays else ()
        taken = _Taken()
        content = lacked = 0
        if decoded.items:
            content = self._take_in(decoded.items, taken, now_s)
        else:
            taken.blocks += decoded.statuses
        is_trusted = frame > peers.doubted_until[sender]
        if is_trusted and not taken.is_ambiguous:  # else neither acknowledged nor accepted
            is_late, answers = slot < log.slot, peers.answering[frame % len(peers.answering)][sender]
            # A frame or more after the own packet, the bit is about a later own slot, which passed without one.
            is_answer = answers and log.sent_slot is not None and 0 < slot - log.sent_slot < beliefs.n_nodes
            is_answer = is_answer and not (is_late and log.own_slot > slot)
            heeded = peers.heed(sender, decoded.own, frame, is_answer)
            if answers and not is_late and self.relaying is not None:
                self.relaying.rows[sender].append(decoded.own)
            if content:
                beliefs.take(content, sender if self._carrier_evidence else None)
            for node, items in log.learn(slot, content, packet.acks, heeded):
                beliefs.believe(node, items)
            if self.reports is not None:
                recovered, lacked = self.reports.hear(decoded, slot, is_answer, answers, heeded, now_s)
                if recovered:
                    beliefs.take(self._take_in(recovered, taken, now_s), None)
            lacked |= self._take_summaries(packet, now_s) if packet.summary else 0
        if self.relaying is not None and self.relaying.origins:
            self.relaying.pass_on(decoded.statuses)
        if has_begun or met is Met.BACK:
            self._catch_up(sender, now_s)
        elif lacked:
            self._interests.reopen(now_s)
        if self.reports is not None:
            self.reports.note_news(packet, slot)
        gained = beliefs.gained() if beliefs.news else ()
        settled = self._interests.settle(now_s) if gained or has_begun else ()
        return Reception(
            slot, sender, tuple(taken.blocks), packet.signals, tuple(taken.items), gained, settled, tuple(taken.aside),
            met=met, conflict=conflict, told=evidence,
        )  # fmt: skip

    def _take_summaries(self, packet: Packet, now_s: float) -> int:
        """Apply the summaries of a packet; return the items (set) that its sender lacks."""
        beliefs, peers, lacked = self._beliefs, self._peers, 0
        for summary in packet.summary:
            origin, epoch = life = summary[:2]
            # An alarm, even of an incarnation that this vehicle does not know, says nothing about items.
            if life not in beliefs.shared and not summary.is_alarm:
                beliefs.report((packet.sender,), life, summary.held)
                lacked |= beliefs.deny(packet.sender, life, summary.lacked)
                if not self._repeats and (peers.away >> origin & 1 or epoch != peers.epochs[origin]):
                    self._interests.adopt(beliefs.orphans(life), now_s)
        return lacked

    def _told(self, packet: Packet, missed: int, now_s: float) -> tuple[tuple[int, float], ...]:
        """Return second-hand evidence of presence: nodes and earliest times of transmission (s).

        ``missed`` has the nodes (bit mask) whose last packets only others received.
        """
        evidence = [(node, now_s - self._frame_s) for node in members(missed)]
        for fragment in packet.fragments:
            if fragment.origin not in (packet.sender, self._me):
                evidence.append((fragment.origin, min(fragment.time_s, now_s)))
        return tuple(evidence)

    def _twin(self, packet: Packet, is_second: bool, now_s: float) -> int | None:
        """Return a duplicate node id if this packet is the first evidence; else None."""
        noticed: list[tuple[int, bool]] = [(packet.sender, False)] if is_second else []
        if self._is_misquoted(packet):
            noticed.append((self._me, False))
        epochs = self._peers.epochs
        for summary in packet.summary:
            if summary.is_alarm and summary.epoch == epochs[summary.origin]:
                noticed.append((summary.origin, True))
        new = [node for node, by_alarm in noticed if self.doubt(node, packet.frame, now_s, by_alarm)]
        return new[0] if new else None

    def doubt(self, node: int, frame: int, now_s: float, by_alarm: bool = False) -> bool:
        """Record a duplicate node id (see ``Beliefs.doubt``); if new, reopen items and return True."""
        is_new = self._beliefs.doubt(node, frame, by_alarm)
        if self.reports is not None:
            self.reports.forget()
        if is_new:
            self._interests.reopen(now_s)
        return is_new

    def _is_misquoted(self, packet: Packet) -> bool:
        """True if a packet has items or summaries of this incarnation that this vehicle never sent."""
        own, n_own = (self._me, self._model.epoch), self._model.next_sequence
        for summary in packet.summary:
            if summary[:2] == own and summary.beyond(n_own):
                return True
        return any(map(self._is_misquote, [fragment for fragment in packet.fragments if fragment.origin == self._me]))

    def _is_misquote(self, fragment: Fragment) -> bool:
        """True for a fragment in the own name and epoch that this vehicle never recorded."""
        if fragment.epoch != self._model.epoch or fragment.sequence == STATUS:
            return False
        return self._beliefs.fragment(fragment.uid) != fragment

    def _begin_lives(self, packet: Packet) -> bool:
        """Start the new incarnations of nodes by the packet's head and its unknown items; True if there is one."""
        lives, epochs = {packet.sender: packet.epoch}, self._peers.epochs
        for fragment in packet.fragments:
            origin = fragment.origin
            is_newer = fragment.epoch > epochs[origin] and origin not in lives and origin != self._me
            if is_newer and fragment.sequence != STATUS and fragment.uid not in self._beliefs.column_of:
                lives[origin] = fragment.epoch
        begun = [(node, epoch) for node, epoch in lives.items() if epoch != epochs[node]]
        for node, epoch in begun:
            self._beliefs.begin(node, epoch)
            if self.reports is not None:
                self.reports.forget(node)
        return bool(begun)

    def _take_in(self, received: Sequence[Named | Block], taken: _Taken, now_s: float) -> int:
        """Take received items and statuses; return the items (set) with unchanged content, known ones too."""
        beliefs, content = self._beliefs, 0
        for item in received:
            if isinstance(item, Block):
                taken.blocks.append(item)
                continue
            fragment, uid, guid, block = item
            column = beliefs.column_of.get(uid)
            if fragment.origin == self._me and self._is_misquote(fragment):
                taken.is_ambiguous = True
                continue
            if column is None:
                column = self.register(item, now_s)
                if block is None and beliefs.is_whole(guid):
                    block = beliefs.block(guid)
                if block is not None:
                    beliefs.complete(guid)
                if block is not None and not self._interests.keeps(block, uid):
                    taken.aside.append(fragment)
                else:
                    taken.items.append(uid)
                    taken.blocks += () if block is None else (block,)
                content |= 1 << column
            elif beliefs.fragments[column] == fragment:
                content |= 1 << column
                if beliefs.discarded and (again := beliefs.come_again(guid)) is not None:
                    taken.blocks.append(again)
                    taken.items += [beliefs.uids[part] for part in members(beliefs.parts[guid])]
            elif guid[:2] in beliefs.shared:
                taken.is_ambiguous = True
            elif (other := _contradiction(fragment, beliefs)) is not None:
                is_in = self._model.arrived(other.guid) is not None
                taken.blocks += [other] if is_in or self._interests.keeps(other, uid) else []
        return content

    def _catch_up(self, peer: int, now_s: float) -> None:
        """Resynchronise a peer that returns or restarts: reopen items, send all summaries."""
        if self.reports is not None:
            self.reports.miss(peer)
        if not self._repeats:
            self._interests.adopt(self._beliefs.orphans(), now_s)
        self._interests.reopen(now_s)
        self._beliefs.summaries.urge()
