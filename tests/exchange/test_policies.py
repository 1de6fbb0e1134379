import pytest

from exchange.errors import ConfigurationError
from exchange.policy.policies import ACKNOWLEDGEMENTS, POLICIES, AckPolicy, policy_fault, policy_named


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_is_found_by_its_name(name: str) -> None:
    assert policy_named(name).name == name
    assert policy_named(name).repeat is (name.endswith("-repeat") or policy_named(name).acknowledgement.codes)


def test_an_unknown_name_gets_the_allowed_and_the_nearest() -> None:
    with pytest.raises(ConfigurationError, match=r"'mps-ak'.*m-ack-repeat.*did you mean 'mps-ack'\?"):
        policy_named("mps-ak")
    with pytest.raises(ConfigurationError, match=r"allowed are ack, ack-repeat.* and package\.module:object"):
        policy_named("zzz")


def test_what_is_coded_has_to_be_stated() -> None:
    kind = ACKNOWLEDGEMENTS[0]._replace(name="mine", codes=True)
    assert policy_fault(AckPolicy(kind, True)) == (
        "codes is true and states is not: symbols are over what statements say to be held"
    )
    assert policy_fault(AckPolicy(kind._replace(states=True), True)) is None
    assert policy_fault(AckPolicy(kind._replace(states="yes"), True)) == "states must be true or false, not 'yes'"
