"""How many packets arrive when they are drawn one by one, through the channel as runs use it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from exchange.acoustics.channel import BroadcastChannel
from exchange.acoustics.link import LinkModel, Transmission
from exchange.acoustics.modems import Modem


@dataclass(slots=True)
class CachedLinks:
    """Links between vehicles that stay where they are: each is asked once."""

    links: LinkModel
    known: dict[int, float] = field(default_factory=dict)

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """The answer that the links gave for this receiver at first."""
        if receiver not in self.known:
            self.known[receiver] = self.links.p_loss(packet, receiver, range_m)
        return self.known[receiver]


def n_arrived(links: LinkModel, modem: Modem, ranges_m: Sequence[float], n_packets: int, seed: int) -> list[int]:
    """Full packets of one sender that arrive at each of some receivers.

    Args:
        links: whose losses depend on range and size alone.
        modem: of all.
        ranges_m: of the receivers.
        n_packets: that are sent, one in each slot.
        seed: of the draws.
    """
    channel = BroadcastChannel(modem, CachedLinks(links), seed, carries_beyond_range=True)
    positions_m = [(0.0, 0.0), *((range_m, 0.0) for range_m in ranges_m)]
    counts = [0] * len(ranges_m)
    data = bytes(modem.payload_bytes)
    for slot in range(n_packets):
        for arrival in channel.transmit(slot, 0, data, 0.0, positions_m):
            counts[arrival.receiver - 1] += 1
    return counts
