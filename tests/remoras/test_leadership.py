"""Leadership over time: claims and departures take effect at their own time, and the greatest claim wins.

No claim counts against a head that is there: one that is not excused, has led before it and has not left.
"""

from collections.abc import Collection
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.organisation.leadership import AGREED_BEFORE, Age, Claim, Claimed, Leadership

GROUP = "Operational"


def age(time_s: float) -> Age:
    return (time_s, 1, 0, 0, 0)


FOUNDED = Organisation.of(
    [Group(GROUP, (RoleSpecification("Head", head=True),)), Group("Below"), Group("Other")],
    [RoleAssignment(GROUP, "Head", "A")],
)


class Hearer:
    """What a vehicle knows that hears one thing after another; of one group that A founded."""

    def __init__(self) -> None:
        self.known = Leadership.founded(FOUNDED)

    def claim(
        self,
        name: str,
        claim: Claim,
        at_s: float,
        excused: Collection[str] = "A",
        group: str = GROUP,
        by: str | None = None,
    ) -> bool:
        claimed = Claimed(claim, age(at_s), name)
        self.known = self.known.claim(group, claimed, frozenset(excused), by)
        return self.known.counts(group, claimed)

    def change(self, name: str, leads: bool, at_s: float, to: str | None = None, group: str = GROUP) -> None:
        self.known = self.known.change(group, name, leads, age(at_s), to)

    def begin(self, name: str | None, at_s: float, group: str = GROUP) -> None:
        self.known = self.known.begin(group, name, age(at_s))

    def heads(self, at_s: float) -> str:
        return "".join(name for name in "ABCD" if self.known.led(name, GROUP, age(at_s)))


@pytest.fixture
def hearer() -> Hearer:
    return Hearer()


def test_a_claim_takes_effect_at_its_time_and_ends_the_previous_term(hearer: Hearer) -> None:
    hearer.claim("B", Claim(1, -1), 10.0)
    assert [hearer.known.led(name, GROUP, age(9.0)) for name in "AB"] == [True, False]
    assert [hearer.known.led(name, GROUP, age(10.0)) for name in "AB"] == [False, True]
    assert hearer.known.since("B", GROUP, age(10.0)) == age(10.0)
    assert hearer.known.is_claim(age(10.0))
    assert not hearer.known.is_claim(age(9.0))


def test_a_departure_ends_leadership_at_its_time(hearer: Hearer) -> None:
    hearer.change("A", False, 10.0)
    assert hearer.known.led("A", GROUP, age(9.0))
    assert not hearer.known.led("A", GROUP, age(10.0))
    hearer.change("A", True, 20.0)
    assert not hearer.known.led("A", GROUP, age(19.0))
    assert hearer.known.since("A", GROUP, age(20.0)) == age(20.0)
    hearer.change("A", False, 20.0)  # of the same age: begun last counts
    assert hearer.known.led("A", GROUP, age(20.0))


# Which claims count -------------------------------------------------------------------------------


@pytest.mark.parametrize("term", [1, 2, 63])
def test_a_claim_against_a_present_leader_has_no_effect(hearer: Hearer, term: int) -> None:
    """Until it is missed: what is excused once stays so when it is heard again."""
    assert not hearer.claim("B", Claim(term, -1), 10.0, "")
    assert not hearer.claim("B", Claim(term, -1), 10.0, "CD")
    assert (hearer.heads(20.0), hearer.known.leading) == ("A", {})
    assert hearer.claim("B", Claim(term, -1), 10.0, "A")
    assert hearer.claim("B", Claim(term, -1), 10.0, "")
    assert (hearer.heads(9.0), hearer.heads(20.0)) == ("A", "B")
    assert hearer.known.leading[GROUP].vehicle == "B"


def test_a_renewed_claim_of_a_leader_voids_claims_made_in_its_absence(hearer: Hearer) -> None:
    """A was out of reach of some; B led for them, and what it ordered counts no longer."""
    hearer.claim("B", Claim(1, -1), 10.0)
    assert hearer.heads(15.0) == "B"
    assert hearer.claim("A", Claim(2, 0), 20.0, "")
    assert (hearer.heads(15.0), hearer.heads(25.0)) == ("A", "A")
    assert not hearer.claim("B", Claim(1, -1), 10.0, "")
    assert not hearer.claim("B", Claim(3, -1), 30.0, ""), "it has never led"


def test_a_departed_or_acknowledging_leader_has_no_precedence(hearer: Hearer) -> None:
    hearer.claim("B", Claim(1, -1), 10.0)
    hearer.change("A", False, 12.0)
    assert not hearer.claim("A", Claim(2, 0), 20.0, "")
    assert hearer.heads(25.0) == "B"
    assert hearer.claim("A", Claim(2, 0), 20.0, "B")
    assert (hearer.heads(15.0), hearer.heads(25.0)) == ("B", "A")


def test_a_claim_by_authority_of_another_group_is_valid_while_that_lasts(hearer: Hearer) -> None:
    """B leads Below, in the place of D, and so came into the group; D was there and claims Below again."""
    hearer.begin("D", 0.0, "Below")
    hearer.claim("B", Claim(1, -1), 10.0, "D", "Below")
    assert not hearer.claim("B", Claim(1, -1), 5.0, "A", by="Below")
    assert not hearer.known.is_member(GROUP, Claimed(Claim(1, -1), age(5.0), "B"))
    assert hearer.claim("B", Claim(2, -1), 15.0, "A", by="Below")
    assert hearer.claim("D", Claim(2, -3), 20.0, "", "Below")
    assert (hearer.known.leading.get(GROUP), hearer.known.without_claims(GROUP)) == (None, ("A", AGREED_BEFORE))


NAMES = st.sampled_from("ABCD")
SAID = st.tuples(NAMES, st.integers(1, 4), st.sets(NAMES)) | st.tuples(NAMES, st.none() | NAMES)
"""A claim, with those whom the hearer misses; or who leaves, or assents to whom."""


@given(st.lists(SAID, max_size=8), st.randoms(use_true_random=False))
def test_valid_claims_do_not_depend_on_reception_order(words: list[Any], draws: Random) -> None:
    """Vehicles claim, each with those whom the hearer misses, or leave; what is heard twice changes nothing."""
    told = list(enumerate(words))
    known = []
    for order in (told, draws.sample(told, len(told))):
        hearer = Hearer()
        for number, word in order:
            hear(hearer, number, word)
        once = hearer.known
        for number, word in told:
            hear(hearer, number, word)
        assert hearer.known is once
        known.append((once, once.leading, [hearer.heads(at_s) for at_s in range(9)]))
    assert known[0] == known[1]


def hear(hearer: Hearer, number: int, word: Any) -> None:
    if len(word) == 2:
        hearer.change(word[0], False, float(number), word[1])
    else:
        name, term, excused = word
        hearer.claim(name, Claim(term, -"ABCD".index(name)), float(number), excused)
