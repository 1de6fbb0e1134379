"""A mission under a policy that states holdings: news is old sooner where much is lost, and nothing else gives way."""

import pytest

import remoras
from missions.errors import ConfigurationError


@pytest.mark.slow
def test_what_a_vehicle_finds_is_with_all_in_a_fraction_of_the_time() -> None:
    """At a loss of 0.8, in packets of 31 bytes: mean latency, by adaptive and by the best of the six there."""
    setting = {"per": 0.8, "seed": 1, "set": {"communication.modem": "seatrac-x150"}}
    adaptive, plain = (
        remoras.run("mapping-rendezvous", policy=policy, **setting).summary for policy in ("adaptive", "mps-ack")
    )
    assert adaptive["mean_latency_s"] < 0.4 * plain["mean_latency_s"]
    assert adaptive["completed"]
    assert adaptive["false_beliefs"] == adaptive["malformed_s"] == 0
    assert adaptive["mission_time_s"] < 1.15 * plain["mission_time_s"]


@pytest.mark.parametrize(
    "setting", ["communication.mac='aloha'", "communication.slots=['AUV00','AUV01','AUV02','AUV03']"]
)
def test_it_takes_one_slot_for_each_vehicle(setting: str) -> None:
    with pytest.raises(
        ConfigurationError, match=r'communication.policy\) = "adaptive": takes one slot for each vehicle'
    ):
        remoras.run("mapping-rendezvous", policy="adaptive", set=setting)
