"""Needs that change during the exchange: items sent again, no longer sent, filtered out and used later."""

import random

import pytest
from exchange_stress import Fleet, creates

from benchmarks.manager_fleet import MAPPED_CELL, POSITION, ManagerFleet, bay, needs
from exchange.policy.policies import POLICIES
from worldmodel import NOBODY, PropertyValue, Wanted, merge


class Team:
    """Cells of the bay are needed by these nodes, which may change."""

    def __init__(self, *nodes: int) -> None:
        self.nodes = set(nodes)

    def wanted(self, fact: PropertyValue, class_uid: int) -> Wanted:
        return Wanted(sum(1 << node for node in self.nodes), 1) if fact.attribute == MAPPED_CELL else NOBODY


def knows(fleet: ManagerFleet, node: int, cell: int) -> bool:
    return any(one.value == cell for one in fleet.models[node].history(bay(fleet.n_nodes), MAPPED_CELL))


def regroup(fleet: ManagerFleet) -> None:
    """Change the needs at every node at once; merge items needed now."""
    for model, manager in zip(fleet.models, fleet.managers, strict=True):
        merge(model, manager.renew(fleet.now_s).blocks)


def test_unneeded_items_are_filtered_out_and_used_once_needed() -> None:
    team = Team(0, 1)
    fleet = ManagerFleet(3, who_needs=team, selective=True)
    uid = fleet.maps(0, 7)
    fleet.pass_frames(2)
    assert knows(fleet, 1, 7)
    assert not knows(fleet, 2, 7)
    assert [one.uid for heard in fleet.heard[2] for one in heard.aside] == [uid]
    assert fleet.n_open == 0
    team.nodes.add(2)
    regroup(fleet)
    assert knows(fleet, 2, 7)
    assert fleet.n_open == 0  # node 2 has acknowledged the packet, so nobody sends it again


def test_a_need_that_comes_and_goes_sends_an_item_once() -> None:
    """A peer that is believed to hold an item does not get it anew, however often needs change: no livelock."""
    team = Team(0, 1)
    fleet = ManagerFleet(3, who_needs=team, selective=True)
    uid = fleet.maps(0, 7)
    for _ in range(10):
        team.nodes ^= {2}
        regroup(fleet)
        fleet.pass_frames(2)
    assert sum(uid in sent.items for sent in fleet.said) <= 3
    assert fleet.n_open == 0


@pytest.mark.parametrize("policy", sorted(POLICIES))
def test_differing_views_of_needs_leave_no_effect_once_they_agree(policy: str) -> None:
    """Every node goes by a view of its own, which changes at random while half of all packets are lost."""
    draws = random.Random(0)
    views = [Team(*range(4)) for _ in range(4)]
    fleet = ManagerFleet(
        4, policy, who_needs=views, selective=True, lost=lambda slot, *of: slot < 160 and draws.random() < 0.5
    )
    for frame in range(40):
        fleet.maps(draws.randrange(4), frame)
        node = draws.randrange(4)
        views[node].nodes = {one for one in range(4) if draws.random() < 0.6}
        merge(fleet.models[node], fleet.managers[node].renew(fleet.now_s).blocks)
        fleet.pass_frames(1)
    needing = {one for one in range(4) if draws.random() < 0.6}
    for view in views:
        view.nodes = set(needing)
    regroup(fleet)
    fleet.pass_frames(60)
    assert fleet.false_beliefs == []
    assert fleet.n_open == 0
    assert all(knows(fleet, node, cell) for node in needing for cell in range(40))


def test_a_status_needed_by_its_own_vehicle_only_is_never_queued() -> None:
    fleet = ManagerFleet(2, who_needs=needs([0]))
    fleet.observe(0, (0, POSITION, (1.0, 2.0)))
    assert fleet.pass_slot().status == ()


def test_an_item_needed_since_its_instance_is_known_is_sent_once() -> None:
    """With the class of an instance unknown before, it is evaluated at the change of needs and in the own slot."""
    fleet = Fleet(3, "ack-repeat")
    uids = creates(fleet, 0)
    fleet.run(1)
    relay = fleet.lives[1].manager
    relay.renew(fleet.now_s)
    assert relay.packet_to_send(fleet.now_s).items == uids
