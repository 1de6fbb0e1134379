"""The policy study equals the managers of the vehicles, slot by slot, with real bits.

The slot loop of the study runs uncompiled beside N managers that encode, lose and decode real packets. After every
slot each node's beliefs about every peer and item must agree. Other tests hold the compiled loop against the
uncompiled one, so the three agree.
"""

import pytest
from conformance import nonconforming_policies
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from benchmarks.manager_fleet import assert_study_is_managers
from exchange.policy.policies import POLICIES, STATING, AckPolicy

MAX_SLOTS = 40
TRIED = {**POLICIES, "sparse": nonconforming_policies.SPARSE, **nonconforming_policies.REPORTING}


@pytest.mark.parametrize("policy", TRIED.values(), ids=list(TRIED))
@settings(max_examples=12)
@given(data=st.data())
def test_study_and_managers_agree_after_every_slot(policy: AckPolicy, data: st.DataObject) -> None:
    """Beliefs, and where holdings are stated, what is planned, stated, coded and decoded from real bits."""
    n_nodes = data.draw(st.integers(2, 5), "nodes")
    items = data.draw(st.integers(1, 5), "items at every node")
    states = policy.acknowledgement.states
    evidence = states or data.draw(st.booleans(), "carrier evidence")
    payload_bytes = data.draw(st.sampled_from([28, 36, 44, 64] if states else [20, 28, 36, 44, 64]), "payload")
    n_slots = data.draw(st.integers(n_nodes, MAX_SLOTS), "slots")
    heard = data.draw(st.lists(st.integers(0, (1 << n_nodes) - 1), min_size=n_slots, max_size=n_slots), "who hears")
    assume(assert_study_is_managers(policy, n_nodes, items, evidence, payload_bytes, heard))


def test_a_peer_known_to_hold_a_new_item_is_not_counted_as_missing_it() -> None:
    """A vehicle takes in items that it knew another one to hold: then it reckons what symbols over them bring."""
    heard = [4, 5, 12, 26, 0, 0, 1, 0, 6, 6, 8, 17, 0, 21, 14, 14, 8, 14, 28, 8, 0, 12, 0, 6, 0, 0, 0, 2, *[0] * 9]
    assert assert_study_is_managers(STATING["adaptive"], 5, 5, True, 28, heard)
