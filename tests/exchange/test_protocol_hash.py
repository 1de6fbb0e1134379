"""Peers with another protocol definition: detected within four frames, and never misread afterwards."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.manager_fleet import DURATION_S, N_BLOCKS, TBOX, ManagerFleet, cells, instances
from exchange.errors import PeerFault
from exchange.packets import Fragment, Reception
from exchange.policy.policies import POLICIES
from exchange.wire.codec import Codec
from exchange.wire.definitions import ComparedDefinitions


def stranger_codec(n_items: int) -> Codec:
    """Of a fleet of three that may tell another number of items."""
    return Codec(TBOX, len(instances(3)), 3, POLICIES["ack"], n_items, DURATION_S)


def heard_of(codec: Codec, n_frames: int) -> ManagerFleet:
    """A fleet of which node 1 hears, in the slots of node 0, somebody with that codec, with an item in every packet."""
    fleet = ManagerFleet(3)
    for frame in range(n_frames):
        data = codec.encode(0, 0, [Fragment(0, frame, 0.0, cells(3, 1))], frame=frame)
        fleet.deliver(1, data, fleet.schedule.start_s(3 * frame) + 1.0)
    return fleet


def test_an_incompatible_peer_is_one_event_and_its_packets_are_refused():
    fleet = heard_of(stranger_codec(N_BLOCKS + 1), 12)
    assert [reception.is_stranger for reception in fleet.heard[1]] == [True] + [False] * 11
    assert all(reception.fault for reception in fleet.heard[1])
    assert fleet.managers[1].n_faults == 12
    assert list(fleet.models[1].blocks()) == []


def test_a_peer_is_accepted_again_when_a_damaged_hash_byte_agrees():
    definitions = ComparedDefinitions()
    assert definitions.differ(2, frame=5)
    for frame in (6, 7, 8):
        with pytest.raises(PeerFault, match="node 2 uses another TBox"):
            definitions.agree(2, frame)
    definitions.agree(2, frame=9)
    definitions.agree(2, frame=10)


def in_epoch(fleet: ManagerFleet, epoch: int, frame: int) -> Reception:
    """Node 1 receives a packet of node 0 in one of its epochs."""
    data = fleet.codec.encode(0, 0, [Fragment(0, 0, 0.0, cells(3, 1), epoch=epoch)], frame=frame, epoch=epoch)
    return fleet.deliver(1, data, fleet.schedule.start_s(3 * frame) + 1.0)


@pytest.mark.parametrize("later", [4, 5, 12])
def test_a_new_incarnation_of_a_known_peer_needs_four_hash_bytes(later: int):
    """The next one, too: the byte of an old packet may be right for it."""
    fleet = ManagerFleet(3)
    for frame in range(4):
        assert in_epoch(fleet, 3, frame).fault is None
    heard = [in_epoch(fleet, later, frame) for frame in (4, 5, 8, 10, 11)]
    assert [reception.fault is None for reception in heard] == [False] * 4 + [True]
    assert not any(reception.is_stranger for reception in heard)
    assert fleet.managers[1].knows_life(0, later)
    assert in_epoch(fleet, later + 1, 12).fault is None


def test_hash_bytes_of_an_unknown_incarnation_do_not_add_up():
    """Three, the known era, another three: neither damage nor old packets add up to another life."""
    fleet = ManagerFleet(3)
    for frame in range(4):
        in_epoch(fleet, 0, frame)
    for first in (4, 9, 14):
        assert all(in_epoch(fleet, 4, frame).fault for frame in range(first, first + 3))
        assert in_epoch(fleet, 0, first + 3).fault is None
    assert not fleet.managers[1].knows_life(0, 4)


def test_a_packet_replayed_in_another_frame_is_always_refused():
    """Each of 32 packets of a known peer, up to 64 times four frames later; the byte of some is right for an era."""
    fleet, n_eras = ManagerFleet(3), 0
    for frame in range(4):
        in_epoch(fleet, 0, frame)
    for sent in range(32):
        data = fleet.codec.encode(0, 0, [Fragment(0, 0, 0.0, cells(3, 1))], frame=sent)
        for frame in range(sent + 4, sent + 4 * 64, 4):
            n_eras += fleet.codec.era_of(data, frame) is not None
            assert fleet.deliver(1, data, fleet.schedule.start_s(3 * frame) + 1.0).fault
    assert n_eras > 100
    assert not any(fleet.managers[1].knows_life(0, epoch) for epoch in range(1, 256))


def test_the_first_incarnation_of_a_peer_needs_four_hash_bytes():
    fleet = ManagerFleet(3)
    heard = [in_epoch(fleet, 21, frame) for frame in (0, 1, 2, 5, 6, 7, 8)]
    assert [reception.fault is None for reception in heard] == [False, False, False, False, False, True, True]
    assert not any(reception.is_stranger for reception in heard)
    assert fleet.managers[1].knows_life(0, 21)


@given(st.sets(st.integers(0, 3), min_size=1), st.lists(st.integers(0, 40), min_size=1))
def test_a_differing_hash_byte_invalidates_all_packets_of_the_peer(differing: set[int], frames: list[int]):
    """Whichever bytes differ and in whichever frames it is heard."""
    definitions, noticed = ComparedDefinitions(), False
    for frame in frames:
        if frame % 4 in differing:
            definitions.differ(1, frame)
            noticed = True
        elif noticed:
            with pytest.raises(PeerFault):
                definitions.agree(1, frame)
        else:
            definitions.agree(1, frame)
