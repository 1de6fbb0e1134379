"""Link estimates of a vehicle: near the true loss in both directions, unaffected by absence."""

import math
import random

import pytest

from benchmarks.manager_fleet import ManagerFleet
from exchange.manager.manager import PARKED
from exchange.manager.peers import HEARD, KEPT, LOST, SHORTEST_SILENCE, UNLIKELY, LossEstimate

N_EFFECTIVE = (1.0 + KEPT) / (1.0 - KEPT)
"""Samples of equal weight that tell as much as very many whose weights fall by ``KEPT``: 127."""


def sea(loss: dict[tuple[int, int], float], seed: int, n_frames: int) -> ManagerFleet:
    draws = random.Random(seed)
    fleet = ManagerFleet(3, lost=lambda slot, sender, receiver: draws.random() < loss[sender, receiver])
    fleet.pass_frames(n_frames)
    return fleet


BERNOULLI = {(a, b): 0.3 for a in range(3) for b in range(3) if a != b}
MATRIX = {(0, 1): 0.1, (1, 0): 0.6, (0, 2): 0.4, (2, 0): 0.2, (1, 2): 0.05, (2, 1): 0.5}


@pytest.mark.parametrize("loss", [BERNOULLI, MATRIX], ids=["bernoulli", "matrix"])
def test_estimates_lie_within_four_standard_errors_of_the_true_loss(loss: dict[tuple[int, int], float]):
    """Each has as much to go by as 127 packets; of the way out only those count of which an answer was heard."""
    fleet = sea(loss, 1, 600)
    for me, manager in enumerate(fleet.managers):
        for peer in {0, 1, 2} - {me}:
            links = manager.links(peer)
            for link, true in ((links.incoming, loss[peer, me]), (links.outgoing, loss[me, peer])):
                assert link.p_loss is not None
                assert link.n > 200
                assert abs(link.p_loss - true) < 4.0 * math.sqrt(true * (1.0 - true) / N_EFFECTIVE)


def test_the_absence_threshold_follows_from_the_loss_rate():
    """At a loss p it is the least n with p^n below 0.001, with the prior counted in: 2 packets, one of them lost."""
    for p_percent in (0, 20, 40, 80):
        estimate = LossEstimate()
        for sample in ([LOST] * p_percent + [HEARD] * (100 - p_percent)) * 10:
            estimate.note(sample)
        p_loss = estimate.link.p_loss
        silence = estimate.longest_silence
        assert silence == SHORTEST_SILENCE or p_loss ** (silence - 1) > UNLIKELY / 4
    assert LossEstimate().longest_silence == 10


def test_absence_does_not_raise_the_loss_estimate():
    """A peer that was away for 200 frames and is back loses no more than before."""
    fleet = ManagerFleet(3)
    fleet.pass_frames(50)
    fleet.lost = lambda slot, sender, receiver: 2 in (sender, receiver)
    fleet.pass_frames(200)
    fleet.lost = lambda slot, sender, receiver: False
    fleet.pass_frames(10)
    assert fleet.managers[0].links(2).incoming.p_loss == 0.0


# Parked -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("parking", [True, False])
def test_an_absent_peer_is_suspended_and_resynchronises(parking: bool):
    """With the cause taken out, all that is observed meanwhile stays open."""
    fleet = ManagerFleet(4, "ack-repeat")
    for manager in fleet.managers if not parking else ():
        manager.leave_out("parking")
    fleet.pass_frames(5)
    fleet.lost = lambda slot, sender, receiver: 3 in (sender, receiver)
    fleet.pass_frames(20)
    uids = [fleet.maps(0, cell) for cell in range(6)]
    fleet.pass_frames(15)
    assert (fleet.managers[0].n_open == 0) == parking
    assert any((3, PARKED) in sent.noticed for sent in fleet.said) == parking
    fleet.lost = lambda slot, sender, receiver: False
    fleet.pass_frames(12)
    assert all(fleet.managers[3].holds(uid) for uid in uids)
    assert [manager.n_open for manager in fleet.managers] == [0] * 4
    assert fleet.false_beliefs == []


def test_a_vehicle_receiving_nothing_suspends_no_peer():
    """It cannot tell whether all others are gone or it is deaf: it goes on saying what it has to say."""
    fleet = ManagerFleet(3, lost=lambda slot, sender, receiver: receiver == 0)
    fleet.pass_frames(40)
    uid = fleet.maps(0, 1)
    fleet.pass_frames(3)
    assert fleet.managers[0].n_open == 1
    assert all(manager.holds(uid) for manager in fleet.managers[1:])
    assert not any(sent.noticed for sent in fleet.said if sent.slot % 3 == 0)


# Summaries ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("summaries", [True, False])
def test_a_summary_replaces_lost_acknowledgements(summaries: bool):
    """Node 1 hears all; of its answers every second is lost, always the one behind an item. Without summaries node 0
    says the item until an answer comes through; with them the next packet with room tells."""

    def lost(slot: int, sender: int, receiver: int) -> bool:
        return sender == 1 and slot // 2 % 2 == 0

    fleet = ManagerFleet(2, lost=lost)
    for manager in fleet.managers if not summaries else ():
        manager.leave_out("summaries")
    uid = fleet.maps(0, 1)
    fleet.pass_slot()
    fleet.pass_slot()
    assert not fleet.managers[0].believes(1, uid)
    fleet.managers[0].queue.drop(0)  # it says nothing more: an acknowledgement of the first packet can come no more
    fleet.pass_frames(3)
    assert fleet.managers[0].believes(1, uid) == summaries
