"""Relaying, and what a vehicle is told of those that it does not hear, where links are cut and where they are alike."""

import random

import pytest
from exchange_lives import Sea
from hypothesis import given, settings
from hypothesis import strategies as st
from turn_takers import Round

from stress.conformance.radio import POSITION, SLOT_S, ManagerFleet

LINE = {(0, 1), (1, 2), (2, 3)}
"""Links of four nodes in a row; the others are cut."""


def random_losses(seed: int, per: float, links: set[tuple[int, int]] | None = None):
    """Losses drawn alike on the links, by pairs of nodes; all is lost on others."""
    stream = random.Random(seed)

    def lost(slot: int, sender: int, receiver: int) -> bool:
        is_cut = links is not None and (min(sender, receiver), max(sender, receiver)) not in links
        return is_cut or stream.random() < per

    return lost


def relayed(fleet: ManagerFleet) -> int:
    """Items and statuses that others than their origins have said."""
    return sum(
        uid.origin != slot % fleet.n_nodes
        for slot, sent in enumerate(fleet.said)
        for uid in (*sent.items, *sent.status)
    )


def that_relays(fleet: ManagerFleet, relay: bool) -> ManagerFleet:
    """The same fleet, or without relaying."""
    for manager in fleet.managers if not relay else ():
        manager.relaying.clear()
    return fleet


def line(seed: int, relay: bool) -> ManagerFleet:
    """Four vehicles in a row that lose 30 %."""
    return that_relays(ManagerFleet(4, "ack", lost=random_losses(seed, 0.3, LINE)), relay)


@pytest.mark.parametrize("relay", [True, False])
def test_an_item_goes_along_a_line_if_it_is_relayed(relay):
    fleet = line(1, relay)
    first, last = fleet.maps(0, cell=7), fleet.maps(3, cell=8)
    fleet.pass_frames(60)
    assert (fleet.holders(first), fleet.holders(last)) == (([0, 1, 2, 3], [0, 1, 2, 3]) if relay else ([0, 1], [2, 3]))
    assert not fleet.false_beliefs


@pytest.mark.parametrize("relay", [True, False])
def test_what_is_left_of_a_former_life_goes_along_a_line_if_it_is_relayed(relay):
    """Node 0 begins anew with its memory: it holds its old item and is the first of those who would send it."""
    sea = Sea(4, "ack")
    old = sea.maps(0, cell=7)
    that_relays(sea, relay)
    for slot in range(240):
        if slot == 8:
            sea.restart(0, keeps=True)
            that_relays(sea, relay)
        sea.pass_slot(lambda sender, receiver: (min(sender, receiver), max(sender, receiver)) not in LINE)
    assert sea.holders(old) == ([0, 1, 2, 3] if relay else [0, 1])
    assert not sea.wrong()


@pytest.mark.parametrize("relay", [True, False])
def test_the_newest_status_goes_along_a_line_once_it_is_known_that_it_has_to(relay):
    fleet = line(2, relay)
    for frame in range(60):
        fleet.observe(3, (3, POSITION, (float(frame), 0.0)))
        fleet.pass_frames(1)
    known = fleet.models[0].latest(3, POSITION)
    if not relay:
        assert known is None
    else:
        assert known is not None
        assert fleet.now_s - known.block.time_s < 12 * 4 * SLOT_S
        assert relayed(fleet) > 40


@pytest.mark.parametrize("policy", ["ack", "m-ack"])
@pytest.mark.parametrize(("per", "most"), [(0.0, 0.0), (0.2, 0.01), (0.4, 0.01), (0.8, 0.08)])
def test_hardly_anybody_relays_where_links_lose_alike(policy, per, most):
    """A chance run of losses may look like a cut, now and then."""
    n_relayed = n_said = 0
    for seed in range(12):
        fleet = ManagerFleet(4, policy, lost=random_losses(seed, per))
        for frame in range(60):
            fleet.maps(frame % 4, cell=frame)
            fleet.observe(frame % 4, (frame % 4, POSITION, (float(frame), 0.0)))
            fleet.pass_frames(1)
        n_relayed += relayed(fleet)
        n_said += sum(len(sent.items) + len(sent.status) for sent in fleet.said)
    assert n_relayed <= most * n_said


@pytest.mark.parametrize("seed", range(6))
def test_what_goes_over_a_bad_link_between_two_halves_is_relayed_by_its_ends(seed):
    """Node 2 hears node 3 best, which lacks what node 1 has to relay."""
    stream, per = random.Random(seed), {(0, 1): 0.0, (1, 2): 0.6, (2, 3): 0.0}

    def lost(slot: int, sender: int, receiver: int) -> bool:
        return stream.random() < per.get((min(sender, receiver), max(sender, receiver)), 1.0)

    fleet = ManagerFleet(4, lost=lost)
    uid = fleet.maps(0, cell=7)
    for frame in range(120):
        fleet.observe(0, (0, POSITION, (float(frame), 0.0)))
        fleet.pass_frames(1)
    known = fleet.models[3].latest(0, POSITION)
    assert fleet.holders(uid) == [0, 1, 2, 3]
    assert known is not None
    assert fleet.now_s - known.block.time_s < 16 * 4 * SLOT_S


@pytest.mark.parametrize("relay", range(4))
def test_whoever_is_first_in_a_frame_relays_as_well(relay):
    """All but one node hear that one alone, wherever it stands in a slot list."""
    ends = [(relay + 1) % 4, (relay + 2) % 4]
    fleet = Round(4, "ack", [((0,), (1,), (2,), (3,))] * 4)
    for _ in range(20):
        fleet.pass_frame(lambda sender, receiver: relay not in (sender, receiver))
    uid = fleet.maps(ends[0], cell=7)
    for _ in range(8):
        fleet.pass_frame(lambda sender, receiver: relay not in (sender, receiver))
    assert ends[1] in fleet.holders(uid)


@pytest.mark.parametrize("per", [0.3, 0.6])
def test_another_takes_over_as_soon_as_the_one_who_relays_is_lost(per):
    """Nodes 0 and 3 are cut off from each other, and node 1 reaches both best until it is lost."""
    stream, is_lost = random.Random(1), False

    def lost(slot: int, sender: int, receiver: int) -> bool:
        if {sender, receiver} == {0, 3} or (is_lost and 1 in (sender, receiver)):
            return True
        return stream.random() < (per if {sender, receiver} == {2, 3} else 0.05)

    fleet = ManagerFleet(4, lost=lost)
    for frame in range(100):
        fleet.observe(0, (0, POSITION, (float(frame), 0.0)))
        fleet.pass_frames(1)
    is_lost = True
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(20)
    assert 3 in fleet.holders(uid)


@pytest.mark.parametrize("relay", [True, False])
def test_an_item_gets_to_who_hears_its_origin_and_is_not_heard_by_it(relay):
    """Node 2 misses the item, and node 0 never hears of that: it takes node 2 for lost, and repeats nothing for it."""
    is_deaf = True
    fleet = ManagerFleet(
        3, lost=lambda slot, sender, receiver: (sender, receiver) == (2, 0) or (is_deaf and receiver == 2)
    )
    that_relays(fleet, relay).pass_frames(20)
    uid = fleet.maps(0, cell=7)
    fleet.pass_frames(1)
    is_deaf = False
    fleet.pass_frames(60)
    assert fleet.holders(uid) == ([0, 1, 2] if relay else [0, 1])


@pytest.mark.parametrize("is_believed", [True, False])
def test_each_who_relays_says_a_status_once_whether_anybody_believes_it(monkeypatch, is_believed):
    """Nodes 1 and 2 reach node 3, which does not hear node 0. Radios set reports aside by which a peer has jumped."""
    fleet = ManagerFleet(4, lost=lambda slot, sender, receiver: {sender, receiver} == {0, 3})
    fleet.observe(0, (0, POSITION, (0.0, 0.0)))
    fleet.pass_frames(40)
    before = relayed(fleet)
    if not is_believed:
        monkeypatch.setattr("stress.conformance.radio.merge", lambda model, blocks: None)
    fleet.observe(0, (0, POSITION, (5000.0, 0.0)))
    fleet.pass_frames(40)
    assert relayed(fleet) == before + 2


def test_relaying_ends_with_its_cause():
    is_cut = True
    fleet = ManagerFleet(3, "ack", lost=lambda slot, sender, receiver: is_cut and (sender, receiver) == (0, 2))
    fleet.maps(0, cell=1)
    fleet.pass_frames(20)
    assert relayed(fleet) > 0
    is_cut = False
    fleet.pass_frames(100)
    before = relayed(fleet)
    fleet.maps(0, cell=2)
    fleet.pass_frames(20)
    assert relayed(fleet) == before


@pytest.mark.parametrize("policy", ["ack", "m-ack", "mps-ack", "ack-repeat", "m-ack-repeat", "mps-ack-repeat"])
@settings(max_examples=15)
@given(seed=st.integers(0, 2**32), per=st.sampled_from([0.0, 0.3, 0.6]), stops=st.integers(20, 120))
def test_nobody_is_said_to_have_spoken_later_than_it_did(policy, seed, per, stops):
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


def test_who_is_not_heard_is_told_of_by_who_hears_it():
    fleet = ManagerFleet(3, "ack", lost=lambda slot, sender, receiver: (sender, receiver) == (0, 2))
    fleet.pass_frames(10)
    told = [spoke for one in fleet.heard[2] for about, spoke in one.told if about == 0]
    assert len(told) >= 9
    assert told == sorted(told)
    assert not any(one.told for node in (0, 1) for one in fleet.heard[node])
