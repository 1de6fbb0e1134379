"""How what was heard ages, so that a node and its peers mean the same packet by the same acknowledgement.

*By slots.* Each node has one slot in each frame, in the order of the nodes. A bit A[i][j] is about j's last packet
before i's last slot, as ``exchange.ack`` has it. What is known of a node ages as its slot opens.

*By frames.* By a slot list a node sends any number of packets in a frame, in any order, and two lists may be in use at
once; in ALOHA nobody knows when who sends. So all nodes sit in one seat: what is known of all ages as a frame begins.
Every bit in a packet of frame f is about frame f - 1: A[i][j] says that i received all packets that j sent in it. A
packet tells how many these are. To `exchange.ack` the frame before is both the last packet and the second-last, so
kinds of acknowledgement need not know; what rows of others say is passed on within the same frame. A vehicle sends
nothing in the frame in which it begins anew, so all its packets of a frame are of one life.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

from exchange import ack
from exchange.ack import Acknowledgement, AckState, MutableWords, Words
from exchange.errors import PeerFault
from exchange.packets import Packet
from exchange.schedule import GRACE_S, TdmaSchedule


class SpokenOf(NamedTuple):
    """What the acknowledgements in a packet are about.

    Attributes:
        lasting: nodes, one bit each, of which the packet is still known that is meant.
        is_asked: the own last packets are.
        frame: of the packets that are meant, where it is the same for all.
    """

    lasting: int
    is_asked: bool
    frame: int | None = None


class Ageing(Protocol):
    """What is known of packets as time goes on."""

    def open(self, slot: int) -> None:
        """Time has come to a slot."""

    def refuse(self, slot: int, sender: int, now_s: float) -> None:
        """Raise PeerFault if a packet of that slot comes when it can no more be heeded, or not yet."""

    def compose(self, slot: int, content: int, rows_out: MutableWords) -> None:
        """Remember what the own packet carries, and write its acknowledgement bits."""

    def spoken_of(self, slot: int) -> SpokenOf:
        """What the acknowledgements in a packet of that slot are about."""

    def absorb(
        self, packet: Packet, slot: int, heeded: Words, content: int, carrier_evidence: bool, origins: Words
    ) -> None:
        """Learn from a packet that was heard.

        Args:
            packet: heard; slot: in which it was sent.
            heeded: its acknowledgement bits that may be believed.
            content: its items.
            carrier_evidence, origins: as ``ack.absorb`` has them.
        """


class BySlots:
    """Ages node by node.

    Args:
        me: own node index.
        schedule: in which every node has one slot.
        state: acknowledgement state of this node.
        kind: acknowledgement of the policy.
    """

    def __init__(self, me: int, schedule: TdmaSchedule, state: AckState, kind: Acknowledgement) -> None:
        self._me, self._n_nodes = me, schedule.n_nodes
        self._schedule, self._state, self._kind = schedule, state, kind
        self._next_slot = 0  # first slot that has not been opened
        self._sent_slot: int | None = None

    def open(self, slot: int) -> None:
        """See `Ageing`."""
        for k in range(self._next_slot, slot + 1):
            ack.open_slot(self._kind, self._state, self._n_nodes, k % self._n_nodes)
        self._next_slot = max(self._next_slot, slot + 1)

    def refuse(self, slot: int, sender: int, now_s: float) -> None:
        """See `Ageing`."""
        if slot + self._n_nodes < self._next_slot:
            raise PeerFault(f"a packet of node {sender} of slot {slot} arrives when its next slot is open")
        own = slot - (slot - self._me) % self._n_nodes  # the last own slot before it
        if own >= self._next_slot and self._schedule.start_s(own) > now_s:
            raise PeerFault(f"a packet of slot {slot} arrives before the own slot {own} is open")

    def compose(self, slot: int, content: int, rows_out: MutableWords) -> None:
        """See `Ageing`."""
        self._sent_slot = slot
        ack.compose(self._kind, self._state, self._n_nodes, slot // self._n_nodes, self._me, (content,), rows_out)

    def spoken_of(self, slot: int) -> SpokenOf:
        """Of who has had a slot since a packet that comes late, the last packet is another than it speaks of."""
        lasting = ~sum(1 << one % self._n_nodes for one in range(slot + 1, self._next_slot))
        return SpokenOf(lasting, self._sent_slot is not None and 0 < slot - self._sent_slot < self._n_nodes)

    def absorb(
        self, packet: Packet, slot: int, heeded: Words, content: int, carrier_evidence: bool, origins: Words
    ) -> None:
        """See `Ageing`."""
        n_nodes, sender, known = self._n_nodes, packet.sender, ((content,), origins)
        frame = slot // n_nodes
        ack.absorb(self._kind, carrier_evidence, self._state, n_nodes, frame, self._me, sender, heeded, *known)


class _Sent(NamedTuple):
    """What was heard of a node in a frame: in which life it sends how many packets, and in which slots it was heard."""

    epoch: int
    n_turns: int
    slots: frozenset[int]


class ByFrames:
    """Ages all nodes at once.

    Args:
        me: own node index.
        schedule: of the frames.
        state: acknowledgement state of this node, about the frame before.
        coming: of the same size; becomes the state of what is heard in this frame.
        kind: acknowledgement of the policy.
    """

    def __init__(
        self,
        me: int,
        schedule: TdmaSchedule,
        state: AckState,
        coming: AckState,
        kind: Acknowledgement,
    ) -> None:
        self._me, self._n_nodes = me, schedule.n_nodes
        self._schedule, self._state, self._coming = schedule, state, coming
        self._kind = kind
        self._frame = -1
        self._sent_frame: int | None = None
        self._sent: dict[int, _Sent] = {}

    def open(self, slot: int) -> None:
        """See `Ageing`."""
        frame, state, coming, n_nodes = self._schedule.frame_of(slot), self._state, self._coming, self._n_nodes
        if frame <= self._frame:
            return
        whole = coming.heard[0] | 1 << self._me if frame == self._frame + 1 else 0
        for node in range(n_nodes):
            state.content[node] = state.content[n_nodes + node] = coming.content[node] & ack.all_if(whole >> node)
            coming.content[node] = 0
        for at in range(n_nodes * n_nodes):
            state.held[at] = 0
        state.heard[0], coming.heard[0] = whole & ~(1 << self._me), 0
        self._sent = {}
        self._frame = frame

    def refuse(self, slot: int, sender: int, now_s: float) -> None:
        """See `Ageing`."""
        frame = self._schedule.frame_of(slot)
        if frame + 1 < self._frame:
            raise PeerFault(f"a packet of node {sender} of frame {frame} arrives in frame {self._frame}")
        if self._schedule.frame_start_s(frame) > now_s + GRACE_S:
            raise PeerFault(f"a packet of node {sender} of frame {frame} arrives before that begins")

    def compose(self, slot: int, content: int, rows_out: MutableWords) -> None:
        """See `Ageing`."""
        n_nodes, state = self._n_nodes, self._state
        self._sent_frame = self._frame
        self._coming.content[self._me] |= content
        self._kind.compose(state, n_nodes, self._frame % self._kind.period_frames, self._me, rows_out)
        for i in range(n_nodes):
            if i != self._me:
                for k in range(n_nodes):
                    rows_out[i] |= state.held[k * n_nodes + i]

    def spoken_of(self, slot: int) -> SpokenOf:
        """What a packet of the frame before acknowledges is no more known."""
        frame = self._schedule.frame_of(slot)
        is_late = frame < self._frame
        return SpokenOf(0 if is_late else -1, not is_late and self._sent_frame == frame - 1, frame - 1)

    def absorb(
        self, packet: Packet, slot: int, heeded: Words, content: int, carrier_evidence: bool, origins: Words
    ) -> None:
        """See `Ageing`; a packet of the frame before is not acknowledged."""
        n_nodes, state, sender = self._n_nodes, self._state, packet.sender
        frame = self._schedule.frame_of(slot)
        state.believes[self._me] |= content
        if carrier_evidence:
            state.believes[sender] |= content
        for i in range(n_nodes):
            state.believes[i] |= content & origins[i]
        if frame == self._frame:
            self._note(packet, slot, content)
            self._kind.learn(state, n_nodes, frame % self._kind.period_frames, sender, heeded)

    def _note(self, packet: Packet, slot: int, content: int) -> None:
        """Keep what a packet of this frame carries, and see whether all of its sender were heard."""
        sender, coming = packet.sender, self._coming
        known = self._sent.get(sender)
        if known is None or known[:2] != (packet.epoch, packet.n_turns):
            known = _Sent(packet.epoch, packet.n_turns, frozenset())
            coming.content[sender] = 0
        self._sent[sender] = known = known._replace(slots=known.slots | {slot})
        coming.content[sender] |= content
        is_whole = len(known.slots) == known.n_turns
        coming.heard[0] = coming.heard[0] & ~(1 << sender) | is_whole << sender


def ageing_of(me: int, schedule: TdmaSchedule, states: tuple[AckState, AckState], kind: Acknowledgement) -> Ageing:
    """By slots where each node has its own, in their order; else by frames.

    Args:
        me: own node index.
        schedule: the same at every vehicle.
        states: acknowledgement state of this node, and one of what is still to age.
        kind: acknowledgement of the policy.
    """
    if schedule.is_by_frame:
        return ByFrames(me, schedule, *states, kind)
    return BySlots(me, schedule, states[0], kind)
