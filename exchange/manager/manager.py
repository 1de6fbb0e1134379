"""Data Exchange Manager of one vehicle: packet selection and processing of received packets.

Sans-io: bits and ``now_s`` in, bits and frozen values out. It reads no clock, draws no random numbers and makes no
callbacks.

A slot follows the cooperation paper (section IV, "Selecting information to be shared"): ``interests`` finds the nodes
that need an item (1, 2); ``offer`` adds candidates, and the acknowledgement timer is one frame, so that every item sent
in the last frame is a candidate again (3); items that all interested peers are believed to hold are dropped (4);
``queue`` raises weights, sorts and fills the packet as the policy study does (5, 6, 7). ``beliefs`` has the holders of
an item; the policy fixes its senders.

The TBox distinguishes two kinds of information. An attribute of which only the latest value matters (such as a
position) is a *status*: its newest value waits in the same queue, is sent once and never acknowledged; the paper
tolerates its loss. Everything else is an item and is repeated until acknowledged.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Literal, NamedTuple

from exchange.errors import ConfigurationError, DefinitionFault, PeerFault, SlotConflict
from exchange.manager.beliefs import Beliefs, Sendable
from exchange.manager.interests import Interests
from exchange.manager.peers import PeerLinks
from exchange.manager.receiver import Receiver
from exchange.manager.relaying import Relaying
from exchange.packets import (
    Fragment,
    Head,
    InfluenceSignal,
    ItemUid,
    Reception,
    StatusUid,
    Summary,
    Transmission,
    fragments_of,
    name_of_item,
)
from exchange.policy.candidates import ADDITIVE, STATUS_COLUMN, ValueRule
from exchange.policy.policies import AckPolicy
from exchange.policy.queue import Queue
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import Codec, refuse_longer_texts
from exchange.wire.definitions import ComparedDefinitions, ProvenDefinitions
from exchange.wire.factcodec import joined
from exchange.wire.fragmentcodec import EPOCH_BITS
from worldmodel import STATUS, Block, Change, Needs, PropertyValue, Stated, WorldModel

if TYPE_CHECKING:
    from exchange.manager.holdings import HoldingsReports

OptionalPart = Literal["parking", "relaying", "summaries"]
"""Parts that a manager can disable."""
PARKED = "parked"
"""Event of a peer that becomes absent."""
SUMMARY_SHARE = 4
"""Due summaries take at most one part in this many of a packet."""
SIGNAL_SHARE = 4
"""Influence signals reserve one part in this many of a packet; fragments fit the rest."""


class Options(NamedTuple):
    """Options of a vehicle beyond needs and policy.

    ``carrier_evidence``: a peer that carries an item counts as a holder. ``selective``: neither keep nor relay items
    that this vehicle does not need. A ``queue_limit`` of None is no limit.
    """

    carrier_evidence: bool = True
    selective: bool = False
    value: ValueRule = ADDITIVE
    queue_limit: int | None = None


USUAL = Options()


class ExchangeManager:
    """Ledger, acknowledgement state and queue of one vehicle.

    The model is read only; codec, schedule and policy are equal at every vehicle; call ``renew`` after a change of
    needs. Raises ConfigurationError if ``payload_bits`` cannot hold the header and signals, or a text.
    """

    def __init__(
        self,
        me: int,
        model: WorldModel,
        codec: Codec,
        schedule: TdmaSchedule,
        policy: AckPolicy,
        payload_bits: int,
        needs: Needs,
        options: Options = USUAL,
    ) -> None:
        self._me = me
        self._model = model
        self._epoch = model.epoch
        self._definitions = ProvenDefinitions() if codec.is_sealed else ComparedDefinitions()
        self._codec = codec
        self._schedule = schedule
        self._room_bits = payload_bits - codec.overhead_bits
        self._signal_room_bits = max(codec.signal_bits, self._room_bits // SIGNAL_SHARE)
        self._fragment_room_bits = self._room_bits - self._signal_room_bits
        if self._room_bits < 2 * codec.signal_bits:
            raise ConfigurationError(
                f"a packet of {payload_bits} bits has no room behind the header of {codec.overhead_bits} bits "
                f"that policy {policy.name} needs for {schedule.n_nodes} nodes"
            )
        refuse_longer_texts(codec, self._room_bits)
        self.n_nodes = schedule.n_nodes
        """Size of the fleet."""
        kind = policy.acknowledgement
        self._beliefs = beliefs = Beliefs(me, self.n_nodes, kind, codec.encode_summary, self._epoch)
        self._peers = beliefs.peers
        self.queue = Queue(options.value, options.queue_limit)
        """Queued entries, with the reasons for entries not sent or discarded."""
        self._interests = Interests(model, needs, beliefs, self.queue, codec.fragment_bits, options.selective)
        self.is_of_use = self._interests.is_of_use
        """``is_of_use(facts)``: True if an attribute of these is exchanged, needed now or not."""
        evidence, frame_s = options.carrier_evidence, schedule.frame_s
        self._receiver = Receiver(model, beliefs, self._interests, policy.repeat, evidence, frame_s)
        self._summarises = True
        self.parking = True
        """True if items do not wait for a peer whose silence exceeds loss; it resynchronises at its next packet."""
        if not policy.repeat:
            self._receiver.relaying = Relaying(beliefs, self._interests, model)
        if codec.accounts is not None:
            from exchange.manager.holdings import HoldingsReports

            sizes = codec.accounts, codec.fragment_bits
            self._receiver.reports = HoldingsReports(beliefs, *sizes, self._interests.priority_here, kind.codes)
        self.half_blocks = beliefs.half_blocks
        """``half_blocks() -> list``: names of incomplete blocks."""
        self.give_up = beliefs.give_up
        """``give_up(guids)``: mark discarded blocks as missing, so that peers send them again."""
        self.renew = self._interests.renew
        """``renew(now_s) -> Renewal``: evaluate all items again after a change of needs."""
        self._signals: tuple[InfluenceSignal, ...] = ()
        self._n_signals_sent = 0
        self._due_to_statuses = 0  # accumulated bits that statuses may take before items
        self._is_for_large = False  # the next packet without reserve for statuses starts with large items
        self.n_faults = 0

    def offer(self, changes: Iterable[Change], addressed: Collection[int] = ()) -> tuple[Fragment, ...]:
        """Queue own blocks; return their items, statuses excluded.

        ``addressed`` are peers that the blocks are for; once these hold them, the priority for others falls.
        """
        items: list[Fragment] = []
        for change in changes:
            if change.block.sequence == STATUS:
                self._interests.take_status(change.block)
            else:
                items += self._register(change.block, change.block.time_s, sum([1 << peer for peer in addressed]))
        return tuple(items)

    def _register(self, block: Block, now_s: float, addressed: int = 0) -> tuple[Fragment, ...]:
        """Register a whole block in fragments that fit packets; return them."""
        fragments = fragments_of(block, self._fragment_room_bits, self._codec.fragment_bits)
        for fragment in fragments:
            self._receiver.register(name_of_item(fragment), now_s, Sendable(fragment, block.facts, addressed=addressed))
        self._beliefs.complete(block.guid)
        return fragments

    def resume(self, now_s: float) -> None:
        """Register the content of the world model after a restart; its holders are unknown."""
        for guid, block in self._model.items():
            if block is None:
                self._beliefs.complete(guid)
            else:
                self._register(block, now_s)
        self._interests.adopt(self._beliefs.orphans(), now_s)
        self._beliefs.summaries.urge()

    def fits(self, facts: Iterable[Stated]) -> bool:
        """True if a block of these facts fits one packet, beside influence signals."""
        whole = Fragment(self._me, 0, 0.0, tuple(PropertyValue(*fact) for fact in facts))
        return self._codec.fragment_bits(whole) <= self._fragment_room_bits

    def offer_signals(self, signals: Sequence[InfluenceSignal]) -> None:
        """Replace the influence signals for the next own slot; if too many, slots alternate."""
        most = self._signal_room_bits // self._codec.signal_bits
        first = self._n_signals_sent % len(signals) if len(signals) > most else 0
        self._signals = (*signals[first:], *signals[:first])[:most]
        self._n_signals_sent += len(self._signals)

    def receive(self, data: bytes, now_s: float) -> Reception:
        """Process a packet that arrives at ``now_s``; count an invalid one, without an exception."""
        schedule, log = self._schedule, self._beliefs.log
        try:
            head = self._codec.head(data)
        except PeerFault as fault:
            self.n_faults += 1
            slot = schedule.slot_of_arrival(now_s)
            return Reception(slot, schedule.owner(slot), fault=str(fault))
        sender, slot = head.sender, schedule.slot_named(head, now_s)
        frame, start_s = slot // self.n_nodes, slot * schedule.slot_s
        try:
            era = self._peers.epochs[sender] >> EPOCH_BITS
            try:
                decoded = self._codec.decode(data, frame, start_s, era)
            except DefinitionFault:
                # A peer that restarted may be in another era, which changes the hash byte.
                decoded = self._codec.decode(data, frame, start_s, self._era_now(data, sender, frame, era))
            packet = decoded.packet
            if not schedule.may_arrive(slot, now_s, self._model.clock_tolerance_s):
                raise PeerFault(f"a packet of node {sender} of slot {slot} arrives in slot {schedule.slot_at(now_s)}")
            if sender == self._me:
                raise SlotConflict("another speaks as this vehicle")
            if slot + self.n_nodes <= log.slot:
                raise PeerFault(f"a packet of node {sender} of slot {slot} arrives when its next slot is open")
            own = slot - (slot - self._me) % self.n_nodes  # the last own slot before it
            if own > log.slot and schedule.start_s(own) > now_s:
                raise PeerFault(f"a packet of slot {slot} arrives before the own slot {own} is open")
            self._definitions.agree(sender, frame)
            # Damage or a wrong clock. The first comparison saves the usual packet the rounding of the second.
            if decoded.latest_s > now_s and decoded.latest_s > self._model.latest_time_s(now_s):
                raise PeerFault(
                    f"a fact of {decoded.latest_s:g} s arrives at {now_s:g} s: from the future, beyond a clock "
                    f"tolerance of {self._model.clock_tolerance_s:g} s"
                )
            # Last of the checks, since it counts the packet as presence of its sender and as a sample of the link.
            met, is_second = self._peers.meet(sender, packet.epoch, frame, data)
        except PeerFault as fault:
            self.n_faults += 1
            differs = isinstance(fault, DefinitionFault) and self._definitions.differ(sender, frame)
            is_twin = isinstance(fault, SlotConflict) and self._receiver.doubt(sender, frame, now_s)
            return Reception(slot, sender, fault=str(fault), is_stranger=differs, conflict=sender if is_twin else None)
        log.open(slot)
        reception = self._receiver.apply(decoded, slot, met, is_second, now_s)
        if (reports := self._receiver.reports) is not None:
            self.n_faults, reports.n_refused = self.n_faults + reports.n_refused, 0
        if (relaying := self._receiver.relaying) is not None:
            if decoded.relays:
                relaying.note(packet)
            if frame >= relaying.due_frame:
                relaying.look(frame, now_s)
        return reception

    def _era_now(self, data: bytes, sender: int, frame: int, known: int) -> int:
        """Return the era of a peer by its packet if proven, else the known one."""
        era = self._codec.era_of(data, frame)
        return era if self._definitions.claim(sender, frame, era) and era is not None else known

    def _own_slot(self, now_s: float) -> int:
        """Return the own slot that opens; raise ConfigurationError in a slot of another node."""
        slot = self._schedule.slot_at(now_s)
        if (owner := slot % self.n_nodes) != self._me:
            raise ConfigurationError(f"slot {slot} at {now_s} s belongs to node {owner}, not to node {self._me}")
        return slot

    @property
    def relaying(self) -> Relaying | None:
        """Relaying over poor links; None if disabled or if the policy repeats items."""
        return self._receiver.relaying

    def leave_out(self, part: OptionalPart) -> None:
        """Disable an optional part."""
        if part == "parking":
            self.parking = False
        elif part == "relaying":
            self._receiver.relaying = None
        else:
            self._summarises = False

    def links(self, peer: int) -> PeerLinks:
        """Return the loss estimates of the links from and to a peer."""
        return PeerLinks(self._peers.incoming[peer].link, self._peers.outgoing[peer].link)

    def keep_silent(self, now_s: float) -> int:
        """Skip the own slot at ``now_s``; return its number."""
        slot = self._own_slot(now_s)
        self._beliefs.log.open(slot)
        self._signals = ()
        return slot

    def packet_to_send(self, now_s: float) -> Transmission:
        """Compose the packet of the own slot that opens at ``now_s``."""
        slot = self._own_slot(now_s)
        self._beliefs.log.open(slot)
        if self._interests.undecided:
            self._interests.decide(now_s)
        codec, schedule, signals = self._codec, self._schedule, self._signals
        frame, start_s = slot // self.n_nodes, slot * schedule.slot_s
        away = self._peers.away
        absent = self._peers.mark_absent(frame) if self.parking else []
        if self._peers.away != away:
            self._interests.settle(now_s) if absent else self._interests.reopen(now_s)
        summary: tuple[Summary, ...] = ()
        summary_bits = 0
        if self._summarises:
            summary, summary_bits = self._beliefs.summaries.urgent(self._room_bits // SUMMARY_SHARE)
        if (relaying := self._receiver.relaying) is not None and (relaying.left or self.queue.resting):
            self.queue.rest(relaying.resting(self.queue.open, frame, now_s))
        signals_bits = len(signals) * codec.signal_bits
        # ``_room_bits`` assumes the largest header; a smaller one leaves its bits to the sections.
        room_bits = self._room_bits + codec.spare_bits(self._me, frame) - signals_bits - summary_bits
        account_bits = left_out = 0
        if (reports := self._receiver.reports) is not None:
            account_bits, left_out = self._let_plan(reports, room_bits)
        packing = codec.packing(self._me, self._epoch, start_s, room_bits - account_bits)
        chosen = self.queue.choose(packing, now_s, left_out)
        if self._summarises and not summary:
            summary, summary_bits = self._beliefs.summaries.spare(packing.left_bits)
            packing.left_bits -= summary_bits
        content = sum([1 << candidate.column for candidate in chosen if candidate.column != STATUS_COLUMN])
        is_doubted = frame <= self._peers.doubted_until[self._me]
        # While the own id is ambiguous, an acknowledgement may be for the other vehicle's packet: record no items.
        acks = self._beliefs.log.compose(slot, 0 if is_doubted else content, self._beliefs.held)
        if relaying is not None:
            relaying.rows[self._me].append(self._beliefs.log.heard)
        head = Head(self._me, self._epoch, frame)
        header, (fragments, sizes) = codec.encode_acks(self._me, acks, frame), packing.wired()
        n_acks = header[0].bit_count()
        if reports is not None:
            said_bits = sum([candidate.size_bits for candidate in chosen if candidate.column == STATUS_COLUMN])
            self._due_to_statuses = max(0, self._due_to_statuses - said_bits)
            header = joined(header, reports.section(content, slot, packing.left_bits))
        data = codec.assembled(head, start_s, header, fragments, signals, summary)
        self._signals = ()
        return Transmission(
            slot,
            data,
            8 * len(data),
            tuple([candidate.uid for candidate in chosen if isinstance(candidate.uid, ItemUid)]),
            n_acks,
            tuple(sizes),
            signals_bits,
            tuple([candidate.uid for candidate in chosen if isinstance(candidate.uid, StatusUid)]),
            signals,
            summary,
            summary_bits,
            tuple([(node, PARKED) for node in absent]),
        )

    def _let_plan(self, reports: HoldingsReports, room_bits: int) -> tuple[int, int]:
        """Plan the packet; return the size of the holdings section, and the items (set) left out.

        Statuses are not planned. Their share of the capacity is their share of the queue by priority times size, as
        under the additive rule, accumulated over packets; at most half of a packet, once the smallest of them fits.
        Otherwise they compete with planned items for the capacity beside the section.
        """
        queue = self.queue
        statuses, others_weight, candidates = queue.statuses, queue.items_weight, queue.open & ~queue.resting
        status_bits = sum([candidate.size_bits for candidate in statuses])
        weight = sum([candidate.priority * candidate.size_bits for candidate in statuses])
        kept_bits, large_first = 0, False
        if statuses:
            due_bits = self._due_to_statuses + room_bits * weight // (weight + others_weight)
            self._due_to_statuses = min(status_bits, due_bits)
            kept_bits = min(room_bits // 2, self._due_to_statuses)
            if kept_bits < min([candidate.size_bits for candidate in statuses]):
                kept_bits = 0
        if not kept_bits:
            large_first, self._is_for_large = self._is_for_large, not self._is_for_large
        chosen, account_bits = reports.plan(candidates, room_bits - kept_bits, large_first)
        return account_bits, candidates & ~chosen

    def holds(self, uid: ItemUid) -> bool:
        """True if this vehicle holds the item."""
        return uid in self._beliefs.column_of or self._beliefs.has_block((uid.origin, uid.epoch, uid.sequence))

    def knows_life(self, peer: int, epoch: int) -> bool:
        """True if ``epoch`` (restart count) is the latest known of ``peer``; 0 before any packet."""
        return self._peers.epochs[peer] == epoch

    def believes(self, peer: int, uid: ItemUid) -> bool:
        """True if ``peer`` is believed to hold the item."""
        column = self._beliefs.column_of.get(uid)
        return column is not None and bool(self._beliefs.held[peer] >> column & 1)

    @property
    def n_open(self) -> int:
        """Number of outstanding items, without those left to relays."""
        return (self.queue.open & ~self.queue.resting).bit_count()

    def postponed(self) -> Iterator[tuple[int, ItemUid]]:
        """Yield (node, item) for each lacked item not queued: at absent peers, or discarded here."""
        return chain(self._interests.postponed(), self._beliefs.given_up())
