"""Who led a group when: at its own age a claim counts already, a departure too, and of claims the greatest."""

from types import SimpleNamespace
from typing import Any

import pytest

from remoras.social.reigns import AGREED_BEFORE, Age, Reigns
from remoras.social.succession import Claim

GROUP = "Operational"


def age(time_s: float) -> Age:
    return (time_s, 1, 0, 0, 0)


@pytest.fixture
def reigns() -> Reigns:
    """Of one group that A founded."""
    agreed: Any = SimpleNamespace(groups=(GROUP,), heads=lambda group: ("A",))
    return Reigns(agreed)


def test_the_founder_leads_from_before_the_mission(reigns: Reigns) -> None:
    """At every age there is, that of the agreement itself included; nobody else does."""
    for at in (AGREED_BEFORE, age(-1e9), age(0.0), age(1e9)):
        assert reigns.since("A", GROUP, at) == AGREED_BEFORE
        assert reigns.led("A", GROUP, at)
        assert not reigns.led("B", GROUP, at)
        assert not reigns.led("A", "Other", at)
    assert age(0.0) > AGREED_BEFORE
    assert reigns.n_changes == 0


def test_a_claim_counts_from_its_own_age_and_ends_the_reign_before(reigns: Reigns) -> None:
    reigns.claim(GROUP, "B", Claim(1, -1), age(10.0))
    assert [reigns.led(name, GROUP, age(9.0)) for name in "AB"] == [True, False]
    assert [reigns.led(name, GROUP, age(10.0)) for name in "AB"] == [False, True]
    assert reigns.since("B", GROUP, age(10.0)) == age(10.0)
    assert reigns.is_claim(age(10.0))
    assert not reigns.is_claim(age(9.0))
    assert reigns.n_changes == 1


def test_of_claims_only_a_greater_one_counts(reigns: Reigns) -> None:
    """B claims under term 2; C under 1 later, in vain; D under 2 with a lower node, which wins."""
    reigns.claim(GROUP, "C", Claim(1, -2), age(20.0))
    reigns.claim(GROUP, "B", Claim(2, -5), age(10.0))
    reigns.claim(GROUP, "D", Claim(2, -3), age(30.0))
    assert [reigns.led(name, GROUP, age(25.0)) for name in "ABCD"] == [False, True, False, False]
    assert [reigns.led(name, GROUP, age(30.0)) for name in "ABCD"] == [False, False, False, True]
    reigns.claim(GROUP, "B", Claim(2, -3), age(40.0))  # equal to the greatest: not greater
    assert [reigns.led(name, GROUP, age(50.0)) for name in "BD"] == [False, True]


def test_who_leaves_leads_no_more_from_that_age_on(reigns: Reigns) -> None:
    reigns.change(GROUP, "A", False, age(10.0))
    assert reigns.led("A", GROUP, age(9.0))
    assert not reigns.led("A", GROUP, age(10.0))
    reigns.change(GROUP, "A", True, age(20.0))
    assert not reigns.led("A", GROUP, age(19.0))
    assert reigns.since("A", GROUP, age(20.0)) == age(20.0)
    reigns.change(GROUP, "A", False, age(20.0))  # of the same age: begun last counts
    assert reigns.led("A", GROUP, age(20.0))
    assert reigns.n_changes == 3


def test_who_has_led_has_led_before(reigns: Reigns) -> None:
    """At the very age of a claim its vehicle has not led yet; afterwards it has, whoever leads by then."""
    reigns.claim(GROUP, "B", Claim(1, -1), age(10.0))
    reigns.change(GROUP, "C", True, age(5.0))
    assert [reigns.has_led("B", GROUP, age(time_s)) for time_s in (9.0, 10.0, 11.0)] == [False, False, True]
    assert [reigns.has_led("C", GROUP, age(time_s)) for time_s in (5.0, 6.0)] == [False, True]
    assert reigns.has_led("A", GROUP, age(20.0))
    assert not reigns.has_led("B", "Other", age(20.0))


def test_a_group_that_is_formed_anew_forgets(reigns: Reigns) -> None:
    reigns.claim(GROUP, "B", Claim(1, -1), age(10.0))
    reigns.change("Other", "A", True, age(10.0))
    reigns.change(GROUP, "A", False, age(12.0))
    reigns.begin(GROUP, "C", age(20.0))
    assert [reigns.led(name, GROUP, age(20.0)) for name in "ABC"] == [False, False, True]
    assert not reigns.is_claim(age(10.0))
    assert not reigns.has_led("B", GROUP, age(30.0))
    assert reigns.led("A", "Other", age(30.0))
    reigns.begin(GROUP, None, age(40.0))
    assert not reigns.led("C", GROUP, age(50.0))
    assert reigns.n_changes == 5
