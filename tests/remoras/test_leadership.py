"""Who led a group when: at its own age a claim counts already, a departure too, and of claims the greatest."""

from types import SimpleNamespace
from typing import Any

import pytest

from remoras.social.leadership import AGREED_BEFORE, Age, LeadershipHistory
from remoras.social.succession import Claim

GROUP = "Operational"


def age(time_s: float) -> Age:
    return (time_s, 1, 0, 0, 0)


@pytest.fixture
def leadership() -> LeadershipHistory:
    """Of one group that A founded."""
    agreed: Any = SimpleNamespace(groups=(GROUP,), heads=lambda group: ("A",))
    return LeadershipHistory(agreed)


def test_the_founder_leads_from_before_the_mission(leadership: LeadershipHistory) -> None:
    """At every age there is, that of the agreement itself included; nobody else does."""
    for at in (AGREED_BEFORE, age(-1e9), age(0.0), age(1e9)):
        assert leadership.since("A", GROUP, at) == AGREED_BEFORE
        assert leadership.led("A", GROUP, at)
        assert not leadership.led("B", GROUP, at)
        assert not leadership.led("A", "Other", at)
    assert age(0.0) > AGREED_BEFORE
    assert leadership.n_changes == 0


def test_a_claim_counts_from_its_own_age_and_ends_the_reign_before(leadership: LeadershipHistory) -> None:
    leadership.claim(GROUP, "B", Claim(1, -1), age(10.0))
    assert [leadership.led(name, GROUP, age(9.0)) for name in "AB"] == [True, False]
    assert [leadership.led(name, GROUP, age(10.0)) for name in "AB"] == [False, True]
    assert leadership.since("B", GROUP, age(10.0)) == age(10.0)
    assert leadership.is_claim(age(10.0))
    assert not leadership.is_claim(age(9.0))
    assert leadership.n_changes == 1


def test_of_claims_only_a_greater_one_counts(leadership: LeadershipHistory) -> None:
    """B claims under term 2; C under 1 later, in vain; D under 2 with a lower node, which wins."""
    leadership.claim(GROUP, "C", Claim(1, -2), age(20.0))
    leadership.claim(GROUP, "B", Claim(2, -5), age(10.0))
    leadership.claim(GROUP, "D", Claim(2, -3), age(30.0))
    assert [leadership.led(name, GROUP, age(25.0)) for name in "ABCD"] == [False, True, False, False]
    assert [leadership.led(name, GROUP, age(30.0)) for name in "ABCD"] == [False, False, False, True]
    leadership.claim(GROUP, "B", Claim(2, -3), age(40.0))  # equal to the greatest: not greater
    assert [leadership.led(name, GROUP, age(50.0)) for name in "BD"] == [False, True]


def test_who_leaves_leads_no_more_from_that_age_on(leadership: LeadershipHistory) -> None:
    leadership.change(GROUP, "A", False, age(10.0))
    assert leadership.led("A", GROUP, age(9.0))
    assert not leadership.led("A", GROUP, age(10.0))
    leadership.change(GROUP, "A", True, age(20.0))
    assert not leadership.led("A", GROUP, age(19.0))
    assert leadership.since("A", GROUP, age(20.0)) == age(20.0)
    leadership.change(GROUP, "A", False, age(20.0))  # of the same age: begun last counts
    assert leadership.led("A", GROUP, age(20.0))
    assert leadership.n_changes == 3


def test_who_has_led_has_led_before(leadership: LeadershipHistory) -> None:
    """At the very age of a claim its vehicle has not led yet; afterwards it has, whoever leads by then."""
    leadership.claim(GROUP, "B", Claim(1, -1), age(10.0))
    leadership.change(GROUP, "C", True, age(5.0))
    assert [leadership.has_led("B", GROUP, age(time_s)) for time_s in (9.0, 10.0, 11.0)] == [False, False, True]
    assert [leadership.has_led("C", GROUP, age(time_s)) for time_s in (5.0, 6.0)] == [False, True]
    assert leadership.has_led("A", GROUP, age(20.0))
    assert not leadership.has_led("B", "Other", age(20.0))


def test_a_group_that_is_formed_anew_forgets(leadership: LeadershipHistory) -> None:
    leadership.claim(GROUP, "B", Claim(1, -1), age(10.0))
    leadership.change("Other", "A", True, age(10.0))
    leadership.change(GROUP, "A", False, age(12.0))
    leadership.begin(GROUP, "C", age(20.0))
    assert [leadership.led(name, GROUP, age(20.0)) for name in "ABC"] == [False, False, True]
    assert not leadership.is_claim(age(10.0))
    assert not leadership.has_led("B", GROUP, age(30.0))
    assert leadership.led("A", "Other", age(30.0))
    leadership.begin(GROUP, None, age(40.0))
    assert not leadership.led("C", GROUP, age(50.0))
    assert leadership.n_changes == 5
