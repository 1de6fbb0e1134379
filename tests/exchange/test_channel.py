"""The broadcast channel: time and place of reception, and random draws independent of the content."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exchange.channel.channel import Blackout, BroadcastChannel
from exchange.channel.link import Bernoulli
from exchange.channel.loss import uniform
from exchange.channel.modems import modems

MODEM = modems()["nanomodem-v3"]
SQUARE_M = [(0.0, 0.0), (300.0, 400.0), (-900.0, 0.0), (0.0, 1500.0)]
TOGETHER_M = [(0.0, 0.0)] * 4


def test_a_packet_arrives_after_its_duration_and_travel_time():
    """64 B at 463 bit/s last 1.1058 s; 500 m at 1500 m/s take 0.3333 s, 900 m 0.6 s and 1500 m 1 s."""
    arrivals = BroadcastChannel(MODEM, Bernoulli(0.0), seed=1).transmit(0, 0, bytes(64), 10.0, SQUARE_M)
    assert [arrival.receiver for arrival in arrivals] == [1, 2, 3]
    expected_s = [10.0 + 512 / 463 + 1 / 3, 10.0 + 512 / 463 + 0.6, 10.0 + 512 / 463 + 1.0]
    assert [arrival.time_s for arrival in arrivals] == pytest.approx(expected_s, rel=1e-12)
    assert {arrival.data for arrival in arrivals} == {bytes(64)}


def test_the_packet_header_takes_air_time():
    """Benthos: one second before the payload, 64 B at 800 bit/s."""
    channel = BroadcastChannel(modems()["atm-900"], Bernoulli(0.0), seed=1)
    assert channel.transmit(0, 0, bytes(64), 0.0, TOGETHER_M)[0].time_s == pytest.approx(1.0 + 0.64)


def test_reception_ends_beyond_the_range():
    channel = BroadcastChannel(MODEM, Bernoulli(0.0), seed=1, range_m=900.0)
    assert [arrival.receiver for arrival in channel.transmit(0, 0, b"x", 0.0, SQUARE_M)] == [1, 2]
    just_short = BroadcastChannel(MODEM, Bernoulli(0.0), seed=1, range_m=math.nextafter(900.0, 0.0))
    assert [arrival.receiver for arrival in just_short.transmit(0, 0, b"x", 0.0, SQUARE_M)] == [1]


SIDES = st.lists(st.sampled_from([frozenset({0}), frozenset({1, 2}), frozenset({3})]), min_size=2, unique=True)
TIMES_S = st.integers(0, 9).map(float)
BLACKOUTS = st.builds(
    lambda from_s, lasts_s, whom: Blackout(from_s, from_s + lasts_s, *whom),
    TIMES_S,
    st.integers(1, 9),
    st.tuples(st.sampled_from([None, 0, 1, 2, 3])) | SIDES.map(lambda sides: (None, tuple(sides))),
)


@given(
    st.floats(0.0, 1.0), st.integers(1, 9), st.integers(0, 2), st.lists(BLACKOUTS, max_size=3), TIMES_S,
    st.sampled_from([b"", bytes(64)]), st.sampled_from([TOGETHER_M, SQUARE_M]),
)  # fmt: skip
def test_reception_follows_the_link_draw_and_blackouts(per, seed, trial, blackouts, now_s, data, places_m):
    """Whose own draw of the link is not below the rate, whatever is sent when and where; but for those cut off.

    A blackout holds from its start to just before its end, for one node, for all, or between sides; they add up.
    """
    channel = BroadcastChannel(MODEM, Bernoulli(per), seed, trial, blackouts=tuple(blackouts))
    for slot in range(8):
        sender = slot % 4

        def is_cut(receiver: int, sender: int = sender) -> bool:
            return any(
                one.from_s <= now_s < one.until_s
                and (
                    {sender, receiver} <= frozenset().union(*one.between)
                    and not any({sender, receiver} <= side for side in one.between)
                    if one.between
                    else one.node in (None, sender, receiver)
                )
                for one in blackouts
            )

        heard = [arrival.receiver for arrival in channel.transmit(slot, sender, data, now_s, places_m)]
        assert heard == [
            node
            for node in range(4)
            if node != sender and uniform(seed, trial, slot, sender, node) >= per and not is_cut(node)
        ]
