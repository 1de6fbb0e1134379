"""Relaying and second-hand reports, where links are cut and where all links are alike."""

import math
import random
from itertools import pairwise, permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.manager_fleet import POSITION, SLOT_S, ManagerFleet
from exchange.packets import ItemUid

LINE = {(0, 1), (1, 2), (2, 3)}
"""Links of four nodes in a row; the others are cut."""

CUT = {(0, 2), (2, 0)}
"""Links that are cut of three nodes."""


def random_losses(seed: int, per: float, links: set[tuple[int, int]] | None = None):
    """Losses drawn alike on the links, by pairs of nodes; all is lost on others."""
    stream = random.Random(seed)

    def lost(slot: int, sender: int, receiver: int) -> bool:
        is_cut = links is not None and (min(sender, receiver), max(sender, receiver)) not in links
        return is_cut or stream.random() < per

    return lost


def relayed(fleet: ManagerFleet) -> int:
    """Items and statuses sent by nodes other than their origin."""
    return sum(
        uid.origin != slot % fleet.n_nodes
        for slot, sent in enumerate(fleet.said)
        for uid in (*sent.items, *sent.status)
    )


def that_relays(fleet: ManagerFleet, relay: bool) -> ManagerFleet:
    """The same fleet, or without relaying."""
    for manager in fleet.managers if not relay else ():
        manager.leave_out("relaying")
    return fleet


def waiting_for_all(fleet: ManagerFleet) -> ManagerFleet:
    """The same fleet, whose nodes also wait for nodes they do not receive."""
    for manager in fleet.managers:
        manager.leave_out("parking")
    return fleet


def line(seed: int, relay: bool) -> ManagerFleet:
    """Four vehicles in a row that lose 30 %."""
    return that_relays(ManagerFleet(4, "ack", lost=random_losses(seed, 0.3, LINE)), relay)


@pytest.mark.parametrize("relay", [True, False])
def test_an_item_crosses_a_line_of_nodes_only_if_relayed(relay):
    fleet = line(1, relay)
    first, last = fleet.maps(0, cell=7), fleet.maps(3, cell=8)
    fleet.pass_frames(60)
    assert (fleet.holders(first), fleet.holders(last)) == (([0, 1, 2, 3], [0, 1, 2, 3]) if relay else ([0, 1], [2, 3]))
    assert not fleet.false_beliefs


@pytest.mark.parametrize("policy", ["ack", "m-ack"])
@pytest.mark.parametrize(("per", "most"), [(0.0, 0.0), (0.3, 0.01), (0.8, 0.08)])
def test_relaying_is_rare_where_links_lose_alike(policy, per, most):
    """A chance run of losses may look like a cut, now and then."""
    n_relayed = n_said = 0
    for seed in range(6):
        fleet = ManagerFleet(4, policy, lost=random_losses(seed, per))
        for frame in range(60):
            fleet.maps(frame % 4, cell=frame)
            fleet.observe(frame % 4, (frame % 4, POSITION, (float(frame), 0.0)))
            fleet.pass_frames(1)
        n_relayed += relayed(fleet)
        n_said += sum(len(sent.items) + len(sent.status) for sent in fleet.said)
    assert n_relayed <= most * n_said


@pytest.fixture
def told() -> tuple[ManagerFleet, dict[str, bool], ItemUid]:
    """Nodes 0 and 2 are cut off from each other as long as ``is_cut``; node 1 has passed on an item of node 0."""
    sea = {"is_cut": True, "is_lost": False}

    def lost(slot: int, sender: int, receiver: int) -> bool:
        is_cut = sea["is_cut"] and (sender, receiver) in CUT
        return is_cut or (sea["is_lost"] and 1 in (sender, receiver))

    fleet = ManagerFleet(3, "ack", lost=lost)
    waiting_for_all(fleet).pass_frames(40)
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(8)
    return fleet, sea, uid


@pytest.fixture
def never_aged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Suspended items are not resumed by age."""
    monkeypatch.setattr("exchange.manager.relaying.AGED", math.inf)


Told = tuple[ManagerFleet, dict[str, bool], ItemUid]


def times_said(fleet: ManagerFleet, n_frames: int, uid: ItemUid) -> int:
    """Number of transmissions of an item by node 0 in the next frames."""
    said = fleet.pass_frames(n_frames)[:: fleet.n_nodes]
    return sum(uid in sent.items for sent in said)


def test_an_item_received_from_a_relay_is_suspended(told: Told) -> None:
    """It is open, and node 2 is not believed to hold it, though it does: nobody has told node 0."""
    fleet, _, uid = told
    origin = fleet.managers[0]
    assert times_said(fleet, 10, uid) == 0
    assert (origin.queue.open.bit_count(), origin.n_open) == (1, 0)
    assert fleet.holders(uid) == [0, 1, 2]
    assert (origin.believes(1, uid), origin.believes(2, uid)) == (True, False)
    assert 2 <= times_said(fleet, 1000, uid) <= 4  # each time it is four times as old


def test_a_suspended_item_resumes_when_the_relay_is_lost(told: Told, never_aged: None) -> None:
    fleet, sea, uid = told
    sea["is_lost"] = True
    assert times_said(fleet, 4, uid) == 0
    assert times_said(fleet, 10, uid) >= 9


def test_a_suspended_item_resumes_when_the_link_returns(told: Told, never_aged: None) -> None:
    fleet, sea, uid = told
    assert times_said(fleet, 40, uid) == 0
    sea["is_cut"] = False
    assert times_said(fleet, 40, uid) >= 1
    assert fleet.managers[0].believes(2, uid)
    assert fleet.n_open == 0


@pytest.mark.parametrize("has_relayed", [True, False])
def test_an_item_without_an_observed_relay_is_not_suspended(has_relayed: bool) -> None:
    """Node 1 holds the item and reaches node 2 best, but relays only an earlier one, or none: it judges otherwise."""
    cut = {*CUT}
    fleet = ManagerFleet(3, lost=lambda slot, *link: link in cut)
    waiting_for_all(fleet).pass_frames(40)
    if has_relayed:
        fleet.maps(0, cell=1)
        cut |= {(1, 2), (2, 1)}  # it passes that on from now on
        fleet.pass_frames(3)
    fleet.managers[1].leave_out("relaying")
    uid = fleet.maps(0, cell=7)
    assert times_said(fleet, 12, uid) == 12
    assert fleet.managers[0].relaying.left == [(2, 0), (2, 1)]


@pytest.mark.parametrize("policy", ["ack", "m-ack", "mps-ack"])
@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_all_items_are_delivered_after_any_link_and_relay_history(policy: str, seed: int) -> None:
    """Every 20 frames links are drawn anew, and one node may be gone; in the end a line is left that loses 30 %."""
    stream, n_nodes, worst = random.Random(seed), 4, [0.05, 0.3, 0.6, 0.95, 1.0]
    per: dict[tuple[int, int], float] = {}
    fleet = ManagerFleet(n_nodes, policy, lost=lambda slot, *link: stream.random() < per[link])
    uids = []
    for frame in range(140):
        if frame % 20 == 0:
            gone = stream.randrange(2 * n_nodes)
            per |= {link: 1.0 if gone in link else stream.choice(worst) for link in permutations(range(n_nodes), 2)}
        if frame % 2 == 0:
            uids.append(fleet.maps(stream.randrange(n_nodes), cell=frame))
        fleet.pass_frames(1)
    order = stream.sample(range(n_nodes), n_nodes)
    joined = {link for a, b in pairwise(order) for link in ((a, b), (b, a))}
    per |= {link: 0.3 if link in joined else 1.0 for link in per}
    fleet.pass_frames(300)
    assert all(fleet.holders(uid) == list(range(n_nodes)) for uid in uids)
    assert not fleet.false_beliefs


@pytest.mark.parametrize("policy", ["ack", "m-ack", "mps-ack", "ack-repeat", "m-ack-repeat", "mps-ack-repeat"])
@settings(max_examples=8)
@given(seed=st.integers(0, 2**32), per=st.sampled_from([0.0, 0.3, 0.6]), stops=st.integers(20, 120))
def test_second_hand_reception_times_are_not_later_than_the_last_packet(policy, seed, per, stops):
    """From some slot on node 3 says nothing. What others tell of it stays behind its last packet by a frame at most."""
    heard, lose = [0], random_losses(seed, per)

    def lost(slot: int, sender: int, receiver: int) -> bool:
        if sender == 3 and slot >= stops:
            return True
        if sender == 3:
            heard[0] = slot
        return lose(slot, sender, receiver)

    fleet = ManagerFleet(4, policy, lost=lost)
    for frame in range(40):
        fleet.maps(frame % 4, cell=frame)
        fleet.pass_frames(1)
    frame_s, spoke_s = 4 * SLOT_S, heard[0] * SLOT_S
    told = [spoke for node in range(3) for one in fleet.heard[node] for about, spoke in one.told if about == 3]
    assert all(spoke <= spoke_s + (0.0 if policy.startswith("ack") else frame_s) + 1.0 for spoke in told)
    if stops >= 100 and per:
        assert told
