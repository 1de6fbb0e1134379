"""Whose turn it is by the slot list that a vehicle has heard of, and how one that has no slot finds one.

A slot list says for each vehicle in which slots of a frame it sends, as a bit mask: bit p for slot p. It is one block
of facts, one for each vehicle, so it goes in whole; of two lists the newer block counts, as with any fact. A vehicle
looks at its list when a frame begins, and keeps to that for the frame.

A slot that no vehicle has is free. Who has none listens for a whole frame, and then takes the first free slot in which
it heard nobody. It gives that up if for `PATIENCE_FRAMES` frames it hears others and nobody says that it was heard: so
two find out who take one slot at once. Each then waits for a time of its own before it listens again.

By a slot list a node sends any number of packets in a frame, in any order, and two lists may be in use at once; in
ALOHA nobody knows when who sends. So all nodes sit in one seat: what is known of all ages as a frame begins
(`ByFrames`). Every bit in a packet of frame f is about frame f - 1: A[i][j] says that i received all packets that j
sent in it. A packet tells how many these are. To `exchange.ack` the frame before is both the last packet and the
second-last, so kinds of acknowledgement need not know; what rows of others say is passed on within the same frame. A
vehicle sends nothing in the frame in which it begins anew, so all its packets of a frame are of one life.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

from exchange.ack import Acknowledgement, AckState, MutableWords, Words
from exchange.errors import ConfigurationError, PeerFault
from exchange.packets import Packet
from exchange.peering.peers import SpokenOf
from exchange.schedule import GRACE_S, TdmaSchedule
from worldmodel import WorldModel

SENDS_IN = "sendsInSlots"
"""Name of the attribute of vehicles; an ontology without it has no other slot list than that of the schedule."""
MAX_SLOTS = 32
"""Most slots of a listed frame."""
PATIENCE_FRAMES = 4
"""Frames without an acknowledgement after which a slot that was found is given up."""


def masks_of(slots: Sequence[Sequence[int]], n_nodes: int) -> tuple[int, ...]:
    """The slots of each node as bit masks, of the nodes of each slot.

    >>> masks_of([[0], [1], [0, 2]], 3)
    (5, 2, 4)
    """
    return tuple(sum(1 << place for place, nodes in enumerate(slots) if node in nodes) for node in range(n_nodes))


class Turns:
    """The turns of one vehicle.

    Args:
        me: own node index.
        schedule: with the list that was agreed.
        model: own world model, read only: the newest list.
    """

    def __init__(self, me: int, schedule: TdmaSchedule, model: WorldModel) -> None:
        self._me, self._schedule, self._model = me, schedule, model
        self._agreed = masks_of(schedule.slots, schedule.n_nodes)
        self.attribute = next(
            (attribute.uid for attribute in model.tbox.attributes if attribute.name == SENDS_IN), None
        )
        """Uid of the attribute of slot lists; None where none is told."""
        self._masks = self._agreed
        self.frame = -1
        """The frame that was begun last."""
        self.slots: tuple[int, ...] = ()
        """Own slots of that frame."""
        self._listens_from: int | None = None
        self._found: int | None = None  # place that was taken
        self._heard = 0  # places in which others were heard in this frame
        self._is_answered = False
        self._n_unanswered = 0

    def begin(self, frame: int, is_there: bool) -> tuple[int, ...]:
        """A frame begins; return the own slots in it.

        Args:
            frame: its number.
            is_there: False while the vehicle is away, and so hears nobody.
        """
        first = frame * self._schedule.n_slots
        if self._schedule.is_aloha:
            self.slots = (first + self._me,)
        else:
            self._masks = self._newest()
            mask = self._masks[self._me] or self._find(frame, is_there)
            self.slots = tuple(first + place for place in range(self._schedule.n_slots) if mask >> place & 1)
        self.frame, self._heard, self._is_answered = frame, 0, False
        return self.slots

    def own_slot(self, slot: int, now_s: float) -> int:
        """The own slot that opens, of which ``slot`` is the number by the time; ConfigurationError if it is none."""
        if self._schedule.is_aloha:
            slot = self._schedule.frame_of(slot) * self._schedule.n_slots + self._me
        if slot not in self.slots:
            raise ConfigurationError(f"slot {slot} at {now_s} s is not among those of node {self._me} in its frame")
        return slot

    def note(self, packet: Packet, slot: int) -> bool:
        """Note who was heard; True if by the list in use here the slot is that of others than its sender."""
        if self._schedule.is_aloha:
            return False
        place = slot % self._schedule.n_slots
        if self._schedule.frame_of(slot) == self.frame:
            self._heard |= 1 << place
            self._is_answered |= bool(packet.rows[packet.sender] >> self._me & 1)
        listed = self._masks[packet.sender]
        return not listed >> place & 1 and bool(listed or not self._free >> place & 1)

    @property
    def _free(self) -> int:
        """Places that no vehicle has by the list."""
        taken = 0
        for mask in self._masks:
            taken |= mask
        return ~taken & (1 << self._schedule.n_slots) - 1

    def _newest(self) -> tuple[int, ...]:
        """The newest list that has been heard of: each of its facts is the latest of its vehicle."""
        if self.attribute is None:
            return self._agreed
        told = [self._model.value(node, self.attribute) for node in range(self._schedule.n_nodes)]
        return tuple(
            agreed if mask is None else int(cast(float, mask)) for mask, agreed in zip(told, self._agreed, strict=True)
        )

    def _find(self, frame: int, is_there: bool) -> int:
        """The mask of the place that a vehicle without a slot has found; 0 while it listens."""
        if not is_there:
            self._found = self._listens_from = None
            return 0
        if self._found is not None and not self._free >> self._found & 1:
            self._found = self._listens_from = None
        if self._found is not None:
            self._n_unanswered = self._n_unanswered + 1 if self._heard and not self._is_answered else 0
            if self._n_unanswered >= PATIENCE_FRAMES:
                without = [node for node, mask in enumerate(self._masks) if not mask]
                self._found, self._listens_from = None, frame + without.index(self._me)
        elif self._listens_from is None:
            self._listens_from = frame
        elif frame > self._listens_from:
            silent = self._free & ~self._heard
            self._found = (silent & -silent).bit_length() - 1 if silent else None
            self._n_unanswered = 0
        return 0 if self._found is None else 1 << self._found


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
        """See `exchange.peering.peers.Ageing`."""
        frame, state, coming, n_nodes = self._schedule.frame_of(slot), self._state, self._coming, self._n_nodes
        if frame <= self._frame:
            return
        whole = coming.heard[0] | 1 << self._me if frame == self._frame + 1 else 0
        for node in range(n_nodes):
            state.content[node] = state.content[n_nodes + node] = coming.content[node] & -(whole >> node & 1)
            coming.content[node] = 0
        for at in range(n_nodes * n_nodes):
            state.held[at] = 0
        state.heard[0], coming.heard[0] = whole & ~(1 << self._me), 0
        self._sent = {}
        self._frame = frame

    def refuse(self, slot: int, sender: int, now_s: float) -> None:
        """See `exchange.peering.peers.Ageing`."""
        frame = self._schedule.frame_of(slot)
        if frame + 1 < self._frame:
            raise PeerFault(f"a packet of node {sender} of frame {frame} arrives in frame {self._frame}")
        if self._schedule.frame_start_s(frame) > now_s + GRACE_S:
            raise PeerFault(f"a packet of node {sender} of frame {frame} arrives before that begins")

    def compose(self, slot: int, content: int, rows_out: MutableWords) -> None:
        """See `exchange.peering.peers.Ageing`."""
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
        """See `exchange.peering.peers.Ageing`; a packet of the frame before is not acknowledged."""
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
