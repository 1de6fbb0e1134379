"""The peers of one vehicle: what their packets acknowledge, which life each is in, what its links lose.

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
from dataclasses import dataclass, field
from typing import NamedTuple

from exchange.ack import Acknowledgement
from exchange.arithmetic import log
from exchange.errors import PeerFault
from exchange.packets import Met
from exchange.planning import KEPT, PRIOR_LOSS, PRIOR_WEIGHT

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


class PeerStates:
    """Lives, links and presence of the other nodes, as one node knows them.

    Args:
        me: own node index.
        n_nodes: size of the fleet.
        kind: acknowledgement of the policy, which says when a peer answers.
    """

    def __init__(self, me: int, n_nodes: int, kind: Acknowledgement) -> None:
        self._me = me
        self._n_nodes = n_nodes
        frames, nodes = range(kind.period_frames), range(n_nodes)
        self._answering = [[kind.carries(n_nodes, frame, node, node, me) for node in nodes] for frame in frames]
        self.epochs = [0] * n_nodes
        """The newest epoch heard of each node."""
        self.away = 0
        """Nodes that are not waited for, one bit each."""
        self.awaited = 0
        """Nodes that catch up once they are heard, one bit each."""
        self.is_alone = False
        """Nobody is heard: the next node that is catches up, and none is away."""
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
        if was_away:
            self.is_alone = False
            self.away &= ~(1 << sender)
            self.awaited = self.away
        if epoch != known:
            return Met.NEW_LIFE
        return Met.BACK if was_away else Met.USUAL

    def begin(self, node: int, epoch: int) -> None:
        """A node is in another life: nothing is believed of it."""
        self.epochs[node] = epoch
        for peer, known in enumerate(self._informed_of):
            self._informed_of[peer] = known | 1 << node if peer == self._me else known & ~(1 << node)
        self._informed_of[node] = 1 << node

    def is_over(self, origin: int, epoch: int) -> bool:
        """True if an origin is in another life, or away."""
        return epoch != self.epochs[origin] or bool(self.away >> origin & 1)

    def _note_missed(self, sender: int, n_missed: int) -> None:
        """Count what was missed of a peer in a row, unless it was away."""
        incoming = self._incoming[sender]
        if n_missed <= 2 * SHORTEST_SILENCE or n_missed <= 2 * incoming.longest_silence:
            incoming.samples += bytes([LOST]) * n_missed

    def heed(self, sender: int, own: int, frame: int, is_asked: bool) -> int:
        """Nodes, one bit each, of which the acknowledgements in a packet are to be believed.

        Args:
            sender: of the packet.
            own: nodes whose last packets it received.
            frame: TDMA frame of its slot.
            is_asked: it speaks of the last packet of this node.
        """
        self._informed_of[sender] |= own
        if is_asked and self.answers(sender, frame):
            self._outgoing[sender].samples.append(HEARD if own >> self._me & 1 else LOST)
        return self.vouched(sender, frame)

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
        return is_new
