"""Groups, roles, membership as AGR has them, on the value and on the decision of who may change it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import pytest
from agr_fleet import fleet_at_rest, hear, named, say
from sample_vehicles import AUV

from remoras.authority import Act, Authority, Request, Rules, may_assign
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleSpecification
from remoras.social.leadership import Age, Claim, Claimed, Leadership, next_term, read_claim, stepping_down
from remoras.strategies.founding import founded
from remoras.testing.sample_worlds import Visit
from remoras.work import Job

OPEN = Group("Open")  # it names no roles: one exists as soon as somebody plays it
HEAD = RoleSpecification("Head", 1, 1, head=True, founding=True)
TEAM = Group("Team", (HEAD, RoleSpecification("Hand", founding=True), RoleSpecification("Digger", 0, 2, job="pit")))
ABLE = ("Head", "Hand", "Digger")
FLEET = AUVDatabase(tuple(replace(AUV, name=f"AUV0{node}", node=node, playable_roles=ABLE) for node in range(4)))
RULES = Rules(FLEET)
EMPTY = Organisation.of([OPEN, TEAM])


def played(*assignments: tuple[str, str, str]) -> Organisation:
    """Vehicle, group and role, assigned one after the other."""
    organisation = EMPTY
    for one in assignments:
        organisation, outcome = organisation.assign(*one)
        assert outcome is Outcome.SUCCESS
    return organisation


LED = played(("AUV00", "Team", "Head"), ("AUV01", "Team", "Hand"))


def test_the_creator_of_a_group_leads_it_immediately() -> None:
    """A group comes into being with its head: founding fills that role first, in every group, before any other."""
    formed = founded(FLEET, [TEAM, Group("Second", TEAM.roles)])
    assert [len(formed.heads(group)) for group in formed.groups] == [1, 1]
    first = next(iter(formed.heads("Team")))
    assert formed.roles_of(first, "Team")[0].role == "Head"


@pytest.mark.parametrize("role", ["Head", "Digger"])
def test_what_the_gatekeeper_refuses_leaves_no_trace(role: str) -> None:
    """Who may change what is the gatekeeper, at every vehicle; no empty role, no membership is left behind."""
    with fleet_at_rest() as fleet:
        vehicle = named(fleet, "AUV02")
        before = vehicle.social.organisation
        path = f"Operational.{'Coordinator' if role == 'Head' else 'LeftWinger'}"
        (ruling,) = hear(vehicle, say(named(fleet, "AUV01"), ("AUV01", "playsRole", path)))
        assert ruling.outcome is Outcome.NO_AUTHORITY
        assert vehicle.social.organisation is before


def test_the_gatekeeper_is_asked_once_with_identity_and_role(monkeypatch: pytest.MonkeyPatch) -> None:
    import remoras.social.consultation as home

    asked: list[Request] = []
    real: Callable[..., Outcome] = home.may_assign
    monkeypatch.setattr(home, "may_assign", lambda one, *rest: (asked.append(one), real(one, *rest))[1])
    with fleet_at_rest() as fleet:
        block = say(named(fleet, "AUV00"), ("AUV01", "playsRole", "Operational.LeftWinger"))
        vehicle = named(fleet, "AUV02")
        hear(vehicle, block, block)  # heard twice
        hear(vehicle, block)
    assert asked == [Request("AUV00", Act.ASSIGN, "Operational", "LeftWinger", "AUV01")]


@dataclass(frozen=True)
class _Broken:
    name: str = "pit"

    def is_able(self, data: object) -> bool:
        raise RuntimeError("no data")


def test_an_exception_in_the_gatekeeper_reaches_the_requester() -> None:
    """What a mission says of ability is part of the decision."""
    rules = Rules(FLEET, frozenset({Authority.TAKE}), {"pit": cast(Job, _Broken())})
    before = LED.assignments
    with pytest.raises(RuntimeError, match="no data"):
        may_assign(Request("AUV01", Act.ASSIGN, "Team", "Digger", "AUV01"), LED, rules)
    assert LED.assignments == before


def test_who_is_not_able_to_do_its_job_is_given_no_role() -> None:
    rules = Rules(FLEET, frozenset({Authority.TAKE}), {"pit": Visit("pit", (0.0, 0.0), greatest_depth_m=1e4)})
    asked = Request("AUV01", Act.ASSIGN, "Team", "Digger", "AUV01")
    assert may_assign(asked, LED, rules) is Outcome.UNABLE


def test_room_is_made_by_the_absent_and_jobs_go_to_who_takes_them() -> None:
    rules, asked = RULES, Request("AUV00", Act.ASSIGN, "Team", "Digger", "AUV01")
    full = played(
        *(("AUV00", "Team", "Head"), ("AUV01", "Team", "Hand")), *((f"AUV0{n}", "Team", "Digger") for n in (2, 3))
    )
    assert may_assign(asked, LED, rules) is Outcome.SUCCESS
    assert may_assign(asked, full, rules) is Outcome.NO_ROOM
    assert may_assign(asked, full, rules, absent={"AUV02"}) is Outcome.NO_ROOM  # one of two
    assert may_assign(asked, full, rules, absent={"AUV02", "AUV03"}) is Outcome.SUCCESS
    assert may_assign(asked, LED, rules, unavailable={"AUV01"}) is Outcome.UNAVAILABLE


@pytest.mark.parametrize(
    ("issuer", "outcome"), [("AUV01", Outcome.SUCCESS), ("AUV00", Outcome.SUCCESS), ("AUV02", Outcome.OUTSIDE)]
)
def test_everybody_may_leave_and_the_head_alone_sends_away(issuer: str, outcome: Outcome) -> None:
    assert may_assign(Request(issuer, Act.RELEASE, "Team", "Hand", "AUV01"), LED, RULES) is outcome


AGE: tuple[Age, ...] = tuple((float(time_s), 0, 0, 0, 0) for time_s in range(20))


def test_of_claims_that_count_the_greatest_leads_whatever_was_heard_first() -> None:
    """Of one term that of the lower node."""
    lesser, greater = Claimed(Claim(1, -3), AGE[5], "AUV03"), Claimed(Claim(2, -2), AGE[6], "AUV02")
    tied = Claimed(Claim(2, -3), AGE[6], "AUV03")
    for order in ((lesser, greater), (greater, lesser), (greater, tied)):
        known = Leadership.founded(LED)
        for claimed in order:
            known = known.claim("Team", claimed, excused={"AUV00", "AUV02", "AUV03"})
        assert known.leading["Team"].vehicle == "AUV02"


def test_a_claim_against_a_head_that_is_there_counts_for_nobody_until_the_head_is_missed() -> None:
    known = Leadership.founded(LED).claim("Team", Claimed(Claim(1, -2), AGE[5], "AUV02"))
    assert known.leading == {}
    assert known.miss({"AUV00"}).leading["Team"].vehicle == "AUV02"
    assert known.miss({"AUV03"}).leading == {}


def test_terms_go_on_by_one_and_none_leaps() -> None:
    assert (next_term(None), next_term(Claim(7, 0))) == (1, 8)
    assert read_claim(Claim(8, 0), Claim(7, 0)) == Claim(8, 0)
    assert read_claim(Claim(80, 0), Claim(7, 0)) is None
    assert read_claim(Claim(200, 0), Claim(7, 0)) is None  # 63 before it


def test_a_head_that_steps_down_leaves_its_role_and_takes_one_of_the_succession() -> None:
    crew = Group("Crew", TEAM.roles, succession=("Hand",))
    held = [RoleAssignment(*one) for one in (("Crew", "Head", "AUV00"), ("Crew", "Hand", "AUV01"))]
    led = Organisation.of([crew], held)
    said = [("AUV00", "playsRole", "Crew.Hand"), ("AUV00", "leftRole", "Crew.Head")]
    assert stepping_down("AUV00", led, FLEET) == said
    assert stepping_down("AUV01", led, FLEET) == []
    assert stepping_down("AUV00", LED, FLEET) == []  # nobody may succeed it


def test_a_member_that_claims_a_group_whose_head_is_heard_is_obeyed_by_nobody() -> None:
    with fleet_at_rest() as fleet:
        claim = say(named(fleet, "AUV01"), ("Operational", "headedBy", "AUV01"), ("Operational", "headTerm", 1))  # type: ignore[arg-type]
        for name in ("AUV00", "AUV02"):
            hear(named(fleet, name), claim)
            assert named(fleet, name).social.organisation.heads("Operational") == ("AUV00",)


def test_who_leaves_a_group_leaves_all_its_roles_there_and_none_elsewhere() -> None:
    """A vehicle that resigns leaves group by group: each of its roles, in one block."""
    with fleet_at_rest() as fleet:
        leaver, peer = named(fleet, "AUV00"), named(fleet, "AUV02")
        facts: Any = leaver.social.standing.resign()
        in_one_group = [fact for fact in facts if leaver.beliefs.name(fact[2]).startswith("Operational.")]
        block = leaver.beliefs.model.record(in_one_group, 1.0).block
        hear(peer, block)
        assert peer.social.organisation.roles_of("AUV00", "Operational") == ()
        assert [one.role for one in peer.social.organisation.roles_of("AUV00", "Coordination")] == ["Tactician"]


def test_who_is_lost_is_removed_from_every_role() -> None:
    organisation = played(("AUV00", "Team", "Head"), ("AUV00", "Open", "Diver"), ("AUV01", "Team", "Hand"))
    left = organisation.without({"AUV00"})
    assert left.roles_of("AUV00") == ()
    step_by_step, _ = organisation.leave_role("AUV00", "Team", "Head")
    step_by_step, _ = step_by_step.leave_role("AUV00", "Open", "Diver")
    assert left == step_by_step
    assert left.assignments == {RoleAssignment("Team", "Hand", "AUV01")}
