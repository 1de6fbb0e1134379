"""Damage, ``[damage]``: bit errors in received packets, for links with a weak check or none.

Without checksum or key a receiver accepts many damaged packets. Such a scenario is rejected unless ``unchecked``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import Field

from exchange.channel import loss
from exchange.channel.channel import Arrival, Channel
from missions.errors import ConfigurationFault
from missions.feature import Feature, Joining
from remoras.events import Observer
from remoras.table import Probability, Section

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario
    from remoras.mission import Mission

KEY = "damage"


class DamageTable(Section):
    """The table ``[damage]``."""

    share: Probability = Field(0.0, description="share of received packets with flipped bits, drawn")
    bits: int = Field(1, ge=1, le=64, description="flipped bits per damaged packet, at random places")
    unchecked: bool = Field(
        False,
        description="true: accept damage although packets have neither checksum nor key, so that much is undetected",
    )


@dataclass(frozen=True, slots=True)
class DamagingChannel:
    """Channel that flips bits in some packets of another; a damaged packet is so at every greater ``share``, too."""

    calm: Channel
    seed: int
    share: float
    bits: int

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Return the arrivals of the other channel, some of them damaged."""
        return [
            self._damaged(arrival, slot, sender)
            if loss.uniform(self.seed, loss.DAMAGES, slot, sender, arrival.receiver) < self.share
            else arrival
            for arrival in self.calm.transmit(slot, sender, data, now_s, positions_m)
        ]

    def _damaged(self, arrival: Arrival, slot: int, sender: int) -> Arrival:
        content, n_bits = int.from_bytes(arrival.data, "big"), 8 * len(arrival.data)
        key, mask = loss.slot_key(loss.trial_key(self.seed, loss.PLACES), slot), 0
        for number in range(min(self.bits, n_bits)):
            place = int(loss.link_uniform(loss.slot_key(key, number), sender, arrival.receiver) * n_bits)
            # A place drawn twice moves on to the next, since two flips of one bit cancel out.
            while mask >> place & 1:
                place = (place + 1) % n_bits
            mask |= 1 << place
        return Arrival(arrival.receiver, arrival.time_s, (content ^ mask).to_bytes(len(arrival.data), "big"))


def damage_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Yield faults: damage that no check detects."""
    table, communication = scenario.of_feature(KEY), scenario.communication
    if table.share > 0.0 and not (communication.crc_bits or communication.key_file or table.unchecked):
        allowed = (
            "packets have neither checksum nor key, so many damaged packets would be accepted: set "
            f"communication.crc_bits = 8, 16 or 32, or communication.key_file; or {KEY}.unchecked = true if meant"
        )
        yield ConfigurationFault(f"{KEY}.share", "", allowed)


class Damage(Observer):
    """Run hooks that make the channel of the fleet damage packets."""

    def __init__(self, joining: Joining) -> None:
        self._table: DamageTable = joining.scenario.of_feature(KEY)
        self._seed = joining.seed

    def channel(self, channel: Channel) -> Channel:
        table = self._table
        return DamagingChannel(channel, self._seed, table.share, table.bits) if table.share else channel


FEATURE = Feature({"": {KEY: (DamageTable | None, None)}}, Damage, damage_faults)
