"""How much each directed link loses, as one vehicle sees it from what it hears.

Of the link from a peer to this vehicle a sample is each slot of the peer: heard or missed. Which slots a peer spoke in
is known once it is heard again; a silence too long to be loss is no sample, for the peer was away. Of the link to a
peer a sample is the bit by which the peer says whether it received this vehicle's last packet. It comes in packets that
were heard, so it does not depend on the way back. Newer samples count more: a sample has the weight ``KEPT`` to the
power of its age in samples, so an estimate follows a link within about 64 packets.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from exchange.arithmetic import log

KEPT = 1.0 - 1.0 / 64.0
"""What is left of the weight of a sample after the next one."""
PRIOR_LOSS = 0.5
"""Loss that is reckoned with before there is a sample; it counts as ``PRIOR_WEIGHT`` samples."""
PRIOR_WEIGHT = 2.0
UNLIKELY = 1e-3
"""A silence of this probability, at the estimated loss, is taken for absence."""
LOG_UNLIKELY = log(UNLIKELY)
SHORTEST_SILENCE = 4
"""Frames that a peer may be silent in any case."""


class Link(NamedTuple):
    """What is known of one directed link.

    Attributes:
        p_loss: estimated share of lost packets; None without a sample.
        n: samples that it rests on; the old ones of many hardly count.
    """

    p_loss: float | None
    n: int


class PeerLinks(NamedTuple):
    """The two links between this vehicle and a peer.

    Attributes:
        incoming: from the peer to this vehicle.
        outgoing: from this vehicle to the peer.
    """

    incoming: Link
    outgoing: Link


@dataclass(slots=True)
class Estimate:
    """Running estimate of the loss of one directed link.

    >>> estimate = Estimate()
    >>> estimate.add(3, 1)
    >>> round(estimate.link.p_loss, 2), estimate.n, estimate.longest_silence
    (0.74, 4, 17)
    """

    n: int = 0
    _lost: float = 0.0
    _weight: float = 0.0

    def add(self, n_lost: int, n_heard: int) -> None:
        """Take in so many losses and then so many packets that came through."""
        for is_lost in (*(1.0,) * n_lost, *(0.0,) * n_heard):
            self._lost = KEPT * self._lost + is_lost
            self._weight = KEPT * self._weight + 1.0
        self.n += n_lost + n_heard

    @property
    def link(self) -> Link:
        """The estimate as a value."""
        return Link(self._lost / self._weight if self.n else None, self.n)

    @property
    def longest_silence(self) -> int:
        """Frames in a row that loss alone leaves empty with a probability below ``UNLIKELY``."""
        p_loss = (self._lost + PRIOR_LOSS * PRIOR_WEIGHT) / (self._weight + PRIOR_WEIGHT)
        return max(SHORTEST_SILENCE, math.ceil(LOG_UNLIKELY / log(p_loss)))
