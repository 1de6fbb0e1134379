"""Peers of one vehicle: acknowledgements, incarnations, link loss.

*Incarnations.* A restarted vehicle has a higher epoch; beliefs about its earlier incarnation are void. A third vehicle
may not know the new epoch and acknowledge items for the old one. Acknowledgements about a restarted peer are therefore
accepted only from senders known to have received the new epoch: they acknowledged a packet of it in their own row.
Their acknowledgements in turn rest on rows accepted by the same rule.

*Links.* Each slot of a peer is a sample of the incoming link: received or lost, counted at its next packet. A sample of
the outgoing link is the peer's acknowledgement bit for the own last packet; it is independent of the way back. A sample
weighs ``KEPT`` to the power of its age in samples: estimates follow a link within about 64 packets.

*Duplicate node ids.* Evidence is two packets of one sender and slot, or a packet in the own name. Acknowledgements of
that name are ambiguous: they are neither sent nor accepted until the ambiguity has lasted for some frames. Beliefs
about all nodes are cleared, since others may have acknowledged one packet for the other. Until then, of an
acknowledgement matrix only the sender's own row counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from exchange.arithmetic import log
from exchange.errors import PeerFault
from exchange.packets import Met
from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.planning import KEPT, PRIOR_LOSS, loss_of, reception_of

DOUBT_FRAMES = 16
"""Frames after the last evidence of a duplicate node id before the name is trusted again."""
LOST, HEARD = 1, 0
"""Samples of a link."""
MOST_SAMPLES = 64
"""Largest number of losses in succession that count."""
UNLIKELY = 1e-3
"""Probability of a silence, at the estimated loss, below which it counts as absence."""
SHORTEST_SILENCE = 4
"""Frames of silence that never count as absence."""


class Link(NamedTuple):
    """Loss estimate of one directed link, from ``n`` samples.

    ``p_loss`` is the weighted share of lost packets, None without a sample; ``p_reckoned`` the posterior share, from
    samples and prior.
    """

    p_loss: float | None
    n: int
    p_reckoned: float = PRIOR_LOSS

    def longest_silence(self, unlikely: float) -> int:
        """Packets lost in succession whose probability falls below ``unlikely``."""
        # Losses are taken as independent: p ** n < unlikely.
        return math.ceil(log(unlikely) / log(self.p_reckoned))


class PeerLinks(NamedTuple):
    """Links from a peer (incoming) and to it (outgoing)."""

    incoming: Link
    outgoing: Link


@dataclass(slots=True)
class LossEstimate:
    """Running loss estimate of one directed link.

    >>> estimate = LossEstimate()
    >>> for sample in (LOST, LOST, LOST, HEARD): estimate.note(sample)
    >>> round(estimate.link.p_loss, 2), estimate.link.n, estimate.longest_silence
    (0.74, 4, 17)
    """

    _n: int = 0
    _lost: float = 0.0
    _weight: float = 0.0

    def note(self, sample: int, times: int = 1) -> None:
        """Record a sample, `LOST` or `HEARD`, so many times."""
        for _ in range(times):
            self._lost, self._weight, self._n = KEPT * self._lost + sample, KEPT * self._weight + 1.0, self._n + 1

    def note_heard(self, n_lost: int) -> None:
        """Record a packet received after ``n_lost`` lost ones; the last ``MOST_SAMPLES`` count."""
        self.note(LOST, min(n_lost, MOST_SAMPLES))
        self.note(HEARD)

    @property
    def link(self) -> Link:
        """Estimate as a value."""
        return Link(self._lost / self._weight if self._n else None, self._n, loss_of(self._lost, self._weight))

    @property
    def reception(self) -> float:
        """Delivery rate, see `reception_of`."""
        return reception_of(self._lost, self._weight)

    @property
    def longest_silence(self) -> int:
        """Frames of silence that loss explains with probability ``UNLIKELY`` or more."""
        return max(SHORTEST_SILENCE, self.link.longest_silence(UNLIKELY))


class PeerStates:
    """Incarnation, links and presence of the other nodes, as one node knows them."""

    def __init__(self, me: int, n_nodes: int, kind: Acknowledgement) -> None:
        self._me = me
        self._n_nodes = n_nodes
        frames, nodes = range(kind.period_frames), range(n_nodes)
        self.answering = [[kind.carries(n_nodes, frame, node, node, me) for node in nodes] for frame in frames]
        """By frame, modulo the policy's period, and sender: True if its packet acknowledges this node's last one."""
        self.epochs = [0] * n_nodes
        """Newest epoch received, by node."""
        self.away = 0
        """Absent nodes (bit mask), for which no item waits."""
        self.is_alone = False
        """True while no node is received: the next one resynchronises, and none counts as absent."""
        self._all = (1 << n_nodes) - 1
        self._informed_of = [self._all] * n_nodes  # by peer: nodes whose present epoch it received
        self._older: list[int | None] = [None] * n_nodes  # older epoch refused in the last packet
        self._heard: list[tuple[int, bytes]] = [(-1, b"")] * n_nodes  # frame and bytes of the last packet
        self.heard_frame: list[int | None] = [None] * n_nodes
        """TDMA frame of the last packet, by node."""
        self.incoming = [LossEstimate() for _ in range(n_nodes)]
        """Links from each node."""
        self.outgoing = [LossEstimate() for _ in range(n_nodes)]
        """Links to each node."""
        self._since_frame: int | None = None
        self.doubted_until = [-1] * n_nodes
        """Last frame in which each node id may be duplicate."""
        self.trusted_from = 0
        """First frame from which no node id is ambiguous."""

    def mark_absent(self, frame: int) -> list[int]:
        """Mark present peers as absent whose silence exceeds loss; return them.

        Silence of all peers is a fault of the own receiver or distance, rather than the absence of all: none is marked
        then, and the next peer counts as returning.
        """
        if self._since_frame is None:
            self._since_frame = frame
        present, absent = self._all & ~(self.away | 1 << self._me), list[int]()
        for node, heard_frame in enumerate(self.heard_frame):
            silence = frame - (self._since_frame if heard_frame is None else heard_frame)
            if silence > SHORTEST_SILENCE and present >> node & 1 and silence > self.incoming[node].longest_silence:
                absent.append(node)
        if not absent:
            return absent
        self.away |= sum([1 << node for node in absent])
        if self.away == self._all & ~(1 << self._me):
            self.away, self.is_alone, absent = 0, True, []
            self.heard_frame[:] = [frame] * self._n_nodes
        return absent

    # Reception -----------------------------------------------------------------------------------

    def meet(self, sender: int, epoch: int, frame: int, data: bytes) -> tuple[Met, bool]:
        """Update presence and link of a sender; raise PeerFault for an earlier incarnation.

        Return also whether another packet of the sender in that frame differed.
        """
        known = self.epochs[sender]
        # Received twice in succession, an older epoch shows that the newer one was damage.
        if epoch < known and epoch != self._older[sender]:
            self._older[sender] = epoch
            raise PeerFault(f"node {sender} in its epoch {epoch}, after its epoch {known}")
        self._older[sender] = None
        last, self.heard_frame[sender] = self.heard_frame[sender], frame
        if last is None or frame > last:
            incoming, n_missed = self.incoming[sender], 0 if last is None else frame - last - 1
            # A silence too long for loss is absence, which says nothing about the link.
            if n_missed and (n_missed <= 2 * SHORTEST_SILENCE or n_missed <= 2 * incoming.longest_silence):
                incoming.note(LOST, n_missed)
            incoming.note(HEARD)
        was_away = self.is_alone or self.away >> sender & 1
        self.is_alone, self.away = False, self.away & ~(1 << sender)
        (last_frame, last_data), self._heard[sender] = self._heard[sender], (frame, data)
        met = Met.NEW_LIFE if epoch != known else Met.BACK if was_away else Met.USUAL
        return met, last_frame == frame and last_data != data

    def begin(self, node: int, epoch: int) -> None:
        """Start a new incarnation of a node."""
        self.epochs[node] = epoch
        for peer, known in enumerate(self._informed_of):
            self._informed_of[peer] = known | 1 << node if peer == self._me else known & ~(1 << node)
        # Of a restarted vehicle it is known only that it has its own epoch: it may have lost all others.
        self._informed_of[node] = 1 << node

    def is_over(self, origin: int, epoch: int) -> bool:
        """True if an origin is absent or in another incarnation."""
        return epoch != self.epochs[origin] or bool(self.away >> origin & 1)

    def heed(self, sender: int, own: int, frame: int, is_answer: bool) -> int:
        """Record the receptions ``own`` of a peer; return the nodes (bit mask) whose acknowledgements count.

        They are its own, and those of nodes whose present incarnation it knows. ``is_answer``: it acknowledges the last
        packet of this node, or its loss.
        """
        self._informed_of[sender] |= own
        if is_answer:
            self.outgoing[sender].note(HEARD if own >> self._me & 1 else LOST)
        return 1 << sender | (self._informed_of[sender] if frame >= self.trusted_from else 0)

    # Duplicate node ids --------------------------------------------------------------------------

    def doubt(self, node: int, frame: int) -> bool:
        """Record a duplicate node id; return True if it was not ambiguous before."""
        is_new = frame > self.doubted_until[node]
        self.doubted_until[node] = frame + DOUBT_FRAMES
        self.trusted_from = max(self.doubted_until) + 1
        return is_new
