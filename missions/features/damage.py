"""Damage: ``[damage]``, by which some of the packets that arrive have bits turned.

Modems refuse what was damaged, and channels lose packets and damage none. This is for links whose modem does not check,
or not well. Without a checksum or a key much of what was damaged passes for sound, and is believed: so a scenario that
has neither is refused, unless it says that it wants just that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import Field

from exchange.acoustics import loss
from exchange.acoustics.channel import Arrival, Channel
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

    share: Probability = Field(0.0, description="share of the packets that arrive of which bits are turned, drawn")
    bits: int = Field(1, ge=1, le=64, description="bits turned in each of them, at places that are drawn")
    unchecked: bool = Field(
        False, description="true: damage is wanted though packets have neither checksum nor key, and much is believed"
    )


@dataclass(frozen=True, slots=True)
class DamagingChannel:
    """Carries packets as another channel does, and turns bits of some.

    A packet is damaged at a receiver if the draw of ``loss.uniform(seed, loss.DAMAGES, slot, sender, receiver)`` lies
    below the share: what is damaged at one share is damaged at every higher one, whatever else differs.

    Args:
        calm: the other channel.
        seed: of the run.
        share: of the packets that arrive.
        bits: that are turned in each.
    """

    calm: Channel
    seed: int
    share: float
    bits: int

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        """Arrivals as the other channel has them, some of them damaged."""
        return [
            self._damaged(arrival, slot, sender)
            if loss.uniform(self.seed, loss.DAMAGES, slot, sender, arrival.receiver) < self.share
            else arrival
            for arrival in self.calm.transmit(slot, sender, data, now_s, positions_m)
        ]

    def _damaged(self, arrival: Arrival, slot: int, sender: int) -> Arrival:
        """The arrival with bits turned; two draws of one place turn it to and fro, so the last of them is moved on."""
        found, n_bits = int.from_bytes(arrival.data, "big"), 8 * len(arrival.data)
        key, mask = loss.slot_key(loss.trial_key(self.seed, loss.PLACES), slot), 0
        for number in range(min(self.bits, n_bits)):
            place = int(loss.link_uniform(loss.slot_key(key, number), sender, arrival.receiver) * n_bits)
            while mask >> place & 1:
                place = (place + 1) % n_bits
            mask |= 1 << place
        return Arrival(arrival.receiver, arrival.time_s, (found ^ mask).to_bytes(len(arrival.data), "big"))


def damage_faults(scenario: Scenario, mission: type[Mission]) -> Iterator[ConfigurationFault]:
    """Damage that nothing finds."""
    table, communication = scenario.of_feature(KEY), scenario.communication
    if table.share > 0.0 and not (communication.crc_bits or communication.key_file or table.unchecked):
        allowed = (
            "packets have neither checksum nor key, so much of what is damaged would be believed: set "
            f"communication.crc_bits = 8, 16 or 32, or communication.key_file; or {KEY}.unchecked = true if meant"
        )
        yield ConfigurationFault(f"{KEY}.share", "", allowed)


class Damage(Observer):
    """Lets the channel of the fleet damage packets."""

    def __init__(self, joining: Joining) -> None:
        self._table: DamageTable = joining.scenario.of_feature(KEY)
        self._seed = joining.seed

    def channel(self, channel: Channel) -> Channel:
        """The channel, which turns bits of some packets."""
        table = self._table
        return DamagingChannel(channel, self._seed, table.share, table.bits) if table.share else channel


FEATURE = Feature(
    {"": {KEY: (DamageTable | None, None)}},
    Damage,
    damage_faults,
)
