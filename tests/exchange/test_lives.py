"""Vehicles begin anew, are away, or share a name: nobody comes to believe that a peer holds what it lacks."""

import random
from collections.abc import Iterator

import pytest
from exchange_lives import Sea
from sampling import sampled

from exchange.policies import POLICIES

ALL = sorted(POLICIES)


def storm(sea: Sea, seed: int, n_slots: int, per: float, restarts: dict[int, tuple[int, bool]]) -> Iterator[int]:
    """Slots of a fleet whose vehicles observe now and then; ``restarts`` by slot: who, and what is kept."""
    draws = random.Random(seed)
    for slot in range(n_slots):
        if slot in restarts:
            node, keeps = restarts[slot]
            sea.restart(node, keeps)
        node = draws.randrange(sea.n_nodes)
        if draws.random() < 0.3 and slot < n_slots * 0.7:
            sea.maps(node, draws.randrange(4000))
        sea.pass_slot(lambda sender, receiver: draws.random() < per)
        yield slot


@pytest.mark.parametrize("policy", ALL)
@pytest.mark.parametrize("keeps", [False, True])
@pytest.mark.parametrize("seed", sampled(range(4), 0, 1))
def test_after_restarts_nobody_believes_what_is_false(policy: str, keeps: bool, seed: int):
    sea = Sea(4, policy)
    for _ in storm(sea, seed, 240, 0.4, {60: (1, keeps), 62: (3, keeps), 100: (1, keeps), 141: (2, keeps)}):
        assert sea.wrong() == []
    for _ in range(120):
        sea.pass_slot(lambda sender, receiver: False)
        assert sea.wrong() == []
    assert len(set(sea.digests())) == 1
    assert [manager.n_open for manager in sea.managers] == [0] * 4


@pytest.mark.parametrize("policy", ALL)
def test_after_twenty_restarts_nobody_believes_what_is_false(policy: str):
    """Memory is kept and lost in turn; one vehicle begins anew while nobody hears it, as often as epochs have bits."""
    sea, draws = Sea(4, policy), random.Random(policy)
    restarts = {20 * n + 7: (1 if n % 3 else 2, bool(n % 2)) for n in range(1, 31)}
    for slot in storm(sea, 5, 760, 0.5, restarts):
        if slot in (200, 420):  # it begins anew four times and eight times unheard: its epoch modulo four is the same
            for _ in range(4 if slot == 200 else 8):
                sea.restart(3, draws.random() < 0.5)
        assert sea.wrong() == []
    assert [model.epoch for model in sea.models] == [0, 20, 10, 12]
    for _ in range(160):
        sea.pass_slot(lambda sender, receiver: False)
        assert sea.wrong() == []
    assert len(set(sea.digests())) == 1
    assert [manager.n_open for manager in sea.managers] == [0] * 4


@pytest.mark.parametrize("policy", ALL)
def test_what_a_restarted_vehicle_observes_reaches_all(policy: str):
    """The attack of the measurements: 20 items each, then one begins anew and observes 20 more."""
    sea = Sea(4, policy)
    for node in range(4):
        for cell in range(20):
            sea.maps(node, 100 * node + cell)
    sea.pass_frames(60)
    sea.restart(2, keeps=False)
    after = [sea.maps(2, 500 + cell) for cell in range(20)]
    assert {uid.epoch for uid in after} == {1}
    sea.pass_frames(60)
    assert all(manager.holds(uid) for manager in sea.managers for uid in after)
    assert sea.n_faults() == 0
    assert len(sea.models[2].digest()) == 5  # the other three, its own earlier life as the others know it, and this one
    assert len(set(sea.digests())) == 1
