"""Checksums and keys: what is damaged or of a stranger does no harm, and is counted."""

import random
import sys
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.errors import ConfigurationError, PeerFault
from exchange.packets import Fragment, Packet
from exchange.policies import POLICIES
from exchange.wire.codec import Codec, Framing
from exchange.wire.sealing import CRC_BITS, Seal, key_in, nonce_of
from stress.conformance.radio import DURATION_S, MAPPED_CELL, N_BLOCKS, TBOX, ManagerFleet, bay, cells, instances

KEY = bytes(range(16))


@cache
def guarded(crc_bits: int = 0, key: bytes | None = None, n_nodes: int = 3) -> Codec:
    return Codec(
        TBOX, len(instances(n_nodes)), n_nodes, POLICIES["ack"], N_BLOCKS, DURATION_S, framing=Framing(crc_bits, key)
    )


def a_packet(codec: Codec, frame: int = 0) -> bytes:
    """51 B of observations and a relayed block, without checksum and tag."""
    fragments = [Fragment(0, sequence, 3.0 * frame, cells(3, 1)) for sequence in range(9)]
    return codec.encode(0, [0b110] * 3, [*fragments, Fragment(1, 7, 0.0, cells(3, 2))], frame=frame)


def passes(codec: Codec, data: bytes) -> Packet | None:
    try:
        return codec.decode(data)
    except PeerFault:
        return None


def flipped(data: bytes, *bits: int) -> bytes:
    word = int.from_bytes(data, "big")
    for bit in bits:
        word ^= 1 << bit
    return word.to_bytes(len(data), "big")


# Checksums ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("crc_bits", CRC_BITS)
def test_a_checksum_takes_its_bits_and_changes_nothing_else(crc_bits: int):
    plain, codec = guarded(), guarded(crc_bits)
    assert codec.overhead_bits == plain.overhead_bits + crc_bits
    assert len(a_packet(codec)) == len(a_packet(plain)) + crc_bits // 8
    assert codec.decode(a_packet(codec)) == plain.decode(a_packet(plain))
    assert [line.size_bits for line in codec.listing() if line.field == "checksum"] == [crc_bits] * (crc_bits > 0)


@pytest.mark.parametrize("crc_bits", [8, 16, 32])
def test_no_single_flip_passes_a_checksum(crc_bits: int):
    codec = guarded(crc_bits)
    data = a_packet(codec)
    assert not any(passes(codec, flipped(data, bit)) for bit in range(8 * len(data)))


def test_many_single_flips_pass_without_a_checksum():
    """So a link that lets damage through needs one: about half of these pass with another content."""
    codec = guarded()
    data = a_packet(codec)
    n_passed = sum(passes(codec, flipped(data, bit)) is not None for bit in range(8 * len(data)))
    assert n_passed / (8 * len(data)) > 0.4


@pytest.mark.parametrize("crc_bits", [8, 16, 32])
@given(dice=st.randoms(use_true_random=False), length=st.integers(1, 32))
def test_no_burst_passes_a_checksum_that_is_as_long(crc_bits: int, dice: random.Random, length: int):
    """All errors within ``length`` bits, the first and the last of them wrong."""
    codec = guarded(crc_bits)
    data, length = a_packet(codec), min(length, crc_bits)
    first = dice.randrange(8 * len(data) - length + 1)
    wrong = {first, first + length - 1, *(first + n for n in range(length) if dice.random() < 0.5)}
    assert passes(codec, flipped(data, *wrong)) is None


@pytest.mark.parametrize(("crc_bits", "n_pass"), [(16, 0), (32, 0)])
def test_no_two_flips_pass_a_longer_checksum(crc_bits: int, n_pass: int):
    """Their polynomials tell any two flips apart within 32 767 bits and more."""
    codec, dice = guarded(crc_bits), random.Random(2)
    data = a_packet(codec)
    pairs = [dice.sample(range(8 * len(data)), 2) for _ in range(3000)]
    assert sum(passes(codec, flipped(data, *pair)) is not None for pair in pairs) == n_pass


@pytest.mark.parametrize("crc_bits", [8, 16])
def test_of_random_bytes_one_in_as_many_passes_as_there_are_checksums(crc_bits: int):
    """Of those with a fitting first byte; the others are no packets of this fleet anyway."""
    codec, dice = guarded(crc_bits), random.Random(3)
    first = a_packet(codec)[:1]
    n_tried = 20_000
    n_passed = sum(passes(codec, first + dice.randbytes(31)) is not None for _ in range(n_tried))
    assert n_passed <= 2 * n_tried / 2**crc_bits + 3


def test_a_mutated_first_copy_never_keeps_the_true_one_out():
    """Every flip of a bit in the first copy: it is refused, not acknowledged, and the next copy comes in."""
    codec = guarded(16, n_nodes=2)
    sender = ManagerFleet(2, codec=codec)
    uid = sender.maps(0, cell=7)
    data = sender.managers[0].packet_to_send(0.0).data
    for bit in range(8 * len(data)):
        fleet = ManagerFleet(2, codec=codec)
        assert fleet.deliver(1, flipped(data, bit), 1.0).fault
        assert fleet.deliver(1, data, 1.1).items == (uid,)
        assert fleet.models[1].value(bay(2), MAPPED_CELL) == 7.0
        assert fleet.managers[1].n_faults == 1


def test_a_checksum_of_another_size_is_refused():
    with pytest.raises(ConfigurationError, match="12 bits; allowed: 0, 8, 16, 32"):
        guarded(12)


# Keys ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("crc_bits", [0, 16])
@pytest.mark.parametrize("frame", [0, 5, 1029])
def test_what_is_sealed_opens_with_the_key(crc_bits: int, frame: int):
    plain, codec = guarded(), guarded(crc_bits, KEY)
    data = codec.encode(0, [6] * 3, [Fragment(0, 4, 0.0, cells(3, 2))], frame=frame, slot_start_s=6.0 * frame)
    assert codec.decode(data, frame, 6.0 * frame).fragments == (Fragment(0, 4, 0.0, cells(3, 2)),)
    assert codec.head(data)[:3] == (0, 0, frame % 4)
    assert codec.overhead_bits == plain.overhead_bits + 2 + 32 + crc_bits  # a head of 14 bits is 2 B now
    padding = [line.size_bits for line in codec.listing() if line.field in ("head to a byte", "tag")]
    assert padding == [2, 32]


def test_no_content_can_be_read_without_the_key():
    """The same content in two slots has no bytes in common but by chance; nor has it those of the plain packet."""
    codec = guarded(key=KEY)
    one, other = (codec.encode(0, [0] * 3, [Fragment(0, 4, 0.0, cells(3, 9))], frame=f)[2:] for f in (1, 5))
    assert sum(a == b for a, b in zip(one, other, strict=True)) < 8


@pytest.mark.parametrize("key", [None, bytes(16), KEY + KEY])
def test_another_key_is_refused_and_counted(key: bytes | None):
    fleet = ManagerFleet(3, codec=guarded(key=KEY))
    stranger = guarded(key=key)
    for frame in range(6):
        data = stranger.encode(0, [0] * 3, [Fragment(0, frame, 0.0, cells(3, 1))], frame=frame)
        assert fleet.deliver(1, data, fleet.schedule.start_s(3 * frame) + 1.0).fault
    assert fleet.managers[1].n_faults == 6
    assert list(fleet.models[1].blocks()) == []


def test_no_changed_bit_opens_and_no_other_slot():
    codec = guarded(key=KEY)
    data = a_packet(codec)
    assert passes(codec, data) is not None
    assert not any(passes(codec, flipped(data, bit)) for bit in range(8 * len(data)))
    assert not any(passes(codec, data[:length]) for length in range(len(data)))
    for frame, start_s in ((1024, 0.0), (0, 6.0)):
        with pytest.raises(PeerFault):
            codec.decode(data, frame, start_s)


def test_a_fleet_with_a_key_works_as_one_without():
    fleets = [ManagerFleet(3, "ack", codec=codec) for codec in (guarded(), guarded(32, KEY))]
    for fleet in fleets:
        uids = [fleet.maps(node, node) for node in range(3)]
        fleet.pass_frames(3)
        assert all(fleet.holders(uid) == [0, 1, 2] for uid in uids)
        assert not fleet.false_beliefs
    plain, sealed = ([said._replace(data=b"", size_bits=0) for said in fleet.said] for fleet in fleets)
    assert plain == sealed


@given(st.sets(st.tuples(st.integers(0, 63), st.integers(0, 3), st.integers(0, 10**6)), max_size=30))
def test_no_nonce_is_used_twice(sent: set[tuple[int, int, int]]):
    """By sender, epoch and frame; a slot of 1.7 s."""
    nonces = [nonce_of(*who, frame, 1.7 * (64 * frame + who[0]), b"\1\2\3\4") for *who, frame in sent]
    assert len(set(nonces)) == len(sent)
    assert {len(nonce) for nonce in nonces} <= {13}


def test_a_key_of_no_such_size_is_refused():
    with pytest.raises(ConfigurationError, match="5 bytes; allowed: 16, 24, 32"):
        Seal(b"short")


def test_without_the_library_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "cryptography.hazmat.primitives.ciphers.aead", None)
    with pytest.raises(ConfigurationError, match=r"remoras-sim\[crypto\]"):
        Seal(KEY)


@pytest.mark.parametrize(
    ("text", "why"),
    [("not a key", "hexadecimal digits alone"), ("00ff", "it holds 4 hexadecimal digits; allowed: 32, 48, 64")],
)
def test_a_file_without_a_key_is_refused_and_its_content_never_told(tmp_path: Path, text: str, why: str):
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


@pytest.mark.parametrize(("crc_bits", "key"), [(8, None), (32, None), (0, KEY), (16, KEY)])
def test_noise_is_a_peers_fault_at_most(crc_bits: int, key: bytes | None):
    """Every second string has a fitting first byte, to get past the door."""
    codec, dice = guarded(crc_bits, key), random.Random(7)
    first = a_packet(codec)[:1]
    for number in range(4000):
        noise = dice.randbytes(dice.randrange(65))
        data = first + noise[1:] if number % 2 else noise
        try:
            codec.head(data)
        except PeerFault:
            pass
        else:
            passes(codec, data)
