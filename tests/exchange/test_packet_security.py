"""Checksums and keys: damaged and foreign packets have no effect and are counted."""

import sys
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_bad_packets import KEY, codec

from benchmarks.manager_fleet import cells
from exchange.errors import ConfigurationError
from exchange.packets import Fragment
from exchange.wire.codec import Codec
from exchange.wire.sealing import CRC_BITS, Seal, key_in, nonce_of

guarded = partial(codec, "ack")
"""By the bits of the checksum, the key and the number of nodes."""


def a_packet(codec: Codec) -> bytes:
    """51 B of observations and a relayed block, without checksum and tag."""
    fragments = [Fragment(0, sequence, 0.0, cells(3, 1)) for sequence in range(9)]
    return codec.encode(0, 6, [*fragments, Fragment(1, 7, 0.0, cells(3, 2))])


# Checksums ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("crc_bits", CRC_BITS)
def test_a_checksum_takes_its_bits_and_changes_nothing_else(crc_bits: int):
    plain, codec = guarded(), guarded(crc_bits)
    assert codec.overhead_bits == plain.overhead_bits + crc_bits
    assert len(a_packet(codec)) == len(a_packet(plain)) + crc_bits // 8
    assert codec.decode(a_packet(codec)).packet == plain.decode(a_packet(plain)).packet
    assert [line.size_bits for line in codec.listing() if line.field == "checksum"] == [crc_bits] * (crc_bits > 0)


def test_a_checksum_of_another_size_is_refused():
    with pytest.raises(ConfigurationError, match="12 bits; allowed: 0, 8, 16, 32"):
        guarded(12)


# Keys ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("crc_bits", [0, 16])
@pytest.mark.parametrize("frame", [0, 5, 1029])
def test_an_encrypted_packet_decrypts_with_its_key(crc_bits: int, frame: int):
    plain, codec = guarded(), guarded(crc_bits, KEY)
    data = codec.encode(0, 6, [Fragment(0, 4, 0.0, cells(3, 2))], frame=frame, slot_start_s=6.0 * frame)
    assert codec.decode(data, frame, 6.0 * frame).packet.fragments == (Fragment(0, 4, 0.0, cells(3, 2)),)
    assert codec.head(data)[:3] == (0, 0, frame % 4)
    assert codec.overhead_bits == plain.overhead_bits + 2 + 32 + crc_bits  # a head of 14 bits is 2 B now
    padding = [line.size_bits for line in codec.listing() if line.field in ("head to a byte", "tag")]
    assert padding == [2, 32]


@given(st.sets(st.tuples(st.integers(0, 63), st.integers(0, 3), st.integers(0, 10**6)), max_size=30))
def test_no_nonce_is_used_twice(sent: set[tuple[int, int, int]]):
    """By sender, epoch and frame; a slot of 1.7 s."""
    nonces = [nonce_of(*who, frame, 1.7 * (64 * frame + who[0]), b"\1\2\3\4") for *who, frame in sent]
    assert len(set(nonces)) == len(sent)
    assert {len(nonce) for nonce in nonces} <= {13}


def test_without_the_library_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "cryptography.hazmat.primitives.ciphers.aead", None)
    with pytest.raises(ConfigurationError, match=r"remoras-sim\[crypto\]"):
        Seal(KEY)


@pytest.mark.parametrize(
    ("text", "why"),
    [("not a key", "hexadecimal digits alone"), ("00ff", "it holds 4 hexadecimal digits; allowed: 32, 48, 64")],
)
def test_a_file_without_a_key_is_refused_without_printing_its_content(tmp_path: Path, text: str, why: str):
    path = tmp_path / "fleet.key"
    path.write_text(text)
    path.chmod(0o600)
    with pytest.raises(ConfigurationError, match=why) as raised:
        key_in(path)
    assert text not in str(raised.value)


def test_a_key_file_is_hexadecimal_digits(tmp_path: Path):
    path = tmp_path / "fleet.key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    assert key_in(path) == KEY
    with pytest.raises(ConfigurationError, match="cannot be read: No such file"):
        key_in(tmp_path / "none.key")
