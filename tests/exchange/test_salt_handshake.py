"""Salt handshakes: after any losses all processes decrypt all others, and old packets are refused."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_packet_security import KEY, guarded

from exchange.errors import ConfigurationError, PeerFault
from exchange.packets import Packet
from exchange.schedule import TdmaSchedule
from exchange.wire.codec import renewed
from exchange.wire.definitions import Introductions
from exchange.wire.sealing import SALT_BYTES, Seal

BASE = guarded(key=KEY)
SCHEDULE = TdmaSchedule(3, 1.0, 0.5)


class Process:
    """One vehicle process: sends a salt handshake, else an empty packet."""

    def __init__(self, me: int, salt: bytes, payload_bits: int = 512) -> None:
        self.me, self.n_packets = me, 0
        self.introductions = Introductions(me, KEY, salt, BASE, SCHEDULE, payload_bits, 1.0)
        self.codec = renewed(BASE, self.introductions.salt_of)
        self.opened: list[Packet] = []
        self.known: set[int] = set()

    def speak(self, slot: int) -> bytes:
        data = self.introductions.packet(slot)
        if data is None:
            self.n_packets += 1
            frame = SCHEDULE.frame_of(slot)
            data = self.codec.encode(self.me, 0, frame=frame, slot_start_s=SCHEDULE.start_s(slot))
        return data

    def hear(self, data: bytes, slot: int) -> None:
        if self.introductions.hear(data, SCHEDULE.start_s(slot) + 1.2):
            return
        try:
            packet = self.codec.decode(data, SCHEDULE.frame_of(slot), SCHEDULE.start_s(slot)).packet
        except PeerFault:
            self.introductions.miss(slot % 3)
            return
        self.opened.append(packet)
        self.known.add(packet.sender)


def mission(
    seed: int, per: float, restarts: dict[int, int], payload_bits: int = 512, frames: int = 20
) -> tuple[list[Process], list[tuple[int, bytes]]]:
    """The processes at the end, and all packets with their slots; ``restarts`` begins a node anew at a slot."""
    dice = random.Random(seed)
    processes = [Process(node, dice.randbytes(SALT_BYTES), payload_bits=payload_bits) for node in range(3)]
    sent = []
    for slot in range(3 * frames):
        if slot in restarts:
            node = restarts[slot]
            processes[node] = Process(node, dice.randbytes(SALT_BYTES), payload_bits=payload_bits)
        data = processes[slot % 3].speak(slot)
        sent.append((slot, data))
        for other in processes:
            if other.me != slot % 3 and dice.random() >= per:
                other.hear(data, slot)
    return processes, sent


SEEDS = st.integers(0, 2**32)


@settings(max_examples=30)
@given(
    SEEDS,
    st.sampled_from([0.0, 0.3, 0.5]),
    st.dictionaries(st.integers(0, 30), st.integers(0, 2), max_size=4),
    st.sampled_from([248, 512]),
)
def test_after_losses_and_restarts_all_processes_decrypt_each_other(seed, per, restarts, payload_bits):
    """At 50 % one of four pairs of slots, a complaint and its answer, passes: of 49 such pairs none with 8e-7."""
    processes, _ = mission(seed, per, restarts, payload_bits, 150)
    assert all(one.known == {0, 1, 2} - {one.me} for one in processes)
    assert all(one.n_packets >= 40 for one in processes)  # introductions leave room for what there is to tell


@settings(max_examples=30)
@given(SEEDS, st.sampled_from([0.0, 0.3]), st.sampled_from(range(3)))
def test_packets_of_an_earlier_mission_do_not_decrypt(seed: int, per: float, victim: int) -> None:
    """One that was not there yesterday, or has lost all it knew, hears all of yesterday in its slots before today."""
    _, yesterday = mission(seed, per, {})
    today = Process(victim, random.Random(seed + 1).randbytes(SALT_BYTES))
    for slot, data in yesterday:
        if slot % 3 == victim:
            today.speak(slot)
        else:
            today.hear(data, slot)
    assert today.opened == []
    assert {node: today.introductions.salt_of(node) is None for node in range(3)} == {n: n != victim for n in range(3)}


@settings(max_examples=30)
@given(SEEDS)
def test_replayed_packets_of_this_mission_are_refused(seed: int) -> None:
    """An introduction of the first life of a peer, four frames later and after its second began, changes nothing."""
    processes, sent = mission(seed, 0.0, {30: 0})
    before = [one.introductions.salt_of(0) for one in processes]
    for slot, data in sent[:30]:
        for one in processes:
            assert not one.introductions.hear(data, SCHEDULE.start_s(slot + 180) + 1.2)
    assert [one.introductions.salt_of(0) for one in processes] == before


@given(st.randoms(use_true_random=False))
def test_altered_salt_handshakes_are_refused_and_noise_raises_nothing(dice: random.Random) -> None:
    own, peer = Process(0, bytes(8)), Process(1, bytes(range(8)))
    data = peer.introductions.packet(1)
    assert data is not None
    word = int.from_bytes(data, "big") ^ 1 << dice.randrange(8 * len(data))
    assert not own.introductions.hear(word.to_bytes(len(data), "big"), SCHEDULE.start_s(1) + 1.2)
    assert not own.introductions.hear(dice.randbytes(dice.randrange(65)), SCHEDULE.start_s(1) + 1.2)
    assert own.introductions.hear(data, SCHEDULE.start_s(1) + 1.2)


def test_a_packet_size_too_small_for_a_salt_handshake_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="20 bytes has no room for the 24 by which"):
        Process(0, bytes(8), payload_bits=160)


def test_each_sender_has_a_key_of_its_own() -> None:
    """What one has sealed does not open as that of another, with the same nonce and salt."""
    seal, nonce = Seal(KEY, lambda sender: bytes(8)), bytes(13)
    sealed = seal.sealed(0, b"head", b"body", nonce)
    assert seal.opened(0, b"head", sealed, nonce) == b"body"
    with pytest.raises(PeerFault, match="cannot be opened"):
        seal.opened(1, b"head", sealed, nonce)
