"""No packet, however bad, raises anything or holds a vehicle up: a sample of what `bad_packets` throws."""

import pytest
from bad_packets import throw
from tools.mangling import MUTATIONS, STRINGS


@pytest.mark.parametrize("ways", [STRINGS, MUTATIONS], ids=["strings", "mutations"])
@pytest.mark.parametrize(("policy", "payload_bytes"), [("ack", 32), ("mps-ack-repeat", 64)])
def test_bad_packets_are_refused_or_taken_and_never_raise(ways: tuple, policy: str, payload_bytes: int):
    n = 1500
    toll = throw(n, ways, policy, payload_bytes, seed=7)
    assert toll.refused > n / 20
    assert toll.slow == []
