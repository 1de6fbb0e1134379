"""Half duplex and collisions: overlapping time spans at each receiver, from the geometry."""

import math

import pytest

from exchange.channel.channel import Arrival, Collisions
from exchange.channel.loss import uniform

LENGTH_S = 1.0


def sent(air: Collisions, slot: int, sender: int, at_s: float, delays_s: dict[int, float]) -> list[bool]:
    """Which receivers lose a packet of 1 s, by all that is known when it sets out."""
    arrivals = [Arrival(receiver, at_s + LENGTH_S + delay_s, b"") for receiver, delay_s in delays_s.items()]
    return [one.collided for one in air.send(slot, sender, at_s, at_s + LENGTH_S, arrivals)[0]]


def test_packets_that_overlap_at_a_receiver_are_both_lost_there_alone() -> None:
    air = Collisions()
    first = air.send(0, 0, 0.0, 1.0, [Arrival(2, 1.5, b""), Arrival(3, 1.1, b"")])[0]
    # 1 sends from 1.2 to 2.2: from 1.3 on at 2, where 0 is heard until 1.5; from 1.4 on at 3, where 0 is over at 1.1
    second, lost = air.send(1, 1, 1.2, 2.2, [Arrival(2, 2.3, b""), Arrival(3, 2.4, b"")])
    assert [one.collided for one in first] == [True, False]
    assert [one.collided for one in second] == [True, False]
    assert {(one.sender, one.arrival.receiver) for one in lost} == {(0, 2), (1, 2)}


def test_a_sender_receives_nothing_that_overlaps_its_transmission() -> None:
    air = Collisions()
    assert sent(air, 0, 0, 0.0, {1: 0.9}) == [False]
    # 1 begins at 1.5, while it hears 0 from 0.9 to 1.9
    _, lost = air.send(1, 1, 1.5, 2.5, [])
    assert [(one.slot, one.arrival.receiver) for one in lost] == [(0, 1)]
    # 1 sends until 2.5: what comes from 2.4 on is lost, what comes from 2.5 on is not
    assert sent(air, 2, 2, 2.2, {1: 0.2}) == [True]
    air = Collisions()
    air.send(1, 1, 1.5, 2.5, [])
    assert sent(air, 2, 2, 2.2, {1: 0.3}) == [False]


def test_back_to_back_packets_do_not_collide() -> None:
    air = Collisions()
    assert sent(air, 0, 0, 0.0, {2: 0.5}) == [False]
    assert sent(air, 1, 1, 1.3, {2: 0.2}) == [False]  # from 1.5 on, when 0 is over
    air = Collisions()
    assert sent(air, 0, 0, 0.0, {2: 1.5}) == [False]
    assert sent(air, 1, 1, 0.3, {2: 0.2}) == [False]  # sent later and over at 1.5, when 0 begins to be heard


@pytest.mark.parametrize("load", [0.25, 1.0])
def test_throughput_of_random_access_equals_theory(load: float) -> None:
    """N nodes send one packet of length 1 each per frame of T, at random within each; a receiver hears them all.

    A packet survives if none of the other N - 1 begins within 1 s of it: each begins in that span of 2 s with
    probability 2/T, whatever its frame, save that the two spans of one node's neighbouring frames are not independent,
    which matters only within 1 s of a frame's border. So packets are judged that begin 1 s or more from it:
    S/G = (1 - 2/T)^(N-1), which tends to e^(-2G) with N = G T.
    """
    n_nodes, frames = 20, 3000
    frame_s = n_nodes * LENGTH_S / load
    air, judged = Collisions(), []
    for frame in range(frames):
        starts = sorted((uniform(7, 99, frame, node, 0) * frame_s, node) for node in range(n_nodes))
        for begins_s, node in starts:
            at_s = frame * frame_s + begins_s
            (one,), _ = air.send(frame, node, at_s, at_s + LENGTH_S, [Arrival(n_nodes, at_s + LENGTH_S, b"")])
            if LENGTH_S <= begins_s <= frame_s - LENGTH_S:
                judged.append(one)
    expected = (1.0 - 2.0 / frame_s) ** (n_nodes - 1)
    share = sum(not one.collided for one in judged) / len(judged)
    # packets of one frame are not independent: frames are, so the error is at most that of one packet per collision
    # group; twice the binomial one bounds it, as packets are lost in twos
    error = 2.0 * math.sqrt(expected * (1.0 - expected) / len(judged))
    assert abs(share - expected) < 4.0 * error
    assert abs(expected - math.exp(-2.0 * load)) < 0.05
