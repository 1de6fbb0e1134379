"""The decision itself: each rule of who may change what has a request that it alone refuses.

What AGR leaves to the group manager, and REMORAS to heads, is asked of ``may_assign`` and of what vehicles make of what
they hear.
"""

from dataclasses import replace

import pytest
from agr_fleet import fleet_at_rest, hear, named, say
from sample_vehicles import AUV

from remoras.authority import Act, Authority, Request, Rules, may_assign
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleSpecification
from remoras.social.leadership import Age, Claim, Claimed, Leadership, next_term, read_claim, stepping_down, successor
from remoras.testing.sample_worlds import Visit
from remoras.work import Job

ABOVE = Group("Above", (RoleSpecification("Chief", 1, 1, head=True), RoleSpecification("Aide")))
CREW = Group(
    "Crew",
    (
        RoleSpecification("Captain", 1, 1, head=True, founding=True, played_by=("Above", "Aide")),
        RoleSpecification("Hand", founding=True, authority=frozenset({"Deck"})),
        RoleSpecification("Deck"),
        RoleSpecification("Cook", 0, 1, incompatible=frozenset({("Crew", "Deck")})),
        RoleSpecification("Digger", 0, 1, job="pit"),
    ),
    succession=("Hand",),
)
DIVERS = Group("Divers", (RoleSpecification("Lead", 1, 1, head=True, founding=True),), formed_by="Crew")
ROLES = ("Chief", "Aide", "Captain", "Hand", "Deck", "Cook", "Digger", "Lead")
PIT: dict[str, Job] = {"pit": Visit("pit", (0.0, 0.0), greatest_depth_m=10.0)}
FLEET = AUVDatabase(
    tuple(
        replace(AUV, name=f"V{node}", node=node, playable_roles=ROLES, depth_limit_m=100.0, social_layer=node != 4)
        for node in range(6)
    )
)
"""V4 has no social layer, V5 is in no group."""
RULES = Rules(FLEET, jobs=PIT, supervisors={"Crew": ("Above",)}, at_sea={"Divers": DIVERS})
TAKING = replace(RULES, authorities=frozenset({Authority.TAKE}))
HELD = (
    ("Above", "Chief", "V0"),
    ("Above", "Aide", "V1"),
    ("Crew", "Captain", "V1"),
    *(("Crew", "Hand", f"V{node}") for node in (2, 3, 4)),
)
LED = Organisation.of([ABOVE, CREW], [RoleAssignment(*one) for one in HELD])
"""V1 leads the crew of V2, V3 and V4, and V0 leads the group above."""


def organisation(*more: tuple[str, str, str]) -> Organisation:
    return Organisation.of([ABOVE, CREW], [RoleAssignment(*one) for one in (*HELD, *more)])


def give(issuer: str, role: str, assignee: str) -> Request:
    return Request(issuer, Act.ASSIGN, "Crew", role, assignee)


@pytest.mark.parametrize(
    ("asked", "outcome"),
    [
        (give("V1", "Deck", "V3"), Outcome.SUCCESS),
        (give("V1", "Deck", "V4"), Outcome.SUCCESS),  # a plain vehicle does as its head says
        (give("V2", "Deck", "V3"), Outcome.SUCCESS),  # a link of the specification
        (give("V2", "Cook", "V3"), Outcome.NO_AUTHORITY),
        (give("V4", "Deck", "V3"), Outcome.NO_SOCIAL_LAYER),
        (give("V5", "Deck", "V3"), Outcome.OUTSIDE),
        (give("V1", "Deck", "V5"), Outcome.NOT_OF_GROUP),
        (give("V1", "Stoker", "V3"), Outcome.NOT_ROLE),
        (Request("V1", Act.ASSIGN, "Elsewhere", "Deck", "V3"), Outcome.NOT_GROUP),
        (give("V1", "Captain", "V4"), Outcome.UNABLE),  # nobody leads without the social layer
        (give("V1", "Captain", "V2"), Outcome.INCOMPATIBLE),  # it is no aide of the group above
        (Request("V2", Act.RELEASE, "Crew", "Hand", "V2"), Outcome.SUCCESS),
        (Request("V4", Act.RELEASE, "Crew", "Hand", "V4"), Outcome.SUCCESS),  # everybody may leave
        (Request("V2", Act.RELEASE, "Crew", "Hand", "V3"), Outcome.NO_AUTHORITY),
        (Request("V1", Act.MISSION, "Crew", argument="Dig"), Outcome.SUCCESS),
        (Request("V0", Act.MISSION, "Crew", argument="Dig"), Outcome.SUCCESS),  # it leads the group above
        (Request("V2", Act.MISSION, "Crew", argument="Dig"), Outcome.NO_AUTHORITY),
        (Request("V2", Act.SUCCEED, "Crew", "Captain", "V2"), Outcome.SUCCESS),
        (Request("V2", Act.SUCCEED, "Crew", "Captain", "V3"), Outcome.NO_AUTHORITY),  # for another
        (Request("V5", Act.SUCCEED, "Crew", "Captain", "V5"), Outcome.OUTSIDE),
        (Request("V1", Act.SUCCEED, "Above", "Chief", "V1"), Outcome.NO_AUTHORITY),  # nobody may succeed there
        (Request("V1", Act.CREATE, "Divers", "Lead", "V2"), Outcome.SUCCESS),
        (Request("V2", Act.CREATE, "Divers", "Lead", "V2"), Outcome.NO_AUTHORITY),
        (Request("V1", Act.CREATE, "Crew"), Outcome.ALREADY_GROUP),
        (Request("V1", Act.DISSOLVE, "Crew"), Outcome.NO_AUTHORITY),  # it was not formed at sea
    ],
)
def test_each_rule_refuses_what_it_alone_forbids(asked: Request, outcome: Outcome) -> None:
    assert may_assign(asked, LED, RULES) is outcome


def test_a_role_has_no_more_holders_than_it_says_but_where_they_are_absent() -> None:
    full = organisation(("Crew", "Digger", "V2"))
    asked = give("V1", "Digger", "V3")
    assert may_assign(asked, LED, RULES) is Outcome.SUCCESS
    assert may_assign(asked, full, RULES) is Outcome.NO_ROOM
    assert may_assign(asked, full, RULES, absent={"V2"}) is Outcome.SUCCESS


def test_roles_that_exclude_each_other_and_jobs_nobody_is_free_or_able_to_do() -> None:
    assert may_assign(give("V1", "Cook", "V3"), organisation(("Crew", "Deck", "V3")), RULES) is Outcome.EXCLUDED
    assert may_assign(give("V1", "Digger", "V3"), LED, RULES, unavailable={"V3"}) is Outcome.UNAVAILABLE
    deep = replace(RULES, jobs={"pit": Visit("pit", (0.0, 0.0), greatest_depth_m=500.0)})
    assert may_assign(give("V1", "Digger", "V3"), LED, deep) is Outcome.UNABLE


def test_a_declared_authority_is_over_roles_with_a_job_and_for_oneself_alone() -> None:
    assert may_assign(give("V2", "Digger", "V2"), LED, RULES) is Outcome.NO_AUTHORITY
    assert may_assign(give("V2", "Digger", "V2"), LED, TAKING) is Outcome.SUCCESS
    assert may_assign(give("V2", "Digger", "V3"), LED, TAKING) is Outcome.NO_AUTHORITY
    assert may_assign(give("V2", "Cook", "V2"), LED, TAKING) is Outcome.NO_AUTHORITY


def test_who_led_when_it_asked_is_asked_and_not_who_leads_now() -> None:
    assert may_assign(give("V2", "Cook", "V3"), LED, RULES, lambda vehicle, group: vehicle == "V2") is Outcome.SUCCESS
    assert may_assign(give("V1", "Cook", "V3"), LED, RULES, lambda vehicle, group: False) is Outcome.NO_AUTHORITY


# Succession


def test_who_succeeds_plays_a_role_of_the_succession_and_has_the_social_layer() -> None:
    alone = Organisation.of([CREW], [RoleAssignment("Crew", "Hand", "V4"), RoleAssignment("Crew", "Deck", "V3")])
    assert successor(CREW, alone, FLEET) is None
    both, _ = alone.assign("V2", "Crew", "Hand")
    assert successor(CREW, both, FLEET) == "V2"


def test_a_head_that_steps_down_leaves_its_role_and_takes_one_of_the_succession() -> None:
    said = stepping_down("V1", LED, FLEET)
    assert said == [("V1", "playsRole", "Crew.Hand"), ("V1", "leftRole", "Crew.Captain")]
    assert stepping_down("V2", LED, FLEET) == []
    assert stepping_down("V0", LED, FLEET) == []  # nobody may succeed it


AGE: tuple[Age, ...] = tuple((float(time_s), 0, 0, 0, 0) for time_s in range(20))


def test_of_claims_that_count_the_greatest_leads_whatever_was_heard_first() -> None:
    """Of one term that of the lower node."""
    lesser, greater = Claimed(Claim(1, -3), AGE[5], "V3"), Claimed(Claim(2, -2), AGE[6], "V2")
    tied = Claimed(Claim(2, -3), AGE[6], "V3")
    for order in ((lesser, greater), (greater, lesser), (greater, tied)):
        known = Leadership.founded(LED)
        for claimed in order:
            known = known.claim("Crew", claimed, excused={"V1", "V2", "V3"})
        assert known.leading["Crew"].vehicle == "V2"


def test_a_claim_against_a_head_that_is_there_counts_for_nobody_until_the_head_is_missed() -> None:
    known = Leadership.founded(LED).claim("Crew", Claimed(Claim(1, -2), AGE[5], "V2"))
    assert known.leading == {}
    assert known.miss({"V1"}).leading["Crew"].vehicle == "V2"
    assert known.miss({"V3"}).leading == {}


def test_terms_go_on_by_one_and_none_leaps() -> None:
    assert (next_term(None), next_term(Claim(7, 0))) == (1, 8)
    assert read_claim(Claim(8, 0), Claim(7, 0)) == Claim(8, 0)
    assert read_claim(Claim(80, 0), Claim(7, 0)) is None
    assert read_claim(Claim(200, 0), Claim(7, 0)) is None  # 63 before it


def test_a_member_that_claims_a_group_whose_head_is_heard_is_obeyed_by_nobody() -> None:
    with fleet_at_rest() as fleet:
        claim = say(named(fleet, "AUV01"), ("Operational", "headedBy", "AUV01"), ("Operational", "headTerm", 1))  # type: ignore[arg-type]
        for name in ("AUV00", "AUV02"):
            hear(named(fleet, name), claim)
            assert named(fleet, name).social.organisation.heads("Operational") == ("AUV00",)
