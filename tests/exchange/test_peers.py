"""Who is in which life, packet by packet."""

import pytest

from exchange.ack import new_state
from exchange.errors import PeerFault
from exchange.peering.peers import Met, PeerStates
from exchange.policies import ACK


def test_an_older_epoch_counts_only_when_it_is_heard_twice_in_a_row() -> None:
    peers = PeerStates(0, 3, new_state(3), ACK)
    assert peers.meet(1, 2, 0) is Met.NEW_LIFE
    peers.begin(1, 2)
    for _ in range(2):
        with pytest.raises(PeerFault, match="node 1 in its epoch 1, after its epoch 2"):
            peers.meet(1, 1, 1)
        assert peers.meet(1, 2, 2) is Met.USUAL
    with pytest.raises(PeerFault):
        peers.meet(1, 1, 3)
    assert peers.meet(1, 1, 4) is Met.NEW_LIFE


def test_of_who_is_in_another_life_nothing_is_believed() -> None:
    state = new_state(3)
    peers = PeerStates(0, 3, state, ACK)
    state.heard[0] = 0b110
    for node in range(3):
        state.content[node] = state.believes[node] = 1 << node
    peers.begin(1, 1)
    assert peers.epochs == [0, 1, 0]
    assert state.heard[0] == 0b100
    assert list(state.believes) == [1, 0, 4]
    assert list(state.content) == [1, 0, 4, 0, 0, 0]
