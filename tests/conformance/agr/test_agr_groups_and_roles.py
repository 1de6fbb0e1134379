"""Groups, roles and membership as in AGR: the organisation value, and authority to change it."""

from dataclasses import replace
from typing import Any

from resting import fleet_at_rest, hear, named
from sample_vehicles import AUV

from remoras.authority import Act, Authority, Request, Rules, may_assign
from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleSpecification
from remoras.organisation.leadership import stepping_down
from remoras.testing.sample_worlds import Visit

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


def test_an_unable_vehicle_is_assigned_no_role() -> None:
    rules = Rules(FLEET, frozenset({Authority.TAKE}), {"pit": Visit("pit", (0.0, 0.0), greatest_depth_m=1e4)})
    asked = Request("AUV01", Act.ASSIGN, "Team", "Digger", "AUV01")
    assert may_assign(asked, LED, rules) is Outcome.UNABLE


def test_absent_holders_are_displaced_and_jobs_go_to_their_successors() -> None:
    rules, asked = RULES, Request("AUV00", Act.ASSIGN, "Team", "Digger", "AUV01")
    full = played(
        *(("AUV00", "Team", "Head"), ("AUV01", "Team", "Hand")), *((f"AUV0{n}", "Team", "Digger") for n in (2, 3))
    )
    assert may_assign(asked, LED, rules) is Outcome.SUCCESS
    assert may_assign(asked, full, rules) is Outcome.NO_ROOM
    assert may_assign(asked, full, rules, absent={"AUV02"}) is Outcome.NO_ROOM  # one of two
    assert may_assign(asked, full, rules, absent={"AUV02", "AUV03"}) is Outcome.SUCCESS
    assert may_assign(asked, LED, rules, unavailable={"AUV01"}) is Outcome.UNAVAILABLE


def test_a_leader_that_steps_down_takes_a_role_of_the_succession() -> None:
    crew = Group("Crew", TEAM.roles, succession=("Hand",))
    held = [RoleAssignment(*one) for one in (("Crew", "Head", "AUV00"), ("Crew", "Hand", "AUV01"))]
    led = Organisation.of([crew], held)
    said = [("AUV00", "playsRole", "Crew.Hand"), ("AUV00", "leftRole", "Crew.Head")]
    assert stepping_down("AUV00", led, FLEET) == said
    assert stepping_down("AUV01", led, FLEET) == []
    assert stepping_down("AUV00", LED, FLEET) == []  # nobody may succeed it


def test_leaving_a_group_releases_its_roles_in_that_group_only() -> None:
    """A vehicle that resigns leaves group by group: each of its roles, in one block."""
    with fleet_at_rest() as fleet:
        leaver, peer = named(fleet, "AUV00"), named(fleet, "AUV02")
        facts: Any = leaver.social.resign()
        in_one_group = [fact for fact in facts if leaver.beliefs.name(fact[2]).startswith("Operational.")]
        block = leaver.beliefs.model.record(in_one_group, 1.0).block
        hear(peer, block)
        assert peer.social.organisation.roles_of("AUV00", "Operational") == ()
        assert [one.role for one in peer.social.organisation.roles_of("AUV00", "Coordination")] == ["Tactician"]


def test_a_lost_vehicle_is_removed_from_every_role() -> None:
    organisation = played(("AUV00", "Team", "Head"), ("AUV00", "Open", "Diver"), ("AUV01", "Team", "Hand"))
    left = organisation.without({"AUV00"})
    assert left.roles_of("AUV00") == ()
    step_by_step, _ = organisation.leave_role("AUV00", "Team", "Head")
    step_by_step, _ = step_by_step.leave_role("AUV00", "Open", "Diver")
    assert left == step_by_step
    assert left.assignments == {RoleAssignment("Team", "Hand", "AUV01")}
