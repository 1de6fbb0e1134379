"""Shipped value rules conform to their interface, and the check detects each violation."""

import pytest
from nonconforming_values import Counting, Disordered, Endless, Meddling, Nameless, Overtaking

from exchange.policy.candidates import Moment, ValueRule, Waiting
from missions.scenarios.communication import VALUE_RULES
from remoras.testing.policies import check_value_rule as check


@pytest.mark.parametrize("name", sorted(VALUE_RULES))
@pytest.mark.parametrize("seed", range(2))
def test_a_shipped_rule_conforms(name: str, seed: int) -> None:
    assert VALUE_RULES[name].name == name
    check(VALUE_RULES[name], seed)


def test_a_value_rule_without_order_conforms() -> None:
    class Unordered:
        name = "unordered"

        def place(self, waiting: Waiting) -> None:
            return None

        def value(self, waiting: Waiting, moment: Moment) -> float:
            return (moment.now_s - waiting.since_s) % 7.0

    check(Unordered())


@pytest.mark.parametrize(
    ("rule", "fault"),
    [
        (Nameless(), "name is empty"),
        (Endless(), "not a finite number"),
        (Counting(), "another answer the second time"),
        (Meddling(), "changes what it is asked about"),
        (Disordered(), "the higher rank and the lower value"),
        (Overtaking(), "the higher rank and the lower value"),
    ],
)
def test_a_value_rule_that_breaks_its_interface_is_detected(rule: ValueRule, fault: str) -> None:
    with pytest.raises(AssertionError, match=fault):
        check(rule)
