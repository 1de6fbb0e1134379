"""The Data Exchange Manager of one vehicle: what to say in a slot, what to make of what was heard.

Sans-io: bits and ``now_s`` go in; bits and frozen values come out. It reads no clock, draws no random numbers and
calls nobody back.

The slot of the cooperation paper (section IV, "Selecting information to be shared"), step by step:
``interests`` asks who needs an item (1, 2); new candidates enter through ``offer`` and acknowledgement
timers are one frame, so every item sent in the last frame is a candidate again (3); items that all
interested peers are believed to hold are dropped (4); ``selection.select`` raises weights, sorts and
fills the packet (5, 6, 7). Who is believed to hold what, and until when an item is sent, is the business of ``ack``;
who sends it that of the policy.

Two kinds of information are told apart by the TBox. An attribute of which only the latest value
matters (a vehicle's position) is a *status*: its newest value waits in the same weighted queue, is said once
and never acknowledged; the paper tolerates its loss. Everything else is an item and is repeated until it
is acknowledged.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from exchange import ack
from exchange.blocks import Assembly, fragments_of, whole
from exchange.codec import MAX_FRAGMENTS_PER_PACKET, MAX_SIGNALS, Codec
from exchange.definitions import Definitions
from exchange.errors import ConfigurationError, DefinitionFault, PeerFault
from exchange.interests import Interests, Renewal
from exchange.ledger import Entry, Ledger
from exchange.packets import Fragment, InfluenceSignal, ItemUid, Packet, StatusUid
from exchange.policies import AckPolicy, may_send
from exchange.schedule import TdmaSchedule
from exchange.selection import select
from worldmodel import Block, Change, Needs, PropertyValue, Stated, WorldModel

SIGNAL_SHARE = 4
"""A packet keeps one part in this many for influence signals; fragments are cut to fit the rest."""


@dataclass(slots=True)
class LatestValue:
    """The newest value of an attribute of which only the latest matters; ``fragment`` is None once it is said."""

    priority: int
    weight: int = 0
    fragment: Fragment | None = None
    bits: int = 0
    size_bits: int = 0


@dataclass(frozen=True, slots=True)
class Transmission:
    """What a vehicle says in one slot, and what it decided in doing so.

    ``items`` are repeated until they are acknowledged, ``status`` are said this once. ``fragments`` has (attribute of
    the first fact, size_bits) of each of both; the rest of ``size_bits`` beside ``signals_bits`` is the header.
    """

    slot: int
    data: bytes
    size_bits: int
    items: tuple[ItemUid, ...]
    n_acks: int
    fragments: tuple[tuple[int, int], ...] = ()
    signals_bits: int = 0
    status: tuple[StatusUid, ...] = ()
    signals: tuple[InfluenceSignal, ...] = ()


class Reception(NamedTuple):
    """What one packet brought.

    ``blocks`` are whole and new to this vehicle, or contradict what it has under the same name, ready to be merged;
    ``signals`` are the influence signals of ``sender``; ``beliefs`` lists (peer, item) pairs that are believed from
    now on; ``settled`` lists items that all interested peers are now believed to hold; ``aside`` are those whose
    block this vehicle has no need of, which are not among ``items``; ``fault`` tells why a packet was refused, else
    None; ``is_stranger`` if that makes its sender one of another definition.
    """

    slot: int
    sender: int
    blocks: tuple[Block, ...] = ()
    signals: tuple[InfluenceSignal, ...] = ()
    items: tuple[ItemUid, ...] = ()
    beliefs: tuple[tuple[int, ItemUid], ...] = ()
    settled: tuple[ItemUid, ...] = ()
    aside: tuple[Fragment, ...] = ()
    fault: str | None = None
    is_stranger: bool = False


def heaviest(queue: Sequence[Entry | LatestValue], room_bits: int) -> list[int]:
    """Positions of the candidates that go into the packet; the weights of all are brought up to date."""
    weights = [candidate.weight for candidate in queue]
    chosen = [0] * len(queue)
    n_chosen = select(
        weights,
        [candidate.priority for candidate in queue],
        [candidate.size_bits for candidate in queue],
        [1] * len(queue),
        room_bits,
        chosen,
    )
    for position in chosen[MAX_FRAGMENTS_PER_PACKET:n_chosen]:  # there is no room for their number
        weights[position] = queue[position].weight + queue[position].priority
    for candidate, weight in zip(queue, weights, strict=True):
        candidate.weight = weight
    return chosen[: min(n_chosen, MAX_FRAGMENTS_PER_PACKET)]


def _refuse_future(packet: Packet, now_s: float, model: WorldModel) -> None:
    """Refuse a packet with a fact that was observed later than it arrives: it was damaged, or a clock is wrong."""
    latest_s = model.latest_time_s(now_s)
    for fragment in packet.fragments:
        if fragment.time_s > latest_s:
            raise PeerFault(
                f"a fact of {fragment.time_s:g} s arrives at {now_s:g} s: from the future, beyond a clock "
                f"tolerance of {model.clock_tolerance_s:g} s"
            )


def _contradiction(fragment: Fragment, ledger: Ledger, assembly: Assembly) -> Block | None:
    """The block by which a known item has other content than before, if it has and the block is whole."""
    known = ledger.fragment(fragment.uid)
    if known is None or known == fragment:
        return None
    if fragment.count != known.count:
        return assembly.add(fragment)
    found = [ledger.fragment(fragment.uid._replace(part=part)) for part in range(fragment.count)]
    found[fragment.index] = fragment
    parts = [part for part in found if part is not None]
    return whole(parts)._replace(time_s=fragment.time_s) if len(parts) == fragment.count else None


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
    ) -> None:
        self._me = me
        self._model = model
        self._epoch = model.epoch
        self._definitions = Definitions()
        self._codec = codec
        self._schedule = schedule
        self._kind = policy.acknowledgement
        self._repeat = policy.repeat
        self._carrier_evidence = carrier_evidence
        self._room_bits = payload_bits - codec.overhead_bits
        self._signal_room_bits = max(codec.signal_bits, self._room_bits // SIGNAL_SHARE)
        if self._room_bits < 2 * codec.signal_bits:
            raise ConfigurationError(
                f"a packet of {payload_bits} bits has no room behind the header of {codec.overhead_bits} bits "
                f"that policy {policy.name} needs for {schedule.n_nodes} nodes"
            )
        self._n_nodes = schedule.n_nodes
        self._state = ack.new_state(self._n_nodes)
        self._ledger = Ledger(self._n_nodes)
        self._interests = Interests(me, model, needs, self._ledger, codec, selective)
        self._assembly = Assembly()
        self._status: dict[tuple[int, int], LatestValue] = {}  # by (subject, attribute)
        self._signals: tuple[InfluenceSignal, ...] = ()
        self._n_signals_said = 0
        self._next_slot = 0  # first slot that has not been opened
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
                self._take_status(block)
                continue
            room_bits = self._room_bits - self._signal_room_bits
            for fragment in fragments_of(block, room_bits, self._codec.fragment_bits):
                self._register(Entry(fragment, block.facts, addressed=sum(1 << peer for peer in addressed)))
                items.append(fragment)
        return tuple(items)

    def is_of_use(self, facts: Iterable[Stated]) -> bool:
        """True if these facts have an attribute that is exchanged, whoever needs it now."""
        return self._interests.of(PropertyValue(*fact) for fact in facts)[1] > 0

    def fits(self, facts: Iterable[Stated]) -> bool:
        """True if a block of these facts would go into one packet, beside influence signals."""
        whole = Fragment(self._me, 0, 0.0, tuple(PropertyValue(*fact) for fact in facts))
        return self._codec.fragment_bits(whole) <= self._room_bits - self._signal_room_bits

    def _take_status(self, block: Block) -> None:
        fragment = Fragment(block.origin, block.sequence, block.time_s, block.facts, epoch=block.epoch)
        key = block.facts[0].subject, block.facts[0].attribute
        interested, priority = self._interests.of_others(block.facts)
        if not interested:
            self._status.pop(key, None)
            return
        status = self._status.setdefault(key, LatestValue(priority))
        status.fragment = fragment
        status.bits, status.size_bits = self._codec.encode_fragment(fragment, self._me, self._epoch)

    def offer_signals(self, signals: Sequence[InfluenceSignal]) -> None:
        """Influence signals for the next own slot; those of an earlier call are forgotten.

        Of more than fit, a part is said, another one in the next slot.
        """
        most = min(MAX_SIGNALS, self._signal_room_bits // self._codec.signal_bits)
        first = self._n_signals_said % len(signals) if len(signals) > most else 0
        self._signals = (*signals[first:], *signals[:first])[:most]
        self._n_signals_said += len(self._signals)

    def receive(self, data: bytes, now_s: float) -> Reception:
        """Take in a packet that arrives at ``now_s``; a bad one is counted, never raised, nor acknowledged."""
        slot = self._schedule.slot_of_arrival(now_s)
        sender, frame = self._schedule.owner(slot), self._frame(slot)
        self._open_slots_through(slot)
        try:
            if sender == self._me:
                raise PeerFault("a packet in this vehicle's own slot")
            packet = self._codec.decode(data, frame)
            if packet.sender != sender:
                raise PeerFault(f"node {packet.sender} speaks in the slot of node {sender}")
            self._definitions.agree(sender, frame)
            _refuse_future(packet, now_s, self._model)
        except PeerFault as fault:
            self.n_faults += 1
            is_stranger = isinstance(fault, DefinitionFault) and self._definitions.differ(sender, frame)
            return Reception(slot, sender, fault=str(fault), is_stranger=is_stranger)
        return self._absorb(packet, slot)

    def _absorb(self, packet: Packet, slot: int) -> Reception:
        blocks: list[Block] = []
        content = 0
        new_items: list[ItemUid] = []
        aside: list[Fragment] = []
        for fragment in packet.fragments:
            if fragment.is_status:
                blocks.append(fragment.block)
                continue
            column = self._ledger.column(fragment.uid)
            if column is None:
                column = self._register(Entry(fragment, fragment.facts))
                block = self._assembly.add(fragment)
                if block is not None and not self._interests.keeps(block, fragment.uid):
                    aside.append(fragment)
                    block = None
                else:
                    new_items.append(fragment.uid)
                if block is not None:
                    blocks.append(block)
            elif (other := _contradiction(fragment, self._ledger, self._assembly)) is not None:
                is_in = self._model.arrived(other.guid) is not None
                blocks += [other] if is_in or self._interests.keeps(other, fragment.uid) else []
            content |= 1 << column
        state = self._state
        before = [state.believes[peer] for peer in range(self._n_nodes)]
        frame, origins = self._frame(slot), self._ledger.origins
        ack.absorb(
            self._kind, self._carrier_evidence, state, self._n_nodes, frame, self._me, packet.sender, packet.rows,
            (content,), origins,
        )  # fmt: skip
        beliefs = tuple(
            (peer, uid)
            for peer in range(self._n_nodes)
            if peer != self._me and (gained := state.believes[peer] & ~before[peer])
            for uid in self._ledger.uids(gained)
        )
        settled: tuple[ItemUid, ...] = ()
        if beliefs:
            done = ack.settled(state, self._n_nodes, self._ledger.unneeded, 0)
            settled = self._interests.settle(done, state.believes)
        new, unneeded = tuple(new_items), tuple(aside)
        return Reception(slot, packet.sender, tuple(blocks), packet.signals, new, beliefs, settled, unneeded)

    def renew(self) -> Renewal:
        """Judge all items anew: who needs what has changed."""
        return self._interests.renew(self._state.believes)

    def packet_to_send(self, now_s: float) -> Transmission:
        """The packet for the own slot that opens at ``now_s``."""
        slot = self._schedule.slot_at(now_s)
        if self._schedule.owner(slot) != self._me:
            owner = self._schedule.owner(slot)
            raise ConfigurationError(f"slot {slot} at {now_s} s belongs to node {owner}, not to node {self._me}")
        self._open_slots_through(slot)
        signals = self._signals
        frame = self._frame(slot)
        spared_bits = self._codec.header.largest_bits - self._codec.header.size_bits(self._me, frame)
        signals_bits = len(signals) * self._codec.signal_bits
        columns, said = self._choose(self._room_bits + spared_bits - signals_bits)
        content = sum(1 << column for column in columns)
        items = tuple(self._ledger.uid(column) for column in columns)
        rows = [0] * self._n_nodes
        ack.compose(self._kind, self._state, self._n_nodes, frame, self._me, (content,), rows)
        wire = [(bits, size_bits) for _, bits, size_bits in said]
        data = self._codec.encode(self._me, rows, wire, signals, frame, self._epoch)
        self._signals = ()
        return Transmission(
            slot,
            data,
            8 * len(data),
            items,
            self._codec.header.n_set(self._me, rows, frame),
            tuple((fragment.facts[0].attribute, size_bits) for fragment, _, size_bits in said),
            signals_bits,
            tuple(fragment.status_uid for fragment, _, _ in said if fragment.is_status),
            signals,
        )

    def _choose(self, room_bits: int) -> tuple[list[int], list[tuple[Fragment, int, int]]]:
        """By the weighted queue: columns of the items; of all that is said, status too, its wire form (bits, size)."""
        queue: list[Entry | LatestValue] = [self._ledger.entries[column] for column in self._interests.open]
        queue += [status for status in self._status.values() if status.fragment is not None]
        columns: list[int] = []
        said: list[tuple[Fragment, int, int]] = []
        for position in heaviest(queue, room_bits):
            candidate = queue[position]
            if candidate.fragment is not None:
                said.append((candidate.fragment, candidate.bits, candidate.size_bits))
            if isinstance(candidate, LatestValue):
                candidate.fragment = None
            else:
                columns.append(self._interests.open[position])
        return columns, said

    def holds(self, uid: ItemUid) -> bool:
        """True if this vehicle holds the item."""
        return uid in self._ledger

    def believes(self, peer: int, uid: ItemUid) -> bool:
        """True if this vehicle believes that ``peer`` holds the item."""
        column = self._ledger.column(uid)
        return column is not None and bool(self._state.believes[peer] >> column & 1)

    @property
    def n_open(self) -> int:
        """Items that this vehicle goes on sending."""
        return len(self._interests.open)

    def _register(self, entry: Entry) -> int:
        column = self._ledger.add(entry)
        item = 1 << column
        self._state.believes[self._me] |= item
        if may_send(self._repeat, item, self._ledger.origins[self._me]):
            self._interests.take(column)
        return column

    def _frame(self, slot: int) -> int:
        """Number of the TDMA frame of a slot."""
        return slot // self._n_nodes

    def _open_slots_through(self, slot: int) -> None:
        for k in range(self._next_slot, slot + 1):
            ack.open_slot(self._kind, self._state, self._n_nodes, k % self._n_nodes)
        self._next_slot = max(self._next_slot, slot + 1)
