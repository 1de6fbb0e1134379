"""Incarnations of peers, packet by packet."""

import pytest

from exchange.errors import PeerFault
from exchange.manager.peers import Met, PeerStates
from exchange.policy.policies import ACK


def test_an_older_epoch_is_accepted_only_after_two_packets_in_a_row() -> None:
    peers = PeerStates(0, 3, ACK)
    assert peers.meet(1, 2, 0, b"")[0] is Met.NEW_LIFE
    peers.begin(1, 2)
    for _ in range(2):
        with pytest.raises(PeerFault, match="node 1 in its epoch 1, after its epoch 2"):
            peers.meet(1, 1, 1, b"")
        assert peers.meet(1, 2, 2, b"")[0] is Met.USUAL
    with pytest.raises(PeerFault):
        peers.meet(1, 1, 3, b"")
    assert peers.meet(1, 1, 4, b"")[0] is Met.NEW_LIFE


def test_silence_is_measured_from_the_last_packet_even_in_the_first_frame() -> None:
    peers = PeerStates(0, 3, ACK)
    peers.meet(1, 0, 0, b"")
    longest = peers.incoming[1].longest_silence
    assert peers.mark_absent(2) == []  # the node begins to count in frame 2
    assert peers.mark_absent(longest) == []
    assert peers.mark_absent(longest + 1) == [1]
    assert peers.away == 0b010
