"""Links of a modem whose losses were measured over the signal-to-noise ratio: its waterfall.

Of a frame of L bits the curve has the packet error rate at some ratios in the band. Between two of them it is linear in
dB; below the first every frame is lost, and above the last its rate holds. A frame that is shorter by the factor x is
lost as often as if the parts of a whole one were lost independently: 1 - (1 - PER)^x.

The curve was measured in some channel, with the fades and echoes of that: no fading of ours comes on top.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from exchange.acoustics.budget import Budget
from exchange.acoustics.link import Transmission
from exchange.acoustics.packet_errors import block_loss

Curve = Sequence[tuple[float, float]]
"""Signal-to-noise ratio in the band (dB) and packet error rate of a whole frame, by rising ratio."""


def per_at(curve: Curve, snr_db: float) -> float:
    """Packet error rate of a whole frame.

    >>> per_at([(-1.0, 0.8), (0.0, 0.5), (2.0, 0.1)], 1.0)
    0.3
    """
    if snr_db < curve[0][0]:
        return 1.0
    for (low_db, worse), (high_db, better) in pairwise(curve):
        if snr_db < high_db:
            return worse + (better - worse) * (snr_db - low_db) / (high_db - low_db)
    return curve[-1][1]


@dataclass(frozen=True, slots=True)
class MeasuredLinks:
    """Links of one modem in one sea whose losses follow from its curve.

    Args:
        budget: of all links.
        curve: of whole frames.
        frame_bits: of a whole frame.
    """

    budget: Budget
    curve: Curve
    frame_bits: int

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Probability that one frame of the packet or more are lost."""
        return self.loss_at(range_m, packet.size_bits)

    def shifted(self, excess_db: float) -> MeasuredLinks:
        """The same links where the ratio of signal to noise is by so much above that of the budget."""
        return replace(self, budget=self.budget.shifted(excess_db))

    def loss_at(self, range_m: float, size_bits: int) -> float:
        """Probability that a packet is lost that is taken whole."""
        per = per_at(self.curve, self.budget.effective_snr_db(range_m))
        return per if per in (0.0, 1.0) else block_loss(per, size_bits / self.frame_bits)

    def delivered_at(self, range_m: float, size_bits: int) -> float:
        """Share of a packet that arrives in the mean where each frame is delivered for itself."""
        n_whole, rest_bits = divmod(size_bits, self.frame_bits)
        whole, rest = self.loss_at(range_m, self.frame_bits), self.loss_at(range_m, rest_bits)
        return 1.0 - (n_whole * self.frame_bits * whole + rest_bits * rest) / size_bits if size_bits else 1.0
