"""Who sends when, on the air: ALOHA by what theory says, TDMA without a collision, and slots that groups share."""

import math

import pytest

from exchange.acoustics.channel import Arrival, BroadcastChannel
from exchange.acoustics.collisions import Collisions
from exchange.acoustics.loss import uniform
from exchange.acoustics.models import Bernoulli
from exchange.acoustics.modems import modems
from exchange.schedule import TdmaSchedule
from remoras.traffic import sends_s

SEED, FRAMES, STEPS = 5, 4000, 1000


def aloha(n_nodes: int) -> TdmaSchedule:
    """Packets of length 1 in a frame of 1.5 N."""
    return TdmaSchedule(n_nodes, 1.0, 0.5, is_aloha=True)


def share_received(starts_s: list[tuple[float, int]], n_nodes: int) -> tuple[float, float]:
    """Share of packets that a receiver next to all hears, and its standard error: packets are lost in twos."""
    air, heard = Collisions(), []
    for number, (at_s, node) in enumerate(sorted(starts_s)):
        heard += air.send(number, node, at_s, at_s + 1.0, [Arrival(n_nodes, at_s + 1.0, b"")])[0]
    share = sum(not one.collided for one in heard) / len(heard)
    return share, 2.0 * math.sqrt(share * (1.0 - share) / len(heard))


def mean(of: list[float]) -> float:
    return sum(of) / len(of)


@pytest.mark.parametrize(("n_nodes", "drawn"), [(2, 0.246), (4, 0.276), (8, 0.265)])
def test_share_received_in_aloha_is_what_can_be_reckoned(n_nodes: int, drawn: float) -> None:
    """A start in [0, L], L = 1.5 N - 1, is clear of another with the share of [0, L] that is not within 1 s of it.

    Packets end in their frame, so frames do not touch. The mean of that share to the power N - 1 is 0.25 for N = 2.
    ``drawn`` is of an independent simulation.
    """
    last_s = 1.5 * n_nodes - 1.0
    starts_s = [last_s * (step + 0.5) / STEPS for step in range(STEPS)]
    clear = [(last_s - min(1.0, at_s) - min(1.0, last_s - at_s)) / last_s for at_s in starts_s]
    expected = mean([one ** (n_nodes - 1) for one in clear])
    schedule = aloha(n_nodes)
    slots = [(frame * n_nodes + node, node) for frame in range(FRAMES) for node in range(n_nodes)]
    share, error = share_received([(sends_s(schedule, slot, node, SEED), node) for slot, node in slots], n_nodes)
    assert abs(share - expected) < 4.0 * error
    assert abs(share - drawn) < 4.0 * error
    assert abs(expected - math.exp(-2.0 / 1.5)) < 0.02  # e^(-2G), what it tends to for many nodes


@pytest.mark.parametrize(("n_nodes", "drawn"), [(2, 0.380), (4, 0.309), (8, 0.283)])
def test_share_received_if_packets_start_anywhere_is_what_can_be_reckoned(n_nodes: int, drawn: float) -> None:
    """Of another node no start lies within 1 s: those of this frame, and near its border those of the next.

    With the frame F = 1.5 N: 1 - 2/F more than 1 s from a border; t < 1 s from it (F - 1 - t)/F (F - 1 + t)/F. A
    receiver that tells packets of one sender apart is assumed, so a node's own packets do not meet.
    """
    frame_s, others = 1.5 * n_nodes, n_nodes - 1
    near = [(((frame_s - 1.0) ** 2 - ((step + 0.5) / STEPS) ** 2) / frame_s**2) ** others for step in range(STEPS)]
    expected = (1.0 - 2.0 / frame_s) * (1.0 - 2.0 / frame_s) ** others + 2.0 / frame_s * mean(near)
    starts_s = [
        [frame_s * (frame + uniform(SEED, 99, frame, node, 0)) for frame in range(FRAMES)] for node in range(n_nodes)
    ]
    n_clear = 0
    for node in range(n_nodes):
        for frame, at_s in enumerate(starts_s[node]):
            around = range(max(0, frame - 1), min(FRAMES, frame + 2))
            n_clear += all(
                abs(starts_s[other][one] - at_s) >= 1.0 for other in range(n_nodes) if other != node for one in around
            )
    share = n_clear / (n_nodes * FRAMES)
    error = 2.0 * math.sqrt(share * (1.0 - share) / (n_nodes * FRAMES))
    assert abs(share - expected) < 4.0 * error
    assert abs(share - drawn) < 4.0 * error


@pytest.mark.parametrize("n_nodes", [2, 4, 8])
def test_by_tdma_all_is_received(n_nodes: int) -> None:
    schedule = TdmaSchedule(n_nodes, 1.0, 0.5)
    starts_s = [(sends_s(schedule, slot, slot % n_nodes, SEED), slot % n_nodes) for slot in range(200 * n_nodes)]
    assert share_received(starts_s, n_nodes)[0] == 1.0


def test_times_of_aloha_are_in_their_frame_and_differ_from_seed_to_seed() -> None:
    schedule = aloha(3)
    for slot in range(60):
        at_s = sends_s(schedule, slot, slot % 3, SEED)
        assert 0.0 <= at_s - schedule.frame_start_s(slot // 3) <= schedule.frame_s - 1.0
        assert at_s != sends_s(schedule, slot, slot % 3, SEED + 1)
        assert at_s == sends_s(schedule, slot, slot % 3, SEED)


def heard_by_each(slots: tuple[tuple[int, ...], ...], apart_m: float, frames: int = 50) -> list[int]:
    """Packets that each of two groups of two hears within itself in so many frames; the groups are so far apart."""
    modem = modems()["nanomodem-v3"]
    packet_s = modem.packet_s(modem.payload_bits)
    schedule = TdmaSchedule(4, packet_s, 1000.0 / 1500.0, slots)
    channel = BroadcastChannel(modem, Bernoulli(0.0), seed=5, range_m=1000.0)
    places = [(0.0, 0.0), (300.0, 0.0), (apart_m, 0.0), (apart_m + 300.0, 0.0)]
    data, air, hearings = bytes(modem.payload_bits // 8), Collisions(), []
    for slot in range(frames * len(slots)):
        at_s = schedule.start_s(slot)
        for sender in slots[slot % len(slots)]:
            arrivals = channel.transmit(slot, sender, data, at_s, places)
            hearings += air.send(slot, sender, at_s, at_s + packet_s, arrivals)[0]
    within = [one for one in hearings if not one.collided and one.sender // 2 == one.arrival.receiver // 2]
    return [sum(one.sender // 2 == group for one in within) for group in (0, 1)]


def test_groups_out_of_range_that_share_slots_have_each_the_throughput_of_one_alone() -> None:
    alone, shared = ((0,), (1,)), ((0, 2), (1, 3))
    assert heard_by_each(alone, 5000.0) == [100, 0]
    assert heard_by_each(shared, 5000.0) == [100, 100]
    apart = ((0,), (1,), (2,), (3,))
    assert heard_by_each(apart, 5000.0, frames=25) == [50, 50]  # as many slots, and half as much


def test_groups_within_range_that_share_slots_collide() -> None:
    assert heard_by_each(((0, 2), (1, 3)), 500.0) == [0, 0]
