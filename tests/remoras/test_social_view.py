"""The organisation view is a value: statements of a round are merged in any order of reception.

Anybody states anything: claims, assents, orders, objectives and missions, with authority or without, and forms and
dissolves a group at sea. AUV03 leads the fleet, AUV00 the team, whose head has to be the Tactician of the fleet.
"""

from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from samples import auv, database

from remoras.authority import Act, Authority, Request, Rules
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.social.consultation import come_back, consult, give_missions
from remoras.social.view import DatedRequest, Now, View
from remoras.testing.sample_worlds import Visit
from worldmodel import PropertyValue

ABLE = ("Chief", "Tactician", "Head", "Mate", "Digger", "Boss", "Diver")
NAMES = ("AUV00", "AUV01", "AUV02", "AUV03")
FLEET = Group(
    "Fleet",
    (RoleSpecification("Chief", 1, 1, head=True, founding=True), RoleSpecification("Tactician", 0, 1)),
    succession=("Tactician",),
)
TEAM = Group(
    "Team",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True, played_by=("Fleet", "Tactician")),
        RoleSpecification("Mate", founding=True),
        RoleSpecification("Digger", 0, 1, job="pit"),
    ),
    succession=("Mate",),
)
SEA = Group(
    "Sea", (RoleSpecification("Boss", 1, 1, head=True), RoleSpecification("Diver", 0, 1, job="pit")), formed_by="Team"
)
FOUNDED = Organisation.of(
    [FLEET, TEAM],
    [
        RoleAssignment("Fleet", "Chief", "AUV03"),
        RoleAssignment("Fleet", "Tactician", "AUV00"),
        RoleAssignment("Team", "Head", "AUV00"),
        RoleAssignment("Team", "Mate", "AUV01"),
        RoleAssignment("Team", "Mate", "AUV02"),
    ],
)


def founded(*authorities: Authority) -> View:
    able = database(*(auv(name, playable_roles=ABLE) for name in NAMES))
    rules = Rules(able, frozenset(authorities), {"pit": Visit("pit", (0.0, 0.0))}, at_sea={"Sea": SEA})
    return View.founded(FOUNDED, rules)


def dated(number: int, asked: Request, says: int | None = None) -> DatedRequest:
    """Stated as the next one; a claim is of its assignee."""
    node = NAMES.index(asked.assignee) if asked.assignee else 0
    age = (1.0 + number, NAMES.index(asked.issuer), 0, number, 0)
    return DatedRequest(age, asked, PropertyValue(0, 0, node), says)


WHO = st.sampled_from(NAMES)
PLACES = st.sampled_from(
    [("Team", role) for role in ("Head", "Mate", "Digger")] + [("Fleet", "Tactician"), ("Sea", "Diver")]
)
NUMBERS = st.integers(1, 3)


def requests(act: Any, place: Any, **more: Any) -> Any:
    """Requests of anybody: acts, places and what else is said are drawn."""
    return st.builds(
        lambda who, act, at, rest: Request(who, act, *at, **rest), WHO, act, place, st.fixed_dictionaries(more)
    )


ROLES = requests(st.sampled_from([Act.ASSIGN, Act.RELEASE]), PLACES, assignee=WHO)
AIMS = requests(st.just(Act.OBJECTIVE), PLACES, objective=st.just("Go"), argument=st.sampled_from("ab"))
MISSIONS = requests(st.just(Act.MISSION), st.sampled_from([("Team", ""), ("Sea", "")]), argument=st.sampled_from("MN"))
LEADS = requests(st.just(Act.SUCCEED), st.sampled_from([("Team", "Head"), ("Fleet", "Chief")]), assignee=WHO)
FORMS = requests(st.just(Act.CREATE), st.just(("Sea", "Boss")), assignee=WHO)
OVER = requests(st.just(Act.DISSOLVE), st.just(("Sea", "")))
STATED = st.lists(st.tuples(ROLES | AIMS | MISSIONS | LEADS | FORMS | OVER, NUMBERS), max_size=8).map(
    lambda stated: [dated(number, asked, says) for number, (asked, says) in enumerate(stated)]
)
SEEN = st.builds(Now, st.frozensets(WHO, max_size=2), st.frozensets(WHO, max_size=1))
SOME = st.sampled_from([(), (Authority.TAKE,), (Authority.TAKE, Authority.RECRUIT)])


@settings(max_examples=80)
@given(SOME, STATED, STATED, SEEN, st.randoms(use_true_random=False))
def test_order_and_repetition_within_a_round_change_nothing(authorities, first, then, now, draws) -> None:
    before = consult(founded(*authorities), first, [], now)
    after = consult(before, then, [], now)
    shuffled = draws.sample(then, len(then)) + then[:3]
    again = consult(before, shuffled, [], now)
    assert (again, again.rulings, again.unlawful) == (after, after.rulings, after.unlawful)


@settings(max_examples=40)
@given(SOME, STATED, STATED, SEEN)
def test_the_previous_view_is_not_modified(authorities, first, then, now) -> None:
    """It may be folded once more, with the same outcome: nothing of it is shared with the one after it and changed."""
    before = consult(founded(*authorities), first, then[:2], now)
    was = repr(before)
    after = consult(before, then, first[:2], now)
    give_missions(after, then, True, now)
    come_back(after, "AUV00")
    assert repr(before) == was
    assert consult(before, then, first[:2], now) == after


@settings(max_examples=80)
@given(SOME, STATED, SEEN)
def test_repetition_in_a_later_round_changes_nothing(authorities, stated, now) -> None:
    once = consult(founded(*authorities), stated, [], now)
    twice = consult(once, stated, [], now)
    for part in ("organisation", "leadership", "newest", "missions", "formations"):
        assert getattr(twice, part) == getattr(once, part), part
