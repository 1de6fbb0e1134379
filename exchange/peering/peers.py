"""The peers of one vehicle: what their packets acknowledge, which life each is in, what its links lose.

*Ageing.* Each node has one slot in each frame, in the order of the nodes. A bit A[i][j] is about j's last packet before
i's last slot, as ``exchange.ack`` has it. What is known of a node ages as its slot opens (`Ageing`): so a node and its
peers mean the same packet by the same acknowledgement.

*Lives.* A vehicle that begins anew has a higher epoch. What was believed of it is void when that epoch is heard. A
third vehicle may not have heard of it and state by its matrix what the old life held. So of rows about a peer that
began anew only those are heeded whose senders are known to have heard the new epoch. They say so by the bit in their
own row for the peer's last packet: at that time its epoch was not lower than the one known here. What such a vehicle
states rests, in turn, on rows that it heeded by the same rule. One that begins anew is known to have heard no epoch but
its own: what it heard in an earlier life it has forgotten, and may heed rows of those who never heard it either. An
older epoch is refused; if it comes twice running, the newer one was damage.

*Links.* Of the link from a peer to this vehicle a sample is each slot of the peer: heard or missed. Which slots a peer
spoke in is known once it is heard again; a silence too long to be loss is no sample, for the peer was away. Of the link
to a peer a sample is the bit by which the peer says whether it received this vehicle's last packet. It comes in packets
that were heard, so it does not depend on the way back. Newer samples count more: a sample has the weight ``KEPT`` to
the power of its age in samples, so an estimate follows a link within about 64 packets.

*Two in one slot.* Who hears two packets of one sender and slot, or itself hears a packet in its own name, cannot tell
what an acknowledgement of that name means. It neither gives nor heeds any until the doubt has lasted for some frames.
Nor does it believe any longer what it has believed of anybody: others may have acknowledged the one packet while it
held the other for it. And of matrices it heeds until then only what senders say of themselves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from exchange import ack
from exchange.ack import Acknowledgement, AckState, MutableWords, Words
from exchange.arithmetic import log
from exchange.errors import PeerFault
from exchange.packets import Met, Packet
from exchange.planning import KEPT, PRIOR_LOSS, PRIOR_WEIGHT
from exchange.schedule import TdmaSchedule

DOUBT_FRAMES = 16
"""Frames after the last sign of two vehicles in one slot before their name is trusted again."""
REPEATED_EPOCHS = 2
"""Packets in a row of an older epoch after which the newer one is taken for damage."""


LOST, HEARD = 1, 0
"""Samples of a link."""
MOST_SAMPLES = 64
"""That wait to be counted."""
UNLIKELY = 1e-3
"""A silence of this probability, at the estimated loss, is taken for absence."""
SHORTEST_SILENCE = 4
"""Frames that a peer may be silent in any case."""


class Link(NamedTuple):
    """What is known of one directed link.

    Attributes:
        p_loss: estimated share of lost packets; None without a sample.
        n: samples that it rests on; the old ones of many hardly count.
        p_reckoned: share of lost packets to be reckoned with, by the samples and by what holds before there are any.
    """

    p_loss: float | None
    n: int
    p_reckoned: float = PRIOR_LOSS

    def longest_silence(self, unlikely: float) -> int:
        """Packets in a row that loss alone takes with a probability below ``unlikely``."""
        return math.ceil(log(unlikely) / log(self.p_reckoned))


class PeerLinks(NamedTuple):
    """The two links between this vehicle and a peer.

    Attributes:
        incoming: from the peer to this vehicle.
        outgoing: from this vehicle to the peer.
    """

    incoming: Link
    outgoing: Link


@dataclass(slots=True)
class LossEstimate:
    """Running estimate of the loss of one directed link.

    Attributes:
        samples: those that nobody has asked about yet, a byte each: `LOST` or `HEARD`.

    >>> estimate = LossEstimate(bytearray([LOST, LOST, LOST, HEARD]))
    >>> round(estimate.link.p_loss, 2), estimate.link.n, estimate.longest_silence
    (0.74, 4, 17)
    """

    samples: bytearray = field(default_factory=bytearray)
    _n: int = 0
    _lost: float = 0.0
    _weight: float = 0.0

    def note_heard(self, n_lost: int) -> None:
        """Take note of a packet that was heard after so many that were lost: of ever so many the newest count."""
        self.samples += bytes([LOST]) * min(n_lost, MOST_SAMPLES)
        self.samples.append(HEARD)
        if len(self.samples) > MOST_SAMPLES:
            self._count()

    def _count(self) -> None:
        """Take in the samples: one is taken with every packet, but the estimate is asked for now and then."""
        lost, weight, samples = self._lost, self._weight, self.samples
        for sample in samples:
            lost = KEPT * lost + sample
            weight = KEPT * weight + 1.0
        self._lost, self._weight, self._n = lost, weight, self._n + len(samples)
        samples.clear()

    @property
    def link(self) -> Link:
        """The estimate as a value."""
        if self.samples:
            self._count()
        return Link(self._lost / self._weight if self._n else None, self._n, self.p_reckoned)

    @property
    def p_reckoned(self) -> float:
        """Share of lost packets to be reckoned with, see `Link`."""
        if self.samples:
            self._count()
        return (self._lost + PRIOR_LOSS * PRIOR_WEIGHT) / (self._weight + PRIOR_WEIGHT)

    @property
    def longest_silence(self) -> int:
        """Frames in a row that loss alone leaves empty with a probability below ``UNLIKELY``."""
        return max(SHORTEST_SILENCE, self.link.longest_silence(UNLIKELY))


class SpokenOf(NamedTuple):
    """What the acknowledgements in a packet are about.

    Attributes:
        lasting: nodes, one bit each, of which the packet is still known that is meant.
        is_asked: the own last packets are.
    """

    lasting: int
    is_asked: bool


ASKED, NOT_ASKED = SpokenOf(-1, True), SpokenOf(-1, False)
"""What they are about in a packet after which nobody has had a slot."""


class Ageing:
    """What is known of packets as time goes on: it ages node by node.

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
        """Time has come to a slot."""
        for k in range(self._next_slot, slot + 1):
            ack.open_slot(self._kind, self._state, self._n_nodes, k % self._n_nodes)
        self._next_slot = max(self._next_slot, slot + 1)

    def refuse(self, slot: int, sender: int, now_s: float) -> None:
        """Raise PeerFault if a packet of that slot comes when it can no more be heeded, or not yet."""
        if slot + self._n_nodes < self._next_slot:
            raise PeerFault(f"a packet of node {sender} of slot {slot} arrives when its next slot is open")
        own = slot - (slot - self._me) % self._n_nodes  # the last own slot before it
        if own >= self._next_slot and self._schedule.start_s(own) > now_s:
            raise PeerFault(f"a packet of slot {slot} arrives before the own slot {own} is open")

    def compose(self, slot: int, content: int, rows_out: MutableWords) -> None:
        """Remember what the own packet carries, and write its acknowledgement bits."""
        self._sent_slot = slot
        ack.compose(self._kind, self._state, self._n_nodes, slot // self._n_nodes, self._me, (content,), rows_out)

    def spoken_of(self, slot: int) -> SpokenOf:
        """What the acknowledgements in a packet of that slot are about.

        Of who has had a slot since a packet that comes late, the last packet is another than it speaks of.
        """
        is_asked = self._sent_slot is not None and 0 < slot - self._sent_slot < self._n_nodes
        if slot + 1 == self._next_slot:  # mostly it does not come late
            return ASKED if is_asked else NOT_ASKED
        lasting = -1
        for slot_since in range(slot + 1, self._next_slot):
            lasting &= ~(1 << slot_since % self._n_nodes)
        return SpokenOf(lasting, is_asked)

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
        n_nodes, sender, known = self._n_nodes, packet.sender, ((content,), origins)
        frame = slot // n_nodes
        ack.absorb(self._kind, carrier_evidence, self._state, n_nodes, frame, self._me, sender, heeded, *known)


class Absence(Protocol):
    """What comes of it that a peer is away."""

    def end(self, node: int) -> None:
        """A peer is heard again."""


class Witness(Protocol):
    """Who looks at the links between peers."""

    rows: list[list[int]]
    """By peer, what its packets have said of whose packets it has received, one bit each."""


class PeerStates:
    """What one node knows of the others beside what they hold.

    Args:
        me: own node index.
        n_nodes: size of the fleet.
        state: acknowledgement state of this node, of which is taken back what has become void.
        kind: acknowledgement of the policy, which says when a peer answers.
        absence: of its peers; none of them, or one.
        witnesses: of the links between peers; none of them, or one.
    """

    def __init__(
        self,
        me: int,
        n_nodes: int,
        state: AckState,
        kind: Acknowledgement,
        absence: Sequence[Absence] = (),
        witnesses: Sequence[Witness] = (),
    ) -> None:
        self._me = me
        self._n_nodes = n_nodes
        self._state = state
        frames, nodes = range(kind.period_frames), range(n_nodes)
        self._answering = [[kind.carries(n_nodes, frame, node, node, me) for node in nodes] for frame in frames]
        self.epochs = [0] * n_nodes
        """The newest epoch heard of each node."""
        self.away = 0
        """Nodes that are not waited for, one bit each."""
        self.awaited = 0
        """Nodes that catch up once they are heard, one bit each."""
        self._absence, self._witnesses = absence, witnesses
        self._all = (1 << n_nodes) - 1
        self._informed_of = [self._all] * n_nodes  # by peer: nodes whose epoch it is known to have heard
        self._older = [(0, 0)] * n_nodes  # an older epoch heard since, and how often in a row
        self._heard: list[tuple[int, bytes]] = [(-1, b"")] * n_nodes  # slot and bytes of the packet heard last
        self.heard_frame: list[int | None] = [None] * n_nodes
        """TDMA frame of the last packet of each node."""
        self._incoming = [LossEstimate() for _ in range(n_nodes)]
        self._outgoing = [LossEstimate() for _ in range(n_nodes)]
        self._since_frame: int | None = None
        self._doubted_until = [-1] * n_nodes  # frame
        self.trusted_from = 0
        """The first frame, from now on, in which no node is doubted."""

    def links(self, peer: int) -> PeerLinks:
        """What the links from and to a peer lose."""
        return PeerLinks(self._incoming[peer].link, self._outgoing[peer].link)

    def silences(self, frame: int) -> list[tuple[int, int]]:
        """Peers that are waited for and silent for longer than ``SHORTEST_SILENCE``, and for how many frames.

        Args:
            frame: TDMA frame of the own slot that opens.
        """
        if self._since_frame is None:
            self._since_frame = frame
        since, latest, passed_over = self._since_frame, frame - SHORTEST_SILENCE, self.away | 1 << self._me
        return [
            (node, frame - (heard or since))
            for node, heard in enumerate(self.heard_frame)
            if (heard or since) < latest and not passed_over >> node & 1
        ]

    def longest_silence(self, peer: int) -> int:
        """Frames in a row that loss alone leaves empty of a peer's packets, all but surely."""
        return self._incoming[peer].longest_silence

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
        known = self.epochs[sender]
        if epoch < known:
            before, n_before = self._older[sender]
            n_now = n_before + 1 if before == epoch else 1
            self._older[sender] = epoch, n_now
            if n_now < REPEATED_EPOCHS:
                raise PeerFault(f"node {sender} in its epoch {epoch}, after its epoch {known}")
        self._older[sender] = 0, 0
        last, self.heard_frame[sender] = self.heard_frame[sender], frame
        if last is None or frame > last:
            if last is not None and frame > last + 1:
                self._note_missed(sender, frame - last - 1)
            self._incoming[sender].samples.append(HEARD)
        was_away = self.awaited >> sender & 1
        for absence in self._absence if was_away else ():
            absence.end(sender)
        if epoch != known:
            return Met.NEW_LIFE
        return Met.BACK if was_away else Met.USUAL

    def begin(self, node: int, epoch: int) -> None:
        """A node is in another life: nothing is believed of it."""
        self.epochs[node] = epoch
        for peer, known in enumerate(self._informed_of):
            self._informed_of[peer] = known | 1 << node if peer == self._me else known & ~(1 << node)
        self._informed_of[node] = 1 << node
        self.forget(node)

    def is_over(self, origin: int, epoch: int) -> bool:
        """True if an origin is in another life, or away."""
        return epoch != self.epochs[origin] or bool(self.away >> origin & 1)

    def _note_missed(self, sender: int, n_missed: int) -> None:
        """Count what was missed of a peer in a row, unless it was away."""
        incoming = self._incoming[sender]
        if n_missed <= 2 * SHORTEST_SILENCE or n_missed <= 2 * incoming.longest_silence:
            incoming.samples += bytes([LOST]) * n_missed

    def heed(self, packet: Packet, frame: int, lasting: int, is_asked: bool) -> tuple[int, ...]:
        """The acknowledgement bits of a packet that may be believed; the others are taken out.

        Args:
            packet: received.
            frame: TDMA frame of its slot.
            lasting: nodes of which the packet is known that the bits are about.
            is_asked: the packet speaks of the own last packets.
        """
        sender, rows = packet.sender, packet.rows
        own = rows[sender]
        self._informed_of[sender] |= own
        if self._answering[frame % len(self._answering)][sender]:
            if is_asked and lasting >> self._me & 1:
                self._outgoing[sender].samples.append(HEARD if own >> self._me & 1 else LOST)
            for witness in self._witnesses if lasting == -1 else ():
                witness.rows[sender].append(own)
        heeded = self.vouched(sender, frame)
        if heeded == self._all and lasting == -1:
            return rows
        return tuple([row & lasting if heeded >> node & 1 else 0 for node, row in enumerate(rows)])

    def answers(self, sender: int, frame: int) -> bool:
        """True if a packet of a peer in that frame has the bit that says whether it received this vehicle's last."""
        return self._answering[frame % len(self._answering)][sender]

    def vouched(self, sender: int, frame: int) -> int:
        """Nodes, one bit each, of which a peer is to be believed what it says: it knows in which life they are."""
        return 1 << sender | (self._informed_of[sender] if frame >= self.trusted_from else 0)

    # Two in one slot -----------------------------------------------------------------------------

    def is_doubted(self, node: int, frame: int) -> bool:
        """True while two vehicles may speak under the name of a node."""
        return frame <= self._doubted_until[node]

    def conflicts(self, sender: int, slot: int, data: bytes) -> bool:
        """True if another packet of this sender was heard in the same slot; the packet is kept to compare the next."""
        (last_slot, last_data), self._heard[sender] = self._heard[sender], (slot, data)
        return last_slot == slot and last_data != data

    def doubt(self, node: int, frame: int) -> bool:
        """Two vehicles speak under the name of a node; True if it was not doubted before."""
        is_new = not self.is_doubted(node, frame)
        self._doubted_until[node] = frame + DOUBT_FRAMES
        self.trusted_from = max(self._doubted_until) + 1
        for peer in range(self._n_nodes) if is_new or node == self._me else (node,):
            if peer != self._me:
                self.forget(peer)
        if node == self._me:
            self._forget_content(self._me)
        return is_new

    # Taking back ---------------------------------------------------------------------------------

    def forget(self, node: int) -> None:
        """Believe nothing of what a node holds or has heard."""
        n_nodes, state = self._n_nodes, self._state
        state.believes[node] = 0
        for row in range(n_nodes):
            state.held[node * n_nodes + row] = 0
            state.held[row * n_nodes + node] = 0
        state.heard[0] &= ~(1 << node)
        self._forget_content(node)

    def _forget_content(self, node: int) -> None:
        self._state.content[node] = self._state.content[self._n_nodes + node] = 0
