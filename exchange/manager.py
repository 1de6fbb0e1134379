"""The Data Exchange Manager of one vehicle: what to say in a slot, what to make of what was heard.

Sans-io: bits and ``now_s`` go in; bits and frozen values come out. It reads no clock, draws no random numbers and
calls nobody back.

The slot of the cooperation paper (section IV, "Selecting information to be shared"), step by step:
``interests`` asks who needs an item (1, 2); new candidates enter through ``offer`` and acknowledgement
timers are one frame, so every item sent in the last frame is a candidate again (3); items that all
interested peers are believed to hold are dropped (4); ``queue`` raises weights, sorts and fills the packet as
the policy study does (5, 6, 7). Who is believed to hold what, and until when an item is sent, is the business of
``ack``; who sends it that of the policy.

Two kinds of information are told apart by the TBox. An attribute of which only the latest value
matters (a vehicle's position) is a *status*: its newest value waits in the same weighted queue, is said once
and never acknowledged; the paper tolerates its loss. Everything else is an item and is repeated until it
is acknowledged.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

from exchange.blocks import fragments_of
from exchange.errors import ConfigurationError, DefinitionFault, PeerFault, SlotConflict
from exchange.interests import Interests, Renewal
from exchange.packets import (
    Fragment,
    Head,
    InfluenceSignal,
    ItemUid,
    Packet,
    Reception,
    StatusUid,
    Summary,
    Transmission,
    name_of_item,
)
from exchange.peering.beliefs import Beliefs, Sendable
from exchange.peering.listening import Listener
from exchange.peering.parking import Parking
from exchange.peering.peers import PeerLinks
from exchange.peering.relaying import Relaying
from exchange.peering.summaries import Summaries
from exchange.policies import AckPolicy
from exchange.queueing.queue import Queue
from exchange.schedule import TdmaSchedule
from exchange.values import ADDITIVE, STATUS_COLUMN, ValueRule
from exchange.wire.codec import Codec, behind, refuse_longer_texts
from exchange.wire.definitions import ComparedDefinitions, ProvenDefinitions
from exchange.wire.fragmentcodec import EPOCH_BITS
from worldmodel import STATUS, Change, Needs, PropertyValue, Stated, WorldModel
from worldmodel.facts import Guid

if TYPE_CHECKING:
    from exchange.peering.stating import Stating

OptionalPart = Literal["parking", "relaying", "summaries"]
OPTIONAL_PARTS: tuple[OptionalPart, ...] = get_args(OptionalPart)
"""Parts that a manager can do without."""
SUMMARY_SHARE = 4
"""Summaries that are due take one part in this many of a packet at most."""
SIGNAL_SHARE = 4
"""A packet keeps one part in this many for influence signals; fragments are cut to fit the rest."""


class Options(NamedTuple):
    """What a vehicle does beyond needs and policy, and how its queue values what waits.

    Attributes:
        carrier_evidence: take a peer that carries an item as holding it.
        selective: neither keep nor pass on items that this vehicle has no need of.
        value: rule by which the queue compares what waits.
        queue_limit: most items that wait in it; None for no limit.
    """

    carrier_evidence: bool = True
    selective: bool = False
    value: ValueRule = ADDITIVE
    queue_limit: int | None = None


USUAL = Options()


def _refuse_future(packet: Packet, now_s: float, model: WorldModel) -> None:
    """Refuse a packet with a fact that was observed later than it arrives: it was damaged, or a clock is wrong."""
    for fragment in packet.fragments:
        if fragment.time_s > now_s and fragment.time_s > model.latest_time_s(now_s):
            raise PeerFault(
                f"a fact of {fragment.time_s:g} s arrives at {now_s:g} s: from the future, beyond a clock "
                f"tolerance of {model.clock_tolerance_s:g} s"
            )


class ExchangeManager:
    """Ledger, acknowledgement state and queue of one vehicle.

    Args:
        me: own node index.
        model: own world model, read only (which blocks are known, classes of instances).
        codec, schedule, policy: the same at every vehicle.
        payload_bits: size of a packet on the modem.
        needs: which nodes need what, with priorities; ``renew`` is called when they have changed.
        options: what it does beyond these.

    Raises:
        ConfigurationError: the header and one signal do not fit ``payload_bits``.
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
        self._options = options
        self._room_bits = payload_bits - codec.overhead_bits
        self._signal_room_bits = max(codec.signal_bits, self._room_bits // SIGNAL_SHARE)
        if self._room_bits < 2 * codec.signal_bits:
            raise ConfigurationError(
                f"a packet of {payload_bits} bits has no room behind the header of {codec.overhead_bits} bits "
                f"that policy {policy.name} needs for {schedule.n_nodes} nodes"
            )
        refuse_longer_texts(codec, self._room_bits)
        self.n_nodes = schedule.n_nodes
        """Size of the fleet."""
        kind = policy.acknowledgement
        self._beliefs = beliefs = Beliefs(me, self.n_nodes, kind, self._epoch)
        beliefs.summaries = Summaries(beliefs, codec.summary_bits)
        self._peers = beliefs.peers
        self.queue = Queue(options.value, options.queue_limit)
        """What waits to be said, why it was not said, and what is said no more."""
        self._interests = Interests(model, needs, beliefs, self.queue, codec.fragment_bits, options.selective)
        self.is_of_use = self._interests.is_of_use
        """``is_of_use(facts)``: True if these have an attribute that is exchanged, whoever needs it now."""
        evidence, frame_s = options.carrier_evidence, schedule.frame_s
        self._listener = Listener(model, beliefs, self._interests, policy.repeat, evidence, frame_s)
        self.parking: Parking | None = Parking(beliefs, self._listener)
        """Suspension for peers that are silent for too long; None if it is taken out."""
        if not policy.repeat:
            self._listener.relaying = Relaying(beliefs, self._listener)
        if codec.accounts is not None:
            from exchange.peering.stating import Stating

            sizes = codec.accounts, codec.fragment_bits
            self._listener.stating = Stating(beliefs, *sizes, self._interests.priority_here, kind.codes)
        self.half_blocks = self._listener.assembly.lacking
        """``half_blocks() -> list``: names of blocks of which it has parts, and lacks others."""
        self._signals: tuple[InfluenceSignal, ...] = ()
        self._n_signals_said = 0
        self._left_to_relays = 0  # items that rest, in the packet that is being filled
        self._due_to_statuses = 0  # bits that statuses may take before items, so far
        self._is_for_large = False  # large items go first in the next one that leaves no room to statuses
        self.n_faults = 0

    def offer(self, changes: Iterable[Change], addressed: Collection[int] = ()) -> tuple[Fragment, ...]:
        """Take blocks this vehicle recorded itself as candidates; returns the items they became, without status.

        Args:
            changes: of the world model.
            addressed: peers that the blocks are for, if not for all alike: once these hold them, others can wait.
        """
        items: list[Fragment] = []
        for change in changes:
            block = change.block
            if block.sequence == STATUS:
                self._interests.take_status(block)
                continue
            room_bits = self._room_bits - self._signal_room_bits
            for fragment in fragments_of(block, room_bits, self._codec.fragment_bits):
                entry = Sendable(fragment, block.facts, addressed=sum([1 << peer for peer in addressed]))
                self._listener.register(name_of_item(fragment), block.time_s, entry)
                items.append(fragment)
            self._beliefs.complete(block.guid)
        return tuple(items)

    def resume(self, now_s: float) -> None:
        """Take up what the world model holds, after a restart with its memory; who holds it is to be learned anew."""
        self._listener.resume(self._room_bits - self._signal_room_bits, self._codec.fragment_bits, now_s)
        self._interests.adopt(self._beliefs.orphans(), now_s)
        if self.summaries is not None:
            self.summaries.telling.urge()

    def fits(self, facts: Iterable[Stated]) -> bool:
        """True if a block of these facts would go into one packet, beside influence signals."""
        whole = Fragment(self._me, 0, 0.0, tuple(PropertyValue(*fact) for fact in facts))
        return self._codec.fragment_bits(whole) <= self._room_bits - self._signal_room_bits

    def offer_signals(self, signals: Sequence[InfluenceSignal]) -> None:
        """Influence signals for the next own slot; those of an earlier call are forgotten.

        Of more than fit, a part is said, another one in the next slot.
        """
        most = self._signal_room_bits // self._codec.signal_bits
        first = self._n_signals_said % len(signals) if len(signals) > most else 0
        self._signals = (*signals[first:], *signals[:first])[:most]
        self._n_signals_said += len(self._signals)

    def receive(self, data: bytes, now_s: float) -> Reception:
        """Take in a packet that arrives at ``now_s``; a bad one is counted, never raised, nor acknowledged."""
        schedule = self._schedule
        try:
            head = self._codec.head(data)
        except PeerFault as fault:
            self.n_faults += 1
            slot = schedule.slot_of_arrival(now_s)
            return Reception(slot, schedule.owner(slot), fault=str(fault))
        sender, slot = head.sender, schedule.slot_named(head, now_s)
        frame, start_s = schedule.frame_of(slot), schedule.start_s(slot)
        try:
            era = self._peers.epochs[sender] >> EPOCH_BITS
            try:
                judged = self._codec.judged(data, frame, start_s, era)
            except DefinitionFault:
                judged = self._codec.judged(data, frame, start_s, self._era_now(data, sender, frame, era))
            packet = judged.packet
            if not schedule.may_arrive(slot, now_s, self._model.clock_tolerance_s):
                raise PeerFault(f"a packet of node {sender} of slot {slot} arrives in slot {schedule.slot_at(now_s)}")
            if sender == self._me:
                raise SlotConflict("another speaks as this vehicle")
            self._refuse_untimely(slot, sender, now_s)
            if sender not in self._definitions.trusted:
                self._definitions.agree(sender, frame)
            if judged.latest_s > now_s:
                _refuse_future(packet, now_s, self._model)
            if judged.wrong is not None:  # the world model would never take its block
                raise PeerFault(judged.wrong)
            met = self._peers.meet(sender, packet.epoch, frame)
        except PeerFault as fault:
            self.n_faults += 1
            differs = isinstance(fault, DefinitionFault) and self._definitions.differ(sender, frame)
            is_twin = isinstance(fault, SlotConflict) and self._listener.doubt(sender, frame, now_s)
            return Reception(slot, sender, fault=str(fault), is_stranger=differs, conflict=sender if is_twin else None)
        self._beliefs.log.open(slot)
        is_second = self._peers.conflicts(sender, slot, data)
        heard = self._listener.listen(judged, slot, met, is_second, now_s)
        if (stating := self._listener.stating) is not None:
            self.n_faults, stating.n_refused = self.n_faults + stating.n_refused, 0
        if (relaying := self.relaying) is not None:
            if judged.relays:
                relaying.note(packet)
            if frame >= relaying.due_frame:
                relaying.look(frame, now_s)
        return heard

    def _refuse_untimely(self, slot: int, sender: int, now_s: float) -> None:
        """Raise PeerFault if a packet of that slot comes when it can no more be heeded, or not yet."""
        log = self._beliefs.log
        if slot + self.n_nodes <= log.slot:
            raise PeerFault(f"a packet of node {sender} of slot {slot} arrives when its next slot is open")
        own = slot - (slot - self._me) % self.n_nodes  # the last own slot before it
        if own > log.slot and self._schedule.start_s(own) > now_s:
            raise PeerFault(f"a packet of slot {slot} arrives before the own slot {own} is open")

    def _era_now(self, data: bytes, sender: int, frame: int, known: int) -> int:
        """The era that a peer is in by its packet, if that is to be believed, else the one known."""
        era = self._codec.era_of(data, frame)
        return era if self._definitions.claim(sender, frame, era) and era is not None else known

    def _own_slot(self, now_s: float) -> int:
        """The slot of this vehicle that opens; raises ConfigurationError if it is that of another."""
        slot = self._schedule.slot_at(now_s)
        if (owner := slot % self.n_nodes) != self._me:
            raise ConfigurationError(f"slot {slot} at {now_s} s belongs to node {owner}, not to node {self._me}")
        return slot

    @property
    def summaries(self) -> Summaries | None:
        """What peers are told and tell of what is held; None if that is taken out."""
        return self._beliefs.summaries

    @property
    def relaying(self) -> Relaying | None:
        """What is sent for others whose links are poor; None where all repeat or if that is taken out."""
        return self._listener.relaying

    def leave_out(self, part: OptionalPart) -> None:
        """Do without an optional part from now on."""
        if part == "parking":
            self.parking = None
        elif part == "relaying":
            self._listener.relaying = None
        else:
            self._beliefs.summaries = None

    def give_up(self, guids: Iterable[Guid]) -> None:
        """The world model has forgotten these blocks, so that they may come again: peers are told that they lack."""
        self._beliefs.give_up(guids)

    def links(self, peer: int) -> PeerLinks:
        """What the links from and to a peer lose, as far as this vehicle can tell."""
        return self._peers.links(peer)

    def renew(self, now_s: float) -> Renewal:
        """Judge all items anew: who needs what has changed."""
        return self._interests.renew(now_s)

    def keep_silent(self, now_s: float) -> int:
        """Let the own slot that opens at ``now_s`` pass without a packet; returns its number."""
        slot = self._own_slot(now_s)
        self._beliefs.log.open(slot)
        self._signals = ()
        return slot

    def packet_to_send(self, now_s: float) -> Transmission:
        """The packet for the own slot that opens at ``now_s`` (s)."""
        slot = self._own_slot(now_s)
        self._beliefs.log.open(slot)
        if self._interests.undecided:
            self._interests.decide(now_s)
        codec, schedule, signals = self._codec, self._schedule, self._signals
        frame, start_s = schedule.frame_of(slot), schedule.start_s(slot)
        noticed: tuple[tuple[int, str], ...] = ()
        if self.parking is not None and self._peers.silences(frame):
            noticed = self.parking.look(frame, now_s)
        summary: tuple[Summary, ...] = ()
        if (summaries := self.summaries) is not None:
            summary = summaries.telling.urgent(self._room_bits // SUMMARY_SHARE)
        if (relaying := self.relaying) is not None and (relaying.left or self.queue.resting):
            self.queue.rest(relaying.resting(self.queue.open, frame, now_s))
        header = codec.header
        spared_bits = header.largest_bits - header.size_bits(self._me, frame) if header.varies else 0
        signals_bits = len(signals) * codec.signal_bits
        summary_bits = sum(map(codec.summary_bits, summary))
        room_bits = self._room_bits + spared_bits - signals_bits - summary_bits
        if (stating := self._listener.stating) is not None:
            room_bits -= self._let_plan(stating, room_bits)
        packing = codec.packing(self._me, self._epoch, start_s, room_bits)
        chosen = self.queue.choose(packing, now_s)
        is_spare = not summary
        if summaries is not None and is_spare:
            summary = summaries.telling.spare(packing.left_bits)
            summary_bits = sum(map(codec.summary_bits, summary))
        columns: list[int] = []
        items: list[ItemUid] = []
        status: list[StatusUid] = []
        for candidate in chosen:
            if isinstance(candidate.uid, ItemUid):
                items.append(candidate.uid)
                columns.append(candidate.column)
            else:
                status.append(candidate.uid)
        is_doubted = frame < self._peers.trusted_from and self._peers.is_doubted(self._me, frame)
        rows = self._beliefs.log.compose(slot, () if is_doubted else columns, self._beliefs.holders)
        if relaying is not None:
            relaying.rows[self._me].append(rows[self._me])
        head = Head(self._me, self._epoch, frame)
        acks, wired = header.encode(self._me, rows, frame), packing.wired()
        n_acks = acks[0].bit_count()
        if stating is not None and codec.accounts is not None:
            self.queue.rest(self._left_to_relays)
            said_bits = sum([candidate.size_bits for candidate in chosen if candidate.column == STATUS_COLUMN])
            self._due_to_statuses = max(0, self._due_to_statuses - said_bits)
            left_bits = packing.left_bits - (summary_bits if is_spare else 0)
            acks = behind(acks, codec.accounts.encode(stating.account(columns, slot, left_bits), self._me))
        data = codec.assembled(head, start_s, acks, wired, signals, summary)
        self._signals = ()
        return Transmission(
            slot,
            data,
            8 * len(data),
            tuple(items),
            n_acks,
            tuple([(fragment.facts[0].attribute, size_bits) for fragment, _, size_bits in wired]),
            signals_bits,
            tuple(status),
            signals,
            summary,
            summary_bits,
            noticed,
        )

    def _let_plan(self, stating: Stating, room_bits: int) -> int:
        """Let what is not planned rest for this packet; returns what is said of holdings (bits).

        Statuses are not planned. Of the room they are due the share that they have of what waits, by priority and size,
        as under the additive rule; half of a packet at most, once the smallest of them fits. Else they compete with
        what is planned for what the account leaves.
        """
        queue = self.queue
        self._left_to_relays = queue.resting if self.relaying is not None else 0
        statuses, others_weight = queue.statuses, queue.items_weight
        status_bits = sum([candidate.size_bits for candidate in statuses])
        weight = sum([candidate.waiting.priority * candidate.size_bits for candidate in statuses])
        kept_bits, large_first = 0, False
        if statuses:
            due_bits = self._due_to_statuses + room_bits * weight // (weight + others_weight)
            self._due_to_statuses = min(status_bits, due_bits)
            kept_bits = min(room_bits // 2, self._due_to_statuses)
            if kept_bits < min([candidate.size_bits for candidate in statuses]):
                kept_bits = 0
        if not kept_bits:
            large_first, self._is_for_large = self._is_for_large, not self._is_for_large
        chosen, account_bits = stating.plan(queue.open & ~self._left_to_relays, room_bits - kept_bits, large_first)
        queue.rest(queue.open & ~chosen)
        return account_bits

    def holds(self, uid: ItemUid) -> bool:
        """True if this vehicle holds the item."""
        return uid in self._beliefs.column_of or self._beliefs.own.has((uid.origin, uid.epoch), uid.sequence)

    def knows_life(self, peer: int, epoch: int) -> bool:
        """True if this vehicle has heard ``peer`` in the life of that epoch; in its first one it need not."""
        return self._peers.epochs[peer] == epoch

    def believes(self, peer: int, uid: ItemUid) -> bool:
        """True if this vehicle believes that ``peer`` holds the item."""
        column = self._beliefs.column_of.get(uid)
        return column is not None and bool(self._beliefs.holders[column] >> peer & 1)

    @property
    def n_open(self) -> int:
        """Items that this vehicle goes on sending: none that it leaves to another."""
        return (self.queue.open & ~self.queue.resting).bit_count()

    def postponed(self) -> Iterator[tuple[int, ItemUid]]:
        """Nodes, and items that they lack though nothing is open: peers that are away, and this one what it gave up."""
        return chain(self._interests.postponed(), self._beliefs.given_up())
