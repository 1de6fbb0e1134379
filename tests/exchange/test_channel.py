"""The broadcast channel: when a packet is heard, by whom, and that chance knows nothing of what is said."""

import itertools
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


def test_a_short_packet_arrives_earlier_and_colder_water_delays_it():
    short = BroadcastChannel(MODEM, Perfect(), seed=1).transmit(0, 0, bytes(20), 0.0, SQUARE_M)
    assert short[1].time_s == pytest.approx(160 / 463 + 0.6)
    slow = BroadcastChannel(MODEM, Perfect(), seed=1, sound_speed_mps=1440.0).transmit(0, 0, bytes(20), 0.0, SQUARE_M)
    assert slow[1].time_s - short[1].time_s == pytest.approx(900 / 1440 - 900 / 1500)


def test_the_head_of_a_packet_takes_its_time():
    """Benthos: one second before the payload, 64 B at 800 bit/s."""
    channel = BroadcastChannel(modems()["atm-900"], Perfect(), seed=1)
    assert channel.transmit(0, 0, bytes(64), 0.0, TOGETHER_M)[0].time_s == pytest.approx(1.0 + 0.64)


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
    schedule = TdmaSchedule(n_nodes, MODEM.packet_s(MODEM.payload_bits), range_m / speed_mps)
    channel = BroadcastChannel(MODEM, Perfect(), 1, sound_speed_mps=speed_mps, range_m=range_m)
    places = [(0.0, 0.0), (0.0, share * range_m)]
    (arrival,) = channel.transmit(slot, 0, bytes(MODEM.payload_bytes), schedule.start_s(slot), places)
    assert schedule.slot_at(arrival.time_s) == slot


def test_the_guard_suffices_at_the_end_of_the_range_too():
    """The channel carries to 1000 m, the border included."""
    schedule = TdmaSchedule(4, MODEM.packet_s(MODEM.payload_bits), 1000.0 / 1500.0)
    channel = BroadcastChannel(MODEM, Perfect(), 1, range_m=1000.0)
    heard_in = []
    for slot in range(200):
        start_s = schedule.start_s(slot)
        (arrival,) = channel.transmit(slot, 0, bytes(MODEM.payload_bytes), start_s, [(0.0, 0.0), (1000.0, 0.0)])
        heard_in.append(schedule.slot_of_arrival(arrival.time_s))
    assert heard_in == list(range(200))


@pytest.mark.parametrize("per", [0.05, 0.2, 0.5, 0.9])
def test_losses_are_as_frequent_as_they_should_be(per: float):
    """Four standard errors of 12 000 independent draws."""
    n_slots = 4000
    share = len(lost(BroadcastChannel(MODEM, Bernoulli(per), seed=3), n_slots)) / (3 * n_slots)
    assert abs(share - per) < 4.0 * math.sqrt(per * (1.0 - per) / (3 * n_slots))


def test_receivers_lose_independently():
    """Of 3 receivers at PER 0.5 all three lose together in one packet of eight, within four standard errors."""
    n_slots = 4000
    slots = [slot for slot, _ in lost(BroadcastChannel(MODEM, Bernoulli(0.5), seed=5), n_slots)]
    together = sum(slots.count(slot) == 3 for slot in set(slots)) / n_slots
    assert abs(together - 0.125) < 4.0 * math.sqrt(0.125 * 0.875 / n_slots)


def test_what_is_lost_at_one_rate_is_lost_at_every_higher_one():
    """The draw is compared with the rate afterwards, so runs at different rates are paired."""
    losses = [lost(BroadcastChannel(MODEM, Bernoulli(per), seed=1), 500) for per in (0.0, 0.2, 0.4, 0.8)]
    assert losses[0] == set()
    assert all(fewer < more for fewer, more in itertools.pairwise(losses))


def test_chance_knows_nothing_of_content_size_time_or_place():
    channel = BroadcastChannel(MODEM, Bernoulli(0.4), seed=9)
    for slot in range(100):
        receivers = {
            tuple(arrival.receiver for arrival in channel.transmit(slot, 0, data, now_s, places))
            for data, now_s, places in [
                (b"", 0.0, TOGETHER_M),
                (bytes(64), 1e5, SQUARE_M),
                (b"\xff" * 13, 3.0, [(9.0 * node, 1.0) for node in range(4)]),
            ]
        }
        assert len(receivers) == 1


def test_seeds_and_trials_have_losses_of_their_own():
    of = [
        lost(BroadcastChannel(MODEM, Bernoulli(0.4), seed=seed, trial=trial), 200)
        for seed, trial in [(1, 0), (1, 1), (2, 0), (2, 1)]
    ]
    assert all(one != other for number, one in enumerate(of) for other in of[number + 1 :])
    assert lost(BroadcastChannel(MODEM, Bernoulli(0.4), seed=1), 200) == of[0]


# Blackouts ----------------------------------------------------------------------------------------


@given(st.floats(0.0, 100.0), st.floats(0.1, 100.0), st.floats(0.0, 200.0), st.sampled_from([None, 0, 1, 2, 3]))
def test_a_node_that_is_blacked_out_is_neither_heard_nor_hears(
    from_s: float, lasts_s: float, now_s: float, node: int | None
):
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
def test_nothing_passes_between_the_sides_of_a_cut_and_all_else_does(
    side_of: list[int], from_s: float, lasts_s: float, now_s: float, sender: int
):
    sides = tuple(frozenset(node for node in range(4) if side_of[node] == side) for side in (1, 2))
    cut = Blackout(from_s, from_s + lasts_s, between=sides)
    channel = BroadcastChannel(MODEM, Perfect(), 1, blackouts=(cut,))
    heard = {arrival.receiver for arrival in channel.transmit(0, sender, b"x", now_s, TOGETHER_M)}
    parted = {node for node in range(4) if {side_of[node], side_of[sender]} == {1, 2}}
    lasts = from_s <= now_s < from_s + lasts_s
    assert heard == set(range(4)) - {sender} - (parted if lasts else set())


@given(SIDES)
def test_a_cut_changes_no_loss_within_its_sides(side_of: list[int]):
    sides = tuple(frozenset(node for node in range(4) if side_of[node] == side) for side in (1, 2))
    cut = BroadcastChannel(MODEM, Bernoulli(0.4), seed=1, blackouts=(Blackout(0.0, 1e6, between=sides),))
    across = {(slot, node) for slot in range(24) for node in range(4) if {side_of[node], side_of[slot % 4]} == {1, 2}}
    assert lost(cut, 24) == lost(BroadcastChannel(MODEM, Bernoulli(0.4), seed=1), 24) | across


def test_cuts_add_up_with_blackouts_of_vehicles_and_may_have_three_sides():
    three = Blackout(0.0, 20.0, between=(frozenset((0,)), frozenset((1, 2)), frozenset((3,))))
    channel = BroadcastChannel(MODEM, Perfect(), 1, blackouts=(three, Blackout(10.0, 30.0, 2)))
    heard = [
        [[arrival.receiver for arrival in channel.transmit(0, node, b"x", t_s, TOGETHER_M)] for node in range(4)]
        for t_s in (5.0, 15.0, 25.0)
    ]
    assert heard == [[[], [2], [1], []], [[], [], [], []], [[1, 3], [0, 3], [], [0, 1]]]


def test_a_blackout_changes_no_loss_outside_of_it():
    plain = lost(BroadcastChannel(MODEM, Bernoulli(0.4), seed=1), 200)
    cut = lost(BroadcastChannel(MODEM, Bernoulli(0.4), seed=1, blackouts=(Blackout(100.0, 200.0),)), 200)
    inside = {(slot, node) for slot in range(50, 100) for node in range(4) if node != slot % 4}  # a slot each 2 s
    assert cut == plain | inside


def test_the_fate_of_a_packet_is_the_draw_of_its_sender_and_receiver():
    channel = BroadcastChannel(MODEM, Bernoulli(0.5), seed=3, trial=2)
    drawn = {
        (slot, receiver)
        for slot in range(64)
        for receiver in range(4)
        if receiver != slot % 4 and uniform(3, 2, slot, slot % 4, receiver) < 0.5
    }
    assert lost(channel, 64) == drawn
