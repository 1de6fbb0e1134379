"""The peers of one vehicle: which life each is in, who is away, what its links lose, and whose word is doubted.

*Lives.* A vehicle that begins anew has a higher epoch. What was believed of it is void when that epoch is heard. A
third vehicle may not have heard of it and state by its matrix what the old life held. So of rows about a peer that
began anew only those are heeded whose senders are known to have heard the new epoch. They say so by the bit in their
own row for the peer's last packet: at that time its epoch was not lower than the one known here. What such a vehicle
states rests, in turn, on rows that it heeded by the same rule. An older epoch is refused; if it comes twice running,
the newer one was damage.

*Absence.* A peer that is silent for longer than loss explains is parked: what it needs is not waited for. It is heard
again, and catches up.

*Two in one slot.* Who hears two packets of one sender and slot, or itself hears a packet in its own name, cannot tell
what an acknowledgement of that name means. It neither gives nor heeds any until the doubt has lasted for some frames.
Nor does it believe any longer what it has believed of anybody: others may have acknowledged the one packet while it
held the other for it. And of matrices it heeds until then only what senders say of themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from exchange.ack import Acknowledgement, AckState
from exchange.errors import PeerFault
from exchange.links import Estimate, PeerLinks
from exchange.packets import Met, Packet

DOUBT_FRAMES = 16
"""Frames after the last sign of two vehicles in one slot before their name is trusted again."""
REPEATED_EPOCHS = 2
"""Packets in a row of an older epoch after which the newer one is taken for damage."""


class Upkeep(NamedTuple):
    """What a vehicle does beyond the policies of the paper.

    Attributes:
        summaries: it tells summary vectors.
        parking: it does not wait for what peers need that are silent for too long.
    """

    summaries: bool = True
    parking: bool = True


USUAL_UPKEEP = Upkeep()


class Heard(NamedTuple):
    """The packet heard last of a peer: its slot and its bytes."""

    slot: int
    data: bytes


class Peers:
    """What one node knows of the others beside what they hold.

    Args:
        me: own node index.
        n_nodes: size of the fleet.
        states: acknowledgement states of this node, of which is taken back what has become void.
        kind: acknowledgement of the policy, which says when a peer answers.
    """

    def __init__(self, me: int, n_nodes: int, states: Sequence[AckState], kind: Acknowledgement) -> None:
        self._me = me
        self._n_nodes = n_nodes
        self._states = states
        self._answers = kind.carries
        self._period_frames = kind.period_frames
        self.epochs = [0] * n_nodes
        """The newest epoch heard of each node."""
        self.away = 0
        """Nodes that are parked, one bit each."""
        self._informed = [(1 << n_nodes) - 1] * n_nodes  # who is known to have heard that epoch
        self._older = [(0, 0)] * n_nodes  # an older epoch heard since, and how often in a row
        self._heard: list[Heard | None] = [None] * n_nodes
        self._heard_frame: list[int | None] = [None] * n_nodes
        self._incoming = [Estimate() for _ in range(n_nodes)]
        self._outgoing = [Estimate() for _ in range(n_nodes)]
        self._doubted_until = [-1] * n_nodes  # frame
        self._since_frame: int | None = None
        self._is_alone = False
        self._begun_frame = [-1] * n_nodes  # in which that epoch was heard first
        self._frame = -1  # of the packet heard last

    def links(self, peer: int) -> PeerLinks:
        """What the links from and to a peer lose."""
        return PeerLinks(self._incoming[peer].link, self._outgoing[peer].link)

    # Hearing -------------------------------------------------------------------------------------

    def meet(self, sender: int, epoch: int, frame: int) -> Met:
        """See who speaks, and in which life.

        Args:
            sender: of the packet.
            epoch: that it states.
            frame: TDMA frame of its slot.

        Raises:
            PeerFault: it is of an earlier life.
        """
        known, self._frame = self.epochs[sender], frame
        if epoch < known:
            before, n_before = self._older[sender]
            n_now = n_before + 1 if before == epoch else 1
            self._older[sender] = epoch, n_now
            if n_now < REPEATED_EPOCHS:
                raise PeerFault(f"node {sender} in its epoch {epoch}, after its epoch {known}")
        self._older[sender] = 0, 0
        is_back = self._note_frame(sender, frame)
        if epoch != known:
            return Met.NEW_LIFE
        return Met.BACK if is_back else Met.USUAL

    def begin(self, node: int, epoch: int) -> None:
        """A node is in another life: nothing is believed of it."""
        self.epochs[node] = epoch
        self._begun_frame[node] = self._frame
        self._informed[node] = 1 << node | 1 << self._me
        self.forget(node)

    def _note_frame(self, sender: int, frame: int) -> bool:
        """Count what was missed since the last packet; True if the sender was away."""
        last, self._heard_frame[sender] = self._heard_frame[sender], frame
        incoming = self._incoming[sender]
        if last is None:
            incoming.add(0, 1)
        elif frame > last:
            n_missed = frame - last - 1
            incoming.add(n_missed if n_missed <= 2 * incoming.longest_silence else 0, 1)
        was_away = self._is_alone or bool(self.away >> sender & 1)
        self.away &= ~(1 << sender)
        self._is_alone = False
        return was_away

    def heed(
        self, packet: Packet, frame: int, lasting: int, is_asked: bool, about: int | None = None
    ) -> tuple[int, ...]:
        """The acknowledgement bits of a packet that may be believed; the others are taken out.

        Args:
            packet: received.
            frame: TDMA frame of its slot.
            lasting: nodes of which the packet is known that the bits are about.
            is_asked: the packet speaks of the own last packets.
            about: frame that the bits are about, where it is the same for all.
        """
        sender, own = packet.sender, packet.rows[packet.sender]
        for node in range(self._n_nodes):
            if own >> node & 1 and (about is None or self._begun_frame[node] <= about):
                self._informed[node] |= 1 << sender
        if lasting >> self._me & 1 and self._answers(
            self._n_nodes, frame % self._period_frames, sender, sender, self._me
        ):
            self._count_answer(sender, bool(own >> self._me & 1), is_asked)
        heeded = 1 << sender
        if frame > max(self._doubted_until):
            heeded |= sum(1 << node for node, informed in enumerate(self._informed) if informed >> sender & 1)
        return tuple(row & lasting if heeded >> node & 1 else 0 for node, row in enumerate(packet.rows))

    def _count_answer(self, sender: int, is_received: bool, is_asked: bool) -> None:
        """Count whether a peer says that it received the own packet of the frame before its slot."""
        if is_asked:
            self._outgoing[sender].add(*((0, 1) if is_received else (1, 0)))

    # Absence -------------------------------------------------------------------------------------

    def speak(self, frame: int, parks: bool = True) -> tuple[int, ...]:
        """The own slot opens; return the peers that are parked from now on.

        Of whom nobody is heard, the silence says that this vehicle is deaf or far away: it parks none.

        Args:
            frame: TDMA frame of the slot.
            parks: False if none is ever parked.
        """
        if self._since_frame is None:
            self._since_frame = frame
        parked = tuple(
            node
            for node in range(self._n_nodes)
            if parks
            and node != self._me
            and not self.away >> node & 1
            and frame - (self._heard_frame[node] or self._since_frame) > self._incoming[node].longest_silence
        )
        self.away |= sum(1 << node for node in parked)
        if self._n_nodes > 1 and self.away == (1 << self._n_nodes) - 1 & ~(1 << self._me):
            self.away, self._is_alone = 0, True
            self._heard_frame = [frame] * self._n_nodes
            return ()
        return parked

    # Two in one slot -----------------------------------------------------------------------------

    def is_doubted(self, node: int, frame: int) -> bool:
        """True while two vehicles may speak under the name of a node."""
        return frame <= self._doubted_until[node]

    def conflicts(self, sender: int, slot: int, data: bytes) -> bool:
        """True if another packet of this sender was heard in the same slot; the packet is kept to compare the next."""
        last, self._heard[sender] = self._heard[sender], Heard(slot, data)
        return last is not None and last.slot == slot and last.data != data

    def doubt(self, node: int, frame: int) -> bool:
        """Two vehicles speak under the name of a node; True if it was not doubted before."""
        is_new = not self.is_doubted(node, frame)
        self._doubted_until[node] = frame + DOUBT_FRAMES
        for peer in range(self._n_nodes) if is_new or node == self._me else (node,):
            if peer != self._me:
                self.forget(peer)
        if node == self._me:
            self._forget_content(self._me)
        return is_new

    # Taking back ---------------------------------------------------------------------------------

    def forget(self, node: int) -> None:
        """Believe nothing of what a node holds or has heard."""
        n_nodes = self._n_nodes
        for state in self._states:
            state.believes[node] = 0
            for row in range(n_nodes):
                state.held[node * n_nodes + row] = 0
                state.held[row * n_nodes + node] = 0
            state.heard[0] &= ~(1 << node)
        self._forget_content(node)

    def _forget_content(self, node: int) -> None:
        for state in self._states:
            state.content[node] = state.content[self._n_nodes + node] = 0
