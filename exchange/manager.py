"""The Data Exchange Manager of one vehicle: what to say in a slot, what to make of what was heard.

Sans-io: bits and ``now_s`` go in; bits and frozen values come out. It reads no clock, draws no random numbers and
calls nobody back.

The slot of the cooperation paper (section IV, "Selecting information to be shared"), step by step:
``interests`` asks who needs an item (1, 2); new candidates enter through ``offer`` and acknowledgement
timers are one frame, so every item sent in the last frame is a candidate again (3); items that all
interested peers are believed to hold are dropped (4); ``queue`` raises weights, sorts and fills the packet as
``selection.select`` does (5, 6, 7). Who is believed to hold what, and until when an item is sent, is the business of
``ack``; who sends it that of the policy.

Two kinds of information are told apart by the TBox. An attribute of which only the latest value
matters (a vehicle's position) is a *status*: its newest value waits in the same weighted queue, is said once
and never acknowledged; the paper tolerates its loss. Everything else is an item and is repeated until it
is acknowledged.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain

from exchange import ack
from exchange.ageing import ageing_of
from exchange.blocks import fragments_of
from exchange.codec import Codec, refuse_longer_texts
from exchange.definitions import Definitions
from exchange.errors import ConfigurationError, DefinitionFault, PeerFault, SlotConflict
from exchange.holders import Holders
from exchange.interests import Interests, Renewal
from exchange.ledger import Entry, Ledger
from exchange.links import PeerLinks
from exchange.listening import Listener
from exchange.packets import Fragment, Head, InfluenceSignal, ItemUid, Packet, Reception, StatusUid, Transmission
from exchange.peers import USUAL_UPKEEP, Peers, Upkeep
from exchange.policies import AckPolicy
from exchange.queue import Queue
from exchange.schedule import TdmaSchedule
from exchange.turns import Turns
from exchange.values import ADDITIVE, STATUS_COLUMN, ValueRule
from worldmodel import Change, Needs, PropertyValue, Stated, WorldModel
from worldmodel.facts import Guid

SUMMARY_SHARE = 4
"""Summaries that are due take one part in this many of a packet at most."""
SIGNAL_SHARE = 4
"""A packet keeps one part in this many for influence signals; fragments are cut to fit the rest."""


def _refuse_future(packet: Packet, now_s: float, model: WorldModel) -> None:
    """Refuse a packet with a fact that was observed later than it arrives: it was damaged, or a clock is wrong."""
    latest_s = model.latest_time_s(now_s)
    for fragment in packet.fragments:
        if fragment.time_s > latest_s:
            raise PeerFault(
                f"a fact of {fragment.time_s:g} s arrives at {now_s:g} s: from the future, beyond a clock "
                f"tolerance of {model.clock_tolerance_s:g} s"
            )


def _refuse_out_of_range(packet: Packet, model: WorldModel) -> None:
    """Refuse a packet with a value that nobody can have recorded: the world model would never take its block."""
    for fragment in packet.fragments:
        for fact in fragment.facts:
            if not model.may_record(fact):
                attribute = model.tbox.attributes[fact.attribute]
                raise PeerFault(f"{attribute.name} is {fact.value}, out of its range")


class ExchangeManager:
    """Ledger, acknowledgement state and queue of one vehicle.

    Args:
        me: own node index.
        model: own world model, read only (which blocks are known, classes of instances).
        codec, schedule, policy: the same at every vehicle.
        payload_bits: size of a packet on the modem.
        needs: which nodes need what, with priorities; ``renew`` is called when they have changed.
        carrier_evidence: take a peer that carries an item as holding it.
        selective: neither keep nor pass on items that this vehicle has no need of.
        value: rule by which the queue compares what waits.
        queue_limit: most items that wait in it; None for no limit.
        upkeep: what is done for peers that were away or begin anew.

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
        carrier_evidence: bool = True,
        selective: bool = False,
        value: ValueRule = ADDITIVE,
        queue_limit: int | None = None,
        upkeep: Upkeep = USUAL_UPKEEP,
    ) -> None:
        self._me = me
        self._model = model
        self._epoch = model.epoch
        self._definitions = Definitions()
        self._codec = codec
        self._schedule = schedule
        self._upkeep = upkeep
        self._room_bits = payload_bits - codec.overhead_bits
        self._signal_room_bits = max(codec.signal_bits, self._room_bits // SIGNAL_SHARE)
        if self._room_bits < 2 * codec.signal_bits:
            raise ConfigurationError(
                f"a packet of {payload_bits} bits has no room behind the header of {codec.overhead_bits} bits "
                f"that policy {policy.name} needs for {schedule.n_nodes} nodes"
            )
        refuse_longer_texts(codec, self._room_bits)
        self._n_nodes = schedule.n_nodes
        states = ack.new_state(self._n_nodes), ack.new_state(self._n_nodes)
        self._state = states[0]
        self._ledger = Ledger(self._n_nodes)
        self.queue = Queue(value, queue_limit)
        """What waits to be said, why it was not said, and what is said no more."""
        self._interests = Interests(me, model, needs, self._ledger, self.queue, codec.fragment_bits, selective)
        self._peers = Peers(me, self._n_nodes, states, policy.acknowledgement)
        self._ageing = ageing_of(me, schedule, states, policy.acknowledgement)
        self.turns = Turns(me, schedule, model)
        """Own slots, where they do not follow from the node."""
        self._holders = Holders(me, self._state, self._ledger, self._peers, codec.summary_bits)
        if self._epoch:
            self._holders.begin(me, self._epoch)
        self._listener = Listener(
            me, model, self._state, self._ledger, self._interests, self._holders, self._peers,
            self._ageing, policy, carrier_evidence, upkeep.summaries, self.turns.attribute,
        )  # fmt: skip
        self.half_blocks = self._listener.assembly.lacking
        """``half_blocks() -> list``: names of blocks of which it has parts, and lacks others."""
        self._signals: tuple[InfluenceSignal, ...] = ()
        self._n_signals_said = 0
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
            if block.is_status:
                self._interests.take_status(block)
                continue
            room_bits = self._room_bits - self._signal_room_bits
            for fragment in fragments_of(block, room_bits, self._codec.fragment_bits):
                entry = Entry(fragment, block.facts, addressed=sum(1 << peer for peer in addressed))
                self._listener.register(entry, block.time_s)
                items.append(fragment)
            self._holders.complete(block.guid)
        return tuple(items)

    def resume(self, now_s: float) -> None:
        """Take up what the world model holds, after a restart with its memory; who holds it is to be learned anew."""
        self._listener.resume(self._room_bits - self._signal_room_bits, self._codec.fragment_bits, now_s)
        self._interests.adopt(self._holders.orphans(), self._state.believes, now_s)
        self._holders.telling.urge()

    def is_of_use(self, facts: Iterable[Stated]) -> bool:
        """True if these facts have an attribute that is exchanged, whoever needs it now."""
        return self._interests.of(PropertyValue(*fact) for fact in facts)[1] > 0

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
        slot = self._schedule.slot_of_arrival(now_s)
        sender, frame = self._schedule.owner(slot), self._schedule.frame_of(slot)
        try:
            head = self._codec.head(data)
            slot = self._schedule.slot_named(self._schedule.place_of(head), head.frame, now_s)
            sender, frame = head.sender, self._schedule.frame_of(slot)
            packet = self._codec.decode(data, frame, self._schedule.base_s(slot))
            self._refuse_other_slot(slot, sender, now_s)
            self._definitions.agree(sender, frame)
            _refuse_future(packet, now_s, self._model)
            _refuse_out_of_range(packet, self._model)
            met = self._peers.meet(sender, packet.epoch, frame)
        except PeerFault as fault:
            self.n_faults += 1
            differs = isinstance(fault, DefinitionFault) and self._definitions.differ(sender, frame)
            is_twin = isinstance(fault, SlotConflict) and self._listener.doubt(sender, frame, now_s)
            return Reception(slot, sender, fault=str(fault), is_stranger=differs, conflict=sender if is_twin else None)
        self._ageing.open(slot)
        is_unlisted = self._schedule.is_by_frame and self.turns.note(packet, slot)
        is_second = self._peers.conflicts(sender, slot, data)
        heard = self._listener.listen(packet, slot, met, is_second, now_s)
        return heard._replace(is_unlisted=True) if is_unlisted else heard

    def _refuse_other_slot(self, slot: int, sender: int, now_s: float) -> None:
        """Refuse a packet that cannot have been sent in the slot that it names, or can no more be heeded."""
        schedule = self._schedule
        if not schedule.may_arrive(slot, now_s, self._model.clock_tolerance_s):
            raise PeerFault(f"a packet of node {sender} of slot {slot} arrives in slot {schedule.slot_at(now_s)}")
        if sender == self._me:
            raise SlotConflict("another speaks as this vehicle")
        self._ageing.refuse(slot, sender, now_s)

    def _own_slot(self, now_s: float) -> int:
        """The slot of this vehicle that opens; raises ConfigurationError if it is that of another."""
        slot = self._schedule.slot_at(now_s)
        if self._schedule.is_aloha:
            slot = self._schedule.frame_of(slot) * self._schedule.n_slots + self._me
        if self._schedule.is_by_frame:
            if slot not in self.turns.slots:
                raise ConfigurationError(f"slot {slot} at {now_s} s is not among those of node {self._me} in its frame")
        elif (owner := self._schedule.owner(slot)) != self._me:
            raise ConfigurationError(f"slot {slot} at {now_s} s belongs to node {owner}, not to node {self._me}")
        return slot

    def give_up(self, guids: Iterable[Guid]) -> None:
        """The world model has forgotten these blocks, so that they may come again: peers are told that they lack."""
        self._holders.give_up(guids)

    def links(self, peer: int) -> PeerLinks:
        """What the links from and to a peer lose, as far as this vehicle can tell."""
        return self._peers.links(peer)

    def renew(self, now_s: float) -> Renewal:
        """Judge all items anew: who needs what has changed."""
        return self._interests.renew(self._state.believes, now_s)

    def keep_silent(self, now_s: float) -> int:
        """Let the own slot that opens at ``now_s`` pass without a packet; returns its number."""
        slot = self._own_slot(now_s)
        self._ageing.open(slot)
        self._signals = ()
        return slot

    def packet_to_send(self, now_s: float, above: float = 0) -> Transmission:
        """The packet for the own slot that opens at ``now_s``.

        Args:
            now_s: the time (s).
            above: only items and statuses of a higher priority go.
        """
        slot = self._own_slot(now_s)
        self._ageing.open(slot)
        self._interests.decide(self._state.believes, now_s)
        signals = self._signals
        frame = self._schedule.frame_of(slot)
        parked = self._peers.speak(frame, self._upkeep.parking)
        if self._ledger.away != self._peers.away:
            self._ledger.away = self._peers.away
            self._listener.settle() if parked else self._listener.reopen(now_s)
        telling, size_of = self._holders.telling, self._codec.summary_bits
        summary = telling.urgent(self._room_bits // SUMMARY_SHARE) if self._upkeep.summaries else ()
        spared_bits = self._codec.header.largest_bits - self._codec.header.size_bits(self._me, frame)
        signals_bits = len(signals) * self._codec.signal_bits
        start_s, room_bits = self._schedule.base_s(slot), self._room_bits + spared_bits - signals_bits
        packing = self._codec.packing(self._me, self._epoch, start_s, room_bits - sum(map(size_of, summary)))
        chosen = self.queue.choose(packing, now_s, above)
        if self._upkeep.summaries and not summary:
            summary = telling.spare(packing.left_bits)
        content = sum([1 << one.column for one in chosen if one.column != STATUS_COLUMN])
        rows = [0] * self._n_nodes
        self._ageing.compose(slot, 0 if self._peers.is_doubted(self._me, frame) else content, rows)
        place, n_turns = slot % self._schedule.n_slots, max(1, len(self.turns.slots))
        head = Head(self._me, self._epoch, frame, place, n_turns)
        data = self._codec.assembled(head, start_s, rows, packing.wired(), signals, summary)
        self._signals = ()
        return Transmission(
            slot,
            data,
            8 * len(data),
            tuple([one.uid for one in chosen if isinstance(one.uid, ItemUid)]),
            self._codec.header.n_set(self._me, rows, frame),
            packing.sizes(),
            signals_bits,
            tuple([one.uid for one in chosen if isinstance(one.uid, StatusUid)]),
            signals,
            summary,
            sum(map(size_of, summary)),
            parked,
        )

    def holds(self, uid: ItemUid) -> bool:
        """True if this vehicle holds the item."""
        return uid in self._ledger or self._holders.own.has((uid.origin, uid.epoch), uid.sequence)

    def believes(self, peer: int, uid: ItemUid) -> bool:
        """True if this vehicle believes that ``peer`` holds the item."""
        column = self._ledger.column(uid)
        return column is not None and bool(self._state.believes[peer] >> column & 1)

    @property
    def n_open(self) -> int:
        """Items that this vehicle goes on sending."""
        return self.queue.open.bit_count()

    def postponed(self) -> Iterator[tuple[int, ItemUid]]:
        """Nodes, and items that they lack though nothing is open: parked peers, and this one what it has given up."""
        return chain(self._interests.postponed(self._state.believes), self._holders.given_up())
