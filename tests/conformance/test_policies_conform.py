"""Shipped policies and an external one conform, and each check detects a policy that breaks its rule."""

from collections.abc import Callable
from itertools import product
from typing import Any

import nonconforming_policies as broken
import pytest

from exchange.errors import ConfigurationError
from exchange.policy.policies import POLICIES, AckPolicy
from remoras.testing import policies as conformance

ONE_OF_EACH = {policy.acknowledgement.name: policy for policy in POLICIES.values()}
"""Policies of one kind differ in whether what is acknowledged by all is sent again; what is checked is of the kind."""
CONFORMING = {**ONE_OF_EACH, "from outside": broken.SPARSE}


CASES = [
    pytest.param(check, name, id=f"{check.__name__.removeprefix('check_')}-{name}")
    for check, name in product(conformance.CHECKS, CONFORMING)
    if check is not conformance.check_compiles
]
"""A test of ``exchange`` compiles shipped policies, and a how-to one from outside."""


@pytest.mark.slow
@pytest.mark.parametrize(("check", "name"), CASES)
def test_every_shipped_policy_conforms(check: Callable[[AckPolicy], None], name: str) -> None:
    check(CONFORMING[name])


@pytest.mark.parametrize("name", broken.REPORTING)
def test_an_external_policy_may_report_holdings(name: str) -> None:
    for check in conformance.CHECKS:
        if check is not conformance.check_compiles:
            check(broken.REPORTING[name])


@pytest.mark.parametrize(
    ("check", "policy", "says"),
    [
        (conformance.check_value, broken.ONLY_A_KIND, "an exchange.AckPolicy is expected"),
        (conformance.check_value, broken.DOUBLE, "the name ack is taken by a shipped policy"),
        (conformance.check_value, broken.WRONG_SIGNATURE, r"carries must take \(n_nodes, frame, sender, row, column\)"),
        (conformance.check_value, broken.NO_FUNCTION, "its header must be a plain function of a module, not a int"),
        (conformance.check_header_bits, broken.GROWING, "differs when ``carries`` is asked again"),
        (conformance.check_no_false_beliefs, broken.LIAR, "2 nodes: in .* believes that another one holds an item"),
        (conformance.check_no_false_beliefs, broken.GULLIBLE, "which it lacks"),
        (conformance.check_no_false_beliefs, broken.CONTRARY, "which it lacks"),
        (conformance.check_bitwise, broken.MIXING, "depends on other bits"),
        (conformance.check_settles, broken.SILENT, "the item is still sent after 8 frames"),
        (conformance.check_deterministic, broken.MOODY, "other beliefs the second time"),
    ],
    ids=lambda value: value.__name__ if callable(value) else "",
)
def test_a_policy_that_breaks_a_rule_is_detected(check: Callable[[Any], None], policy: Any, says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        check(policy)


@pytest.mark.slow
def test_a_policy_that_cannot_be_compiled_is_detected() -> None:
    with pytest.raises(ConfigurationError, match="'moody' cannot be compiled"):
        conformance.check_compiles(broken.MOODY)
