"""Packets that arrive damaged: a checksum or a key finds them, and without either they are believed."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.acoustics.channel import Arrival
from missions.errors import ConfigurationError
from missions.features.damage import DamagingChannel
from missions.runs.run import run
from missions.runs.summary import summary
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
    made = run(load("mapping-rendezvous", [("--set", one) for one in settings]), seed)
    rows = {name: list(made.recorder.rows(name)) for name in made.recorder.tables}
    return json.dumps(rows, default=str), summary(made)


@given(st.integers(0, 10_000), st.binary(min_size=1, max_size=80), st.integers(1, 64), st.integers(0, 2**40))
def test_as_many_bits_are_turned_as_are_said(slot: int, data: bytes, bits: int, seed: int) -> None:
    for found in damaged(slot, data, 1.0, bits, seed):
        assert len(found) == len(data)
        turned = sum((one ^ other).bit_count() for one, other in zip(found, data, strict=True))
        assert turned == min(bits, 8 * len(data))


@given(st.integers(0, 10_000), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_what_is_damaged_at_one_share_is_damaged_alike_at_every_higher_one(slot: int, one: float, other: float) -> None:
    data = bytes(range(32))
    for less, more in zip(damaged(slot, data, min(one, other)), damaged(slot, data, max(one, other)), strict=True):
        assert less in (data, more)


def test_the_share_is_that_of_arrivals() -> None:
    """30 000 arrivals; within four standard errors."""
    n = sum(found != bytes(8) for slot in range(10_000) for found in damaged(slot, bytes(8), 0.2))
    assert abs(n / 30_000 - 0.2) <= 4.0 * (0.2 * 0.8 / 30_000) ** 0.5


# The refusal --------------------------------------------------------------------------------------


def test_damage_that_nothing_finds_is_refused_in_one_line() -> None:
    with pytest.raises(ConfigurationError) as refused:
        load("mapping-rendezvous", [("--set", SHARE)])
    said = str(refused.value)
    assert len(said.splitlines()) == 1
    for part in ("damage.share", "0.3", "communication.crc_bits", "communication.key_file", "damage.unchecked = true"):
        assert part in said


def test_a_file_is_told_with_its_line(tmp_path: Path) -> None:
    text = Path("missions/mapping/rendezvous.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text + "\n[damage]\nshare = 0.1\n", encoding="utf-8")
    line = text.count("\n") + 3
    with pytest.raises(ConfigurationError, match=rf"mine\.toml:{line}: damage\.share = 0\.1: packets have neither"):
        load(str(tmp_path / "mine.toml"))


@pytest.mark.parametrize("more", [["communication.crc_bits=8"], ["damage.unchecked=true"], ["damage.share=0.0"]])
def test_who_protects_packets_or_means_it_is_taken(more: list[str]) -> None:
    given = [one for one in (SHARE, *more) if not (one == SHARE and "damage.share=0.0" in more)]
    load("mapping-rendezvous", [("--set", one) for one in given])


def test_a_key_is_protection(tmp_path: Path) -> None:
    path = tmp_path / "fleet.key"
    path.write_text("00112233445566778899aabbccddeeff")
    path.chmod(0o600)
    load("mapping-rendezvous", [("--set", SHARE), ("--set", f"communication.key_file='{path}'")])


# In a mission -------------------------------------------------------------------------------------


def test_a_checksum_finds_all_of_it() -> None:
    """What is refused are the packets that were damaged; nobody believes what is false, and the mission is done."""
    made = run(load("mapping-rendezvous", [("--set", SHARE), ("--set", "communication.crc_bits=32")]), 1)
    found, arrivals = summary(made), sum(len(row[6]) for row in made.recorder.packets)
    refused = [row for row in made.recorder.rows("refused") if "damaged" in row[-1]]
    assert found["completed"]
    assert found["false_beliefs"] == 0
    assert abs(len(refused) / arrivals - 0.3) <= 4.0 * (0.3 * 0.7 / arrivals) ** 0.5


@pytest.mark.slow
def test_without_one_it_is_believed() -> None:
    """The reason for the refusal: take the checksum out, and vehicles believe what nobody observed."""
    _, found = recorded(SHARE, "damage.unchecked=true")
    assert found["false_beliefs"] > 0


def test_no_damage_is_no_change() -> None:
    assert recorded(SHORT, "channel.per=0.2", "damage.share=0.0") == recorded(SHORT, "channel.per=0.2")
    assert "damage" not in load("mapping-rendezvous").model_dump()
