"""Who led a group when: at its own age a claim counts already, a departure too, and of claims the greatest.

No claim counts against a head that is there: one that is not excused, has led before it and has not left.
"""

from collections.abc import Collection
from itertools import permutations
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.social.leadership import AGREED_BEFORE, Age, Claimed, LeadershipHistory
from remoras.social.succession import Claim

GROUP = "Operational"


def age(time_s: float) -> Age:
    return (time_s, 1, 0, 0, 0)


def of_a_group() -> LeadershipHistory:
    """Of one group that A founded."""
    agreed: Any = SimpleNamespace(groups=(GROUP,), heads=lambda group: ("A",))
    return LeadershipHistory(agreed)


leadership = pytest.fixture(of_a_group)


def claims(of: LeadershipHistory, name: str, claim: Claim, at_s: float, excused: Collection[str] = "A") -> bool:
    return of.claim(GROUP, Claimed(claim, age(at_s), name), frozenset(excused))


def heads(of: LeadershipHistory, at_s: float) -> str:
    return "".join(name for name in "ABCD" if of.led(name, GROUP, age(at_s)))


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
    claims(leadership, "B", Claim(1, -1), 10.0)
    assert [leadership.led(name, GROUP, age(9.0)) for name in "AB"] == [True, False]
    assert [leadership.led(name, GROUP, age(10.0)) for name in "AB"] == [False, True]
    assert leadership.since("B", GROUP, age(10.0)) == age(10.0)
    assert leadership.is_claim(age(10.0))
    assert not leadership.is_claim(age(9.0))
    assert leadership.n_changes == 1


def test_of_claims_only_a_greater_one_counts(leadership: LeadershipHistory) -> None:
    """B claims under term 2; C under 1 later, in vain; D under 2 with a lower node, which wins."""
    claims(leadership, "C", Claim(1, -2), 20.0, "AB")
    claims(leadership, "B", Claim(2, -5), 10.0, "AC")
    claims(leadership, "D", Claim(2, -3), 30.0, "AB")
    assert [leadership.led(name, GROUP, age(25.0)) for name in "ABCD"] == [False, True, False, False]
    assert [leadership.led(name, GROUP, age(30.0)) for name in "ABCD"] == [False, False, False, True]
    claims(leadership, "C", Claim(1, -1), 40.0, "ABD")  # lesser to the greatest: not greater
    assert [leadership.led(name, GROUP, age(50.0)) for name in "CD"] == [False, True]


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
    claims(leadership, "B", Claim(1, -1), 10.0, "AC")
    leadership.change(GROUP, "C", True, age(5.0))
    assert [leadership.has_led("B", GROUP, age(time_s)) for time_s in (9.0, 10.0, 11.0)] == [False, False, True]
    assert [leadership.has_led("C", GROUP, age(time_s)) for time_s in (5.0, 6.0)] == [False, True]
    assert leadership.has_led("A", GROUP, age(20.0))
    assert not leadership.has_led("B", "Other", age(20.0))


def test_a_group_that_is_formed_anew_forgets(leadership: LeadershipHistory) -> None:
    claims(leadership, "B", Claim(1, -1), 10.0)
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


# Which claims count -------------------------------------------------------------------------------


@pytest.mark.parametrize("term", [1, 2, 63])
def test_nobody_takes_the_lead_from_a_head_that_is_there(leadership: LeadershipHistory, term: int) -> None:
    """Until it is missed: what is excused once stays so when it is heard again."""
    assert not claims(leadership, "B", Claim(term, -1), 10.0, "")
    assert not claims(leadership, "B", Claim(term, -1), 10.0, "CD")
    assert (heads(leadership, 20.0), leadership.leading) == ("A", {})
    assert claims(leadership, "B", Claim(term, -1), 10.0, "A")
    assert claims(leadership, "B", Claim(term, -1), 10.0, "")
    assert (heads(leadership, 9.0), heads(leadership, 20.0)) == ("A", "B")
    assert leadership.leading[GROUP].vehicle == "B"


@pytest.mark.parametrize("claim", [Claim(1, -2), Claim(2, -4)], ids=["same term, lower node", "one above"])
def test_nor_from_one_that_has_claimed_in_its_place(leadership: LeadershipHistory, claim: Claim) -> None:
    """B leads in the place of A, which is lost; C hears it and claims all the same."""
    claims(leadership, "B", Claim(1, -3), 10.0)
    assert not claims(leadership, "C", claim, 11.0, "A")
    assert heads(leadership, 20.0) == "B"
    assert claims(leadership, "C", claim, 11.0, "AB")
    assert heads(leadership, 20.0) == "C"


@pytest.mark.parametrize(("lower_first", "head"), [(True, "B"), (False, "C")])
def test_of_two_that_claim_in_one_vacancy_the_earlier_leads_where_both_are_there(
    leadership: LeadershipHistory, lower_first: bool, head: str
) -> None:
    """The later one may not have heard of the earlier; whoever hears both goes by their age."""
    claims(leadership, "B", Claim(1, -1), 10.0 if lower_first else 12.0)
    claims(leadership, "C", Claim(1, -2), 12.0 if lower_first else 10.0)
    assert heads(leadership, 20.0) == head


def test_a_head_that_claims_again_voids_what_was_claimed_in_its_absence(leadership: LeadershipHistory) -> None:
    """A was out of reach of some; B led for them, and what it ordered counts no longer."""
    claims(leadership, "B", Claim(1, -1), 10.0)
    assert heads(leadership, 15.0) == "B"
    assert claims(leadership, "A", Claim(2, 0), 20.0, "")
    assert (heads(leadership, 15.0), heads(leadership, 25.0)) == ("A", "A")
    assert not claims(leadership, "B", Claim(1, -1), 10.0, "")
    assert not claims(leadership, "B", Claim(3, -1), 30.0, ""), "it has never led"


def test_who_has_left_or_assented_claims_like_anybody_else(leadership: LeadershipHistory) -> None:
    claims(leadership, "B", Claim(1, -1), 10.0)
    leadership.change(GROUP, "A", False, age(12.0))
    assert not claims(leadership, "A", Claim(2, 0), 20.0, "")
    assert heads(leadership, 25.0) == "B"
    assert claims(leadership, "A", Claim(2, 0), 20.0, "B")
    assert (heads(leadership, 15.0), heads(leadership, 25.0)) == ("B", "A")


def test_a_claim_counts_once_the_head_has_left(leadership: LeadershipHistory) -> None:
    assert not claims(leadership, "B", Claim(1, -1), 10.0, "")
    leadership.change(GROUP, "A", False, age(12.0))
    assert leadership.leading[GROUP].vehicle == "B"


def test_a_claim_that_once_counted_waits_again_if_its_head_turns_out_to_have_been_there(
    leadership: LeadershipHistory,
) -> None:
    """B was taken to have led all the while; that it had assented to another is heard later. Then C is missed."""
    claims(leadership, "B", Claim(1, -1), 10.0)
    claims(leadership, "C", Claim(2, -2), 20.0, "B")
    assert claims(leadership, "B", Claim(3, -1), 30.0, "")
    leadership.change(GROUP, "B", False, age(25.0))
    assert leadership.leading[GROUP].vehicle == "C"
    leadership.miss({"C"})
    assert leadership.leading[GROUP].vehicle == "B"


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_an_assent_to_who_has_assented_says_nothing(leadership: LeadershipHistory, order: tuple[int, ...]) -> None:
    """A was away, leads again, and B has assented to it; then A begins anew and hears the old claim of B first."""
    words = [
        lambda: claims(leadership, "B", Claim(1, -1), 10.0),
        lambda: leadership.change(GROUP, "B", False, age(20.0), to="A"),
        lambda: leadership.change(GROUP, "A", False, age(30.0), to="B"),
    ]
    claims(leadership, "A", Claim(1, 0), 12.0, "")
    for word in order:
        words[word]()
    assert heads(leadership, 40.0) == "A"
    claims(leadership, "B", Claim(2, -1), 50.0)
    leadership.change(GROUP, "A", False, age(60.0), to="B")
    assert heads(leadership, 70.0) == "B", "B has claimed since it assented"


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_an_assent_to_a_claim_that_was_answered_says_nothing(
    leadership: LeadershipHistory, order: tuple[int, ...]
) -> None:
    """B claims while A is there, and A claims again; then A begins anew and hears the claim of B first."""
    words = [
        lambda: claims(leadership, "B", Claim(1, -1), 10.0, ""),
        lambda: claims(leadership, "A", Claim(2, 0), 12.0, ""),
        lambda: leadership.change(GROUP, "A", False, age(30.0), to="B"),
    ]
    for word in order:
        words[word]()
    assert heads(leadership, 40.0) == "A"
    claims(leadership, "B", Claim(3, -1), 50.0)
    leadership.change(GROUP, "A", False, age(60.0), to="B")
    assert heads(leadership, 70.0) == "B"


def test_who_has_left_leads_no_longer_by_an_old_claim_however_great(leadership: LeadershipHistory) -> None:
    claims(leadership, "B", Claim(40, -1), 10.0)
    leadership.change(GROUP, "B", False, age(20.0))
    claims(leadership, "C", Claim(2, -2), 30.0)
    assert (heads(leadership, 15.0), heads(leadership, 25.0), heads(leadership, 35.0)) == ("B", "", "C")
    assert leadership.leading[GROUP].vehicle == "C"


def test_a_claim_by_the_lead_of_another_group_counts_as_long_as_that_does(leadership: LeadershipHistory) -> None:
    """B leads Below, in the place of D, and so came into the group; D was there and claims Below again."""
    leadership.begin("Below", "D", age(0.0))
    leadership.claim("Below", Claimed(Claim(1, -1), age(10.0), "B"), frozenset("D"))
    early, late = (Claimed(Claim(term, -1), age(at_s), "B") for term, at_s in ((1, 5.0), (2, 15.0)))
    assert not leadership.claim(GROUP, early, frozenset("A"), "Below")
    assert not leadership.is_member(GROUP, early)
    assert leadership.claim(GROUP, late, frozenset("A"), "Below")
    assert leadership.claim("Below", Claimed(Claim(2, -3), age(20.0), "D"))
    assert (leadership.leading.get(GROUP), leadership.without_claims(GROUP)) == (None, ("A", AGREED_BEFORE))


NAMES = st.sampled_from("ABCD")
SAID = st.tuples(NAMES, st.integers(1, 4), st.sets(NAMES)) | st.tuples(NAMES, st.none() | NAMES)
"""A claim, with those whom the hearer misses; or who leaves, or assents to whom."""


@given(st.lists(SAID, max_size=8), st.randoms(use_true_random=False))
def test_which_claims_count_does_not_depend_on_what_was_heard_first(words: list[Any], draws: Random) -> None:
    """Vehicles claim, each with those whom the hearer misses, or leave; what is heard twice changes nothing."""
    told = list(enumerate(words))
    found = []
    for order in (told, draws.sample(told, len(told)) + told[:3]):
        history = of_a_group()
        for number, word in order:
            if len(word) == 2:
                history.change(GROUP, word[0], False, age(float(number)), word[1])
            else:
                name, term, excused = word
                claims(history, name, Claim(term, -"ABCD".index(name)), float(number), excused)
        found.append((history.leading, [heads(history, at_s) for at_s in range(9)]))
    assert found[0] == found[1]
