"""The policy study and the vehicles' managers are the same thing: slot by slot, with real bits.

The slot loop of the study runs uncompiled beside N managers that encode, lose and decode real packets. After every
slot each node's beliefs about every peer and item must agree. A second test holds the compiled loop against the
uncompiled one, so the three agree.
"""

from functools import partial

import numpy as np
import pytest
from fleet_radio import Fleet
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from exchange.packets import Fragment, ItemUid
from exchange.policies import POLICIES, header_bits
from exchange.study import montecarlo, trial
from worldmodel import PropertyValue

MAX_SLOTS = 40


def item_sizes(fleet: Fleet) -> tuple[int, int]:
    """Bits of an observation of one cell, own and relayed."""
    mapped = next(a.uid for a in fleet.models[0].tbox.attributes if a.name == "mappedCell")
    fragment = Fragment(0, 0, 0.0, (PropertyValue(fleet.n_nodes, mapped, 0.0),))
    return fleet.codec.fragment_bits(fragment, relayed=False), fleet.codec.fragment_bits(fragment, relayed=True)


class Study:
    """The slot loop of the study, uncompiled, one slot at a time."""

    def __init__(self, policy: str, n_nodes: int, items: int, evidence: bool, item_bits: int, room_bits: int) -> None:
        chosen = POLICIES[policy]
        n_words = -(-n_nodes * items // trial.WORD_BITS)
        self.kind = chosen.acknowledgement
        self.rules = trial.Rules(chosen.repeat, evidence, n_nodes, n_words)
        capacity_bits = room_bits + header_bits(chosen, n_nodes)
        self.load = trial.Load(n_nodes, items, 0.0, item_bits, capacity_bits, 0, 0, MAX_SLOTS)
        self.nodes = trial.new_nodes(self.rules, self.load, self.kind.period_frames)
        montecarlo.header_sizes(self.kind, n_nodes, self.nodes.header_bits)
        trial.clear(self.nodes)
        for column in range(n_nodes * items):
            trial.add_item(self.rules, self.nodes, column // items, column, 0)

    def pass_slot(self, slot: int, heard_by: int) -> int:
        montecarlo.play_slot(self.kind, self.rules, self.load, self.nodes, slot, heard_by)
        return sum(int(word).bit_count() for word in self.nodes.packet)

    def believes(self, node: int, peer: int, column: int) -> bool:
        word = self.nodes.believes[node, peer * self.rules.n_words + column // trial.WORD_BITS]
        return bool(word >> column % trial.WORD_BITS & 1)


@pytest.mark.parametrize("policy", list(POLICIES))
@settings(max_examples=12)
@given(data=st.data())
def test_study_and_managers_agree_after_every_slot(policy: str, data: st.DataObject) -> None:
    n_nodes = data.draw(st.integers(2, 5), "nodes")
    items = data.draw(st.integers(1, 4), "items at every node")
    evidence = data.draw(st.booleans(), "carrier evidence")
    payload_bytes = data.draw(st.sampled_from([20, 28, 36, 44, 64]), "payload")
    n_slots = data.draw(st.integers(n_nodes, MAX_SLOTS), "slots")
    heard = data.draw(st.lists(st.integers(0, (1 << n_nodes) - 1), min_size=n_slots, max_size=n_slots), "who hears")

    fleet = Fleet(
        n_nodes,
        policy,
        payload_bytes,
        evidence,
        lost=lambda slot, sender, receiver: not heard[slot] >> receiver & 1,
    )
    own_bits, relayed_bits = item_sizes(fleet)
    room_bits = 8 * payload_bytes - fleet.codec.overhead_bits
    assume(room_bits // own_bits == room_bits // relayed_bits >= 1)  # the study knows one size of an item only
    study = Study(policy, n_nodes, items, evidence, own_bits, room_bits)
    uids = [fleet.maps(node, node * items + index) for node in range(n_nodes) for index in range(items)]

    for slot in range(n_slots):
        sent = fleet.pass_slot()
        n_sent = study.pass_slot(slot, heard[slot] & ~(1 << slot % n_nodes))
        assert len(sent.items) == n_sent
        for node, manager in enumerate(fleet.managers):
            for peer in range(n_nodes):
                believed = [uid for uid in uids if believes(manager, node, peer, uid)]
                assert believed == [uid for column, uid in enumerate(uids) if study.believes(node, peer, column)]
    assert fleet.false_beliefs == []


def believes(manager: object, node: int, peer: int, uid: ItemUid) -> bool:
    return bool(manager.holds(uid) if node == peer else manager.believes(peer, uid))  # type: ignore[attr-defined]


def test_a_difference_would_be_seen() -> None:
    """The comparison is not vacuous: with one more loss on one side, beliefs come apart within a frame."""
    fleet = Fleet(3, "ack")
    own_bits, _ = item_sizes(fleet)
    study = Study("ack", 3, 1, True, own_bits, 512 - fleet.codec.overhead_bits)
    uids = [fleet.maps(node, node) for node in range(3)]
    fleet.pass_slot()
    study.pass_slot(0, 0b100)
    assert fleet.managers[1].holds(uids[0])
    assert not study.believes(1, 1, 0)


@pytest.mark.parametrize("policy", list(POLICIES))
def test_compiled_and_uncompiled_slot_loops_agree(policy: str) -> None:
    from exchange.study.compiler import compiled

    chosen = POLICIES[policy]
    rules = trial.Rules(chosen.repeat, False, 4, 1)
    load = trial.Load(4, 3, 0.0, 57, 57 * 2 + 12, 0, 0, 3000)
    p_loss = np.full((4, 4), 0.5)
    np.fill_diagonal(p_loss, 1.0)
    outcomes = []
    for loop in (partial(montecarlo.run_trials, chosen.acknowledgement), compiled(chosen.acknowledgement, True, print)):
        received = np.full((10, 100), montecarlo.NOT_DRAWN, np.int64)
        outcome = np.zeros((10, trial.N_QUANTITIES, 3), np.int64)
        loop(rules, load, p_loss, 7, 0, received, outcome)
        outcomes.append(outcome)
    assert (outcomes[0] == outcomes[1]).all()
    assert outcomes[0][:, trial.SLOTS, trial.SUM].min() > 4
