"""Damaged packets: detected by a checksum or a key, believed without either."""

import json
from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st
from recorded import flown

from exchange.channel.channel import Arrival
from missions.features.damage import DamagingChannel
from missions.runs.results import summary
from missions.scenarios import load

SHARE = "damage.share=0.3"
SHORT = "scenario.duration_s=600"


class Calm:
    """Everything arrives at nodes 1 to 3."""

    def transmit(
        self, slot: int, sender: int, data: bytes, now_s: float, positions_m: Sequence[tuple[float, float]]
    ) -> list[Arrival]:
        return [Arrival(receiver, now_s + 1.0, data) for receiver in (1, 2, 3)]


def damaged(slot: int, data: bytes, share: float, bits: int = 1, seed: int = 5) -> list[bytes]:
    return [one.data for one in DamagingChannel(Calm(), seed, share, bits).transmit(slot, 0, data, 0.0, ())]


def recorded(*settings: str, seed: int = 1) -> tuple[str, dict[str, object]]:
    """All rows of a run as one text, and its summary."""
    made = flown("mapping-rendezvous", *settings, seed=seed)
    rows = {name: list(made.recorder.rows(name)) for name in made.recorder.tables}
    return json.dumps(rows, default=str), summary(made)


@given(st.integers(0, 10_000), st.binary(min_size=1, max_size=80), st.integers(1, 64), st.integers(0, 2**40))
def test_number_of_flipped_bits_is_as_configured(slot: int, data: bytes, bits: int, seed: int) -> None:
    for found in damaged(slot, data, 1.0, bits, seed):
        assert len(found) == len(data)
        turned = sum((one ^ other).bit_count() for one, other in zip(found, data, strict=True))
        assert turned == min(bits, 8 * len(data))


@given(st.integers(0, 10_000), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_damage_at_one_share_is_equal_at_every_higher_share(slot: int, one: float, other: float) -> None:
    data = bytes(range(32))
    for less, more in zip(damaged(slot, data, min(one, other)), damaged(slot, data, max(one, other)), strict=True):
        assert less in (data, more)


# In a mission -------------------------------------------------------------------------------------


def test_checksum_detects_all_damage() -> None:
    """Refused packets are the damaged ones; there are no false beliefs, and the mission completes."""
    made = flown("mapping-rendezvous", SHARE, "communication.crc_bits=32")
    found, arrivals = summary(made), sum(len(row[6]) for row in made.recorder.packets)
    refused = [row for row in made.recorder.rows("refused") if "damaged" in row[-1]]
    assert found["completed"]
    assert found["false_beliefs"] == 0
    assert abs(len(refused) / arrivals - 0.3) <= 4.0 * (0.3 * 0.7 / arrivals) ** 0.5


def test_share_0_changes_nothing() -> None:
    assert recorded(SHORT, "channel.per=0.2", "damage.share=0.0") == recorded(SHORT, "channel.per=0.2")
    assert "damage" not in load("mapping-rendezvous").model_dump()
