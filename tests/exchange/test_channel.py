"""The broadcast channel: when a packet is heard, by whom, and that chance knows nothing of what is said."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.acoustics.channel import Blackout, BroadcastChannel
from exchange.acoustics.link import Bernoulli, Perfect
from exchange.acoustics.loss import uniform
from exchange.acoustics.modems import modems
from exchange.schedule import TdmaSchedule

MODEM = modems()["nanomodem-v3"]
SQUARE_M = [(0.0, 0.0), (300.0, 400.0), (-900.0, 0.0), (0.0, 1500.0)]
TOGETHER_M = [(0.0, 0.0)] * 4


def lost(channel: BroadcastChannel, n_slots: int, size_bytes: int = 20) -> set[tuple[int, int]]:
    """(slot, receiver) of every loss among four vehicles in one place."""
    pairs = {(slot, receiver) for slot in range(n_slots) for receiver in range(4) if receiver != slot % 4}
    heard = {
        (slot, arrival.receiver)
        for slot in range(n_slots)
        for arrival in channel.transmit(slot, slot % 4, bytes(size_bytes), 2.0 * slot, TOGETHER_M)
    }
    return pairs - heard


def test_a_packet_is_complete_after_its_duration_and_the_way():
    """64 B at 463 bit/s last 1.1058 s; 500 m at 1500 m/s take 0.3333 s, 900 m 0.6 s and 1500 m 1 s."""
    arrivals = BroadcastChannel(MODEM, Perfect(), seed=1).transmit(0, 0, bytes(64), 10.0, SQUARE_M)
    assert [arrival.receiver for arrival in arrivals] == [1, 2, 3]
    expected_s = [10.0 + 512 / 463 + 1 / 3, 10.0 + 512 / 463 + 0.6, 10.0 + 512 / 463 + 1.0]
    assert [arrival.time_s for arrival in arrivals] == pytest.approx(expected_s, rel=1e-12)
    assert {arrival.data for arrival in arrivals} == {bytes(64)}


def test_beyond_its_range_nobody_hears_and_at_its_range_everybody():
    channel = BroadcastChannel(MODEM, Perfect(), seed=1, range_m=900.0)
    assert [arrival.receiver for arrival in channel.transmit(0, 0, b"x", 0.0, SQUARE_M)] == [1, 2]
    just_short = BroadcastChannel(MODEM, Perfect(), seed=1, range_m=math.nextafter(900.0, 0.0))
    assert [arrival.receiver for arrival in just_short.transmit(0, 0, b"x", 0.0, SQUARE_M)] == [1]


@given(
    st.integers(2, 20),
    st.floats(50.0, 10_000.0),
    st.floats(1400.0, 1600.0),
    st.floats(0.0, 0.999),
    st.integers(0, 100_000),
)
def test_the_guard_suffices_within_range(n_nodes: int, range_m: float, speed_mps: float, share: float, slot: int):
    """Even the longest packet is complete, wherever the receiver is, before the next slot opens."""
    schedule = TdmaSchedule.for_range(n_nodes, MODEM.packet_s(MODEM.payload_bits), range_m, speed_mps)
    channel = BroadcastChannel(MODEM, Perfect(), 1, sound_speed_mps=speed_mps, range_m=range_m)
    places = [(0.0, 0.0), (0.0, share * range_m)]
    (arrival,) = channel.transmit(slot, 0, bytes(MODEM.payload_bytes), schedule.start_s(slot), places)
    assert schedule.slot_at(arrival.time_s) == slot


def test_the_guard_suffices_at_the_end_of_the_range_too():
    """The channel carries to 1000 m, the border included."""
    schedule = TdmaSchedule.for_range(4, MODEM.packet_s(MODEM.payload_bits), 1000.0, 1500.0)
    channel = BroadcastChannel(MODEM, Perfect(), 1, range_m=1000.0)
    heard_in = []
    for slot in range(200):
        start_s = schedule.start_s(slot)
        (arrival,) = channel.transmit(slot, 0, bytes(MODEM.payload_bytes), start_s, [(0.0, 0.0), (1000.0, 0.0)])
        heard_in.append(schedule.slot_of_arrival(arrival.time_s))
    assert heard_in == list(range(200))


# Blackouts ----------------------------------------------------------------------------------------


@given(st.floats(0.0, 100.0), st.floats(0.1, 100.0), st.floats(0.0, 200.0), st.sampled_from([None, 0, 1, 2, 3]))
def test_a_node_that_is_blacked_out_is_neither_heard_nor_hears(from_s, lasts_s, now_s, node):
    channel = BroadcastChannel(MODEM, Perfect(), 1, blackouts=(Blackout(from_s, from_s + lasts_s, node),))
    heard = {arrival.receiver for arrival in channel.transmit(0, 0, b"x", now_s, TOGETHER_M)}
    if not from_s <= now_s < from_s + lasts_s:
        assert heard == {1, 2, 3}
    elif node in (None, 0):
        assert heard == set()
    else:
        assert heard == {1, 2, 3} - {node}


def test_a_blackout_holds_from_its_start_to_just_before_its_end_and_two_of_them_add_up():
    blackouts = (Blackout(10.0, 20.0, 1), Blackout(15.0, 30.0, 2))
    channel = BroadcastChannel(MODEM, Perfect(), 1, blackouts=blackouts)
    times_s = [math.nextafter(10.0, 0.0), 10.0, 15.0, math.nextafter(20.0, 0.0), 20.0, 30.0]
    heard = [[arrival.receiver for arrival in channel.transmit(0, 0, b"x", t_s, TOGETHER_M)] for t_s in times_s]
    assert heard == [[1, 2, 3], [2, 3], [3], [3], [1, 3], [1, 2, 3]]


SIDES = st.lists(st.integers(0, 2), min_size=4, max_size=4)
"""For each node its side, 0 for none."""


@given(SIDES, st.floats(0.0, 100.0), st.floats(0.1, 100.0), st.floats(0.0, 200.0), st.integers(0, 3))
def test_nothing_passes_between_the_sides_of_a_cut_and_all_else_does(side_of, from_s, lasts_s, now_s, sender):
    sides = tuple(frozenset(node for node in range(4) if side_of[node] == side) for side in (1, 2))
    cut = Blackout(from_s, from_s + lasts_s, between=sides)
    channel = BroadcastChannel(MODEM, Perfect(), 1, blackouts=(cut,))
    heard = {arrival.receiver for arrival in channel.transmit(0, sender, b"x", now_s, TOGETHER_M)}
    parted = {node for node in range(4) if {side_of[node], side_of[sender]} == {1, 2}}
    lasts = from_s <= now_s < from_s + lasts_s
    assert heard == set(range(4)) - {sender} - (parted if lasts else set())


def test_the_fate_of_a_packet_is_the_draw_of_its_sender_and_receiver():
    channel = BroadcastChannel(MODEM, Bernoulli(0.5), seed=3, trial=2)
    drawn = {
        (slot, receiver)
        for slot in range(64)
        for receiver in range(4)
        if receiver != slot % 4 and uniform(3, 2, slot, slot % 4, receiver) < 0.5
    }
    assert lost(channel, 64) == drawn
