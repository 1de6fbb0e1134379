import pytest

from exchange.errors import ConfigurationError
from exchange.policies import (
    ACKNOWLEDGEMENTS,
    PAPER_POLICIES,
    POLICIES,
    AckPolicy,
    header_bits,
    policy_fault,
    policy_named,
)


def test_six_policies_are_three_acknowledgements_with_and_without_repeating() -> None:
    assert len(PAPER_POLICIES) == 6
    assert {(policy.acknowledgement, policy.repeat) for policy in PAPER_POLICIES.values()} == {
        (kind, repeat) for kind in ACKNOWLEDGEMENTS for repeat in (False, True)
    }


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_is_found_by_its_name(name: str) -> None:
    assert policy_named(name).name == name
    assert policy_named(name).repeat is (name.endswith("-repeat") or policy_named(name).acknowledgement.codes)


@pytest.mark.parametrize("n_nodes", [2, 3, 5, 10, 64])
def test_header_is_a_vector_or_a_matrix_without_its_diagonal(n_nodes: int) -> None:
    """Paper, sections 5.2 and 5.3: N - 1 and N (N - 1) bits; the difference is (N - 1)^2."""
    vector, matrix = (header_bits(policy_named(name), n_nodes) for name in ("ack", "mps-ack-repeat"))
    assert vector == n_nodes - 1
    assert matrix == n_nodes * (n_nodes - 1)
    assert matrix - vector == (n_nodes - 1) ** 2


def test_an_unknown_name_gets_the_allowed_and_the_nearest() -> None:
    with pytest.raises(ConfigurationError, match=r"'mps-ak'.*m-ack-repeat.*did you mean 'mps-ack'\?"):
        policy_named("mps-ak")
    with pytest.raises(ConfigurationError, match=r"allowed are ack, ack-repeat.* and package\.module:object"):
        policy_named("zzz")


def test_a_policy_says_who_repeats() -> None:
    """In the text by which lists of policies explain it."""
    repeats = {name: POLICIES[name].title for name in ("ack", "ack-repeat")}
    assert repeats["ack"].endswith(", only the origin sends an item")
    assert repeats["ack-repeat"].endswith(", others repeat items")


def test_what_is_coded_has_to_be_stated() -> None:
    kind = ACKNOWLEDGEMENTS[0]._replace(name="mine", codes=True)
    assert policy_fault(AckPolicy(kind, True)) == (
        "codes is true and states is not: symbols are over what statements say to be held"
    )
    assert policy_fault(AckPolicy(kind._replace(states=True), True)) is None
    assert policy_fault(AckPolicy(kind._replace(states="yes"), True)) == "states must be true or false, not 'yes'"
