from exchange.policy.policies import ACKNOWLEDGEMENTS, AckPolicy, policy_fault


def test_what_is_coded_has_to_be_stated() -> None:
    kind = ACKNOWLEDGEMENTS[0]._replace(name="mine", codes=True)
    assert policy_fault(AckPolicy(kind, True)) == (
        "codes is true and states is not: symbols are over what statements say to be held"
    )
    assert policy_fault(AckPolicy(kind._replace(states=True), True)) is None
    assert policy_fault(AckPolicy(kind._replace(states="yes"), True)) == "states must be true or false, not 'yes'"
