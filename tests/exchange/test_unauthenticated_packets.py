"""Under a key, unauthenticated bytes change no belief; salt handshakes leave capacity in all frames."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_packet_security import KEY
from test_salt_handshake import SCHEDULE, Process, mission

from benchmarks.manager_fleet import DURATION_S, N_BLOCKS, TBOX, ManagerFleet, cells, instances
from exchange.packets import Fragment
from exchange.policy.policies import POLICIES
from exchange.wire.codec import Codec, Framing
from exchange.wire.fragmentcodec import EPOCH_BITS


class Keyed(ManagerFleet):
    """Three vehicles with a key."""

    def __init__(self) -> None:
        framing = Framing(0, KEY)
        codec = Codec(TBOX, len(instances(3)), 3, POLICIES["ack"], N_BLOCKS, DURATION_S, framing=framing)
        super().__init__(3, codec=codec)

    def spoken(self, frame: int, epoch: int = 0) -> bytes:
        """A packet of node 0 with an item."""
        start_s, items = self.schedule.start_s(3 * frame), [Fragment(0, frame, 0.0, cells(3, 1), epoch=epoch)]
        return self.codec.encode(0, 0, items, frame=frame, epoch=epoch, slot_start_s=start_s)

    def hears(self, data: bytes, frame: int) -> bool:
        """True if node 1 takes it in the slot of node 0."""
        return self.deliver(1, data, self.schedule.start_s(3 * frame) + 1.0).fault is None


@given(st.lists(st.binary(min_size=1, max_size=64) | st.integers(0, 255), max_size=12), st.integers(1, 255))
def test_noise_changes_no_belief_about_a_peer(noise: list[bytes | int], epoch: int) -> None:
    """Random bytes, and a true packet whose clear first byte is another, before each packet; another life, too."""
    fleet = Keyed()
    for frame, one in enumerate(noise):
        true = fleet.spoken(frame)
        junk = bytes([one ^ true[0] ^ 1]) + true[1:] if isinstance(one, int) else one
        fleet.hears(junk if junk != true else b"", frame)
        assert not any(reception.is_stranger for reception in fleet.heard[1])
        assert fleet.hears(true, frame)
    assert fleet.hears(fleet.spoken(len(noise), epoch), len(noise))
    assert fleet.managers[1].knows_life(0, epoch)
    assert epoch >> EPOCH_BITS or not noise or fleet.managers[1].n_faults == len(noise)


@pytest.mark.parametrize("known", [True, False])
def test_forged_noise_triggers_a_salt_handshake_only_if_the_salt_is_missing(known: bool) -> None:
    processes, _ = mission(1, 0.0, {}, frames=10 if known else 0)
    spoken = [processes[0].introductions.packet(slot) for slot in range(30, 60, 3)]
    for slot in range(60, 120, 3):
        processes[0].introductions.miss(1)
        spoken.append(processes[0].introductions.packet(slot))
    assert (sum(data is not None for data in spoken) > 2) is not known


@given(st.lists(st.integers(0, 1), min_size=1, max_size=60))
def test_consecutive_salt_handshakes_alternate_frame_parity(missed: list[int]) -> None:
    """So what goes in the frames between is in even and in odd ones, however often a packet is missed."""
    process = Process(0, bytes(8))
    made = []
    for frame, is_missed in enumerate(missed):
        if is_missed:
            process.introductions.miss(1)
        if process.introductions.packet(SCHEDULE.n_nodes * frame) is not None:
            made.append(frame)
    assert made[0] == 0
    assert all((later - earlier) % 2 == 1 for earlier, later in pairwise(made))
    assert all(later - earlier >= 3 for earlier, later in pairwise(made[1:]))
