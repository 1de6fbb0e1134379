"""An exchange policy from outside in a scenario and in the policy study, and what is refused of such."""

import pytest
from conformance import nonconforming_policies as outside

from exchange.study.parameters import ExchangeStudy
from missions.scenarios.loading import load

SPARSE = "conformance.nonconforming_policies:SPARSE"


def test_a_mission_runs_under_a_policy_from_outside() -> None:
    """Four vehicles: a header of 3 bits in even frames, of none in odd ones."""
    from missions.runs.run import run as run_mission

    options = [("--policy", f"communication.policy={SPARSE}"), ("--set", "scenario.duration_s=120")]
    packets = run_mission(load("mapping-rendezvous", options), seed=1).recorder.rows("packets")
    assert len(packets) > 40
    assert max(packet[5] for packet in packets if packet[0] // 4 % 2 == 0) == 3
    assert max(packet[5] for packet in packets if packet[0] // 4 % 2 == 1) == 0


def test_two_policies_of_one_name_are_refused() -> None:
    other = outside.AckPolicy(outside.M_ACK._replace(name="sparse"), True)
    with pytest.raises(Exception, match="two policies have the name sparse-repeat"):
        ExchangeStudy(policies=(outside.SPARSE, other))
