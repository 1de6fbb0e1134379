"""An exchange policy from outside in a scenario and in the policy study, and what is refused of such."""

import re

import outside_policies
import pytest

from exchange.study.study import ExchangeStudy
from missions.errors import ConfigurationError
from missions.scenarios.loading import load
from missions.scenarios.policy import policy_of

SPARSE = "outside_policies:SPARSE"


def test_a_scenario_names_a_policy_from_outside() -> None:
    scenario = load("mapping-rendezvous", [("--policy", f"communication.policy={SPARSE}")])
    assert policy_of(scenario.communication.policy) is outside_policies.SPARSE


def test_a_mission_runs_under_a_policy_from_outside() -> None:
    """Four vehicles: a header of 3 bits in even frames, of none in odd ones."""
    from missions.runs.run import run as run_mission

    options = [("--policy", f"communication.policy={SPARSE}"), ("--set", "scenario.duration_s=120")]
    packets = run_mission(load("mapping-rendezvous", options), seed=1).recorder.rows("packets")
    assert len(packets) > 40
    assert max(packet[5] for packet in packets if packet[0] // 4 % 2 == 0) == 3
    assert max(packet[5] for packet in packets if packet[0] // 4 % 2 == 1) == 0


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("outside_policies:ONLY_A_KIND", "an exchange.AckPolicy is expected"),
        ("outside_policies:DOUBLE", "the name ack is taken by a shipped policy"),
        ("outside_policies:ANGRY", "its carries must answer for every bit of a header, but raised KeyError: 'frame'"),
        ("outside_policies:NONE", "has no attribute 'NONE'"),
        ("mps-ak", "allowed: ack, .*did you mean 'mps-ack'"),
    ],
)
def test_what_is_no_policy_is_one_clear_message(name: str, says: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        load("mapping-rendezvous", [("--policy", f"communication.policy={name}")])
    (fault,) = caught.value.faults
    assert re.search(says, fault.allowed)


def test_two_policies_of_one_name_are_refused() -> None:
    other = outside_policies.AckPolicy(outside_policies.M_ACK._replace(name="sparse"), True)
    with pytest.raises(Exception, match="two policies have the name sparse-repeat"):
        ExchangeStudy(policies=(outside_policies.SPARSE, other))
