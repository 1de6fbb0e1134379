"""Groups, roles, membership as AGR has them, on the value and on the decision of who may change it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, cast

import pytest
from agr_fleet import fleet_at_rest, hear, named, say
from sample_vehicles import AUV

from remoras.authority import Act, Authority, Request, Rules, may_assign
from remoras.database import AUVDatabase
from remoras.errors import OrganisationError
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleSpecification
from remoras.strategies.founding import founded
from remoras.work import Job

OPEN, OTHER = Group("Open"), Group("Other")  # they name no roles: one exists as soon as somebody plays it
TEAM = Group(
    "Team",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True),
        RoleSpecification("Hand", founding=True),
        RoleSpecification("Digger", 0, 2, job="pit"),
    ),
)
ABLE = ("Head", "Hand", "Digger")
FLEET = AUVDatabase(tuple(replace(AUV, name=f"AUV0{node}", node=node, playable_roles=ABLE) for node in range(4)))
RULES = Rules(FLEET)
EMPTY = Organisation.of([OPEN, OTHER, TEAM])


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


ASSIGN, LEAVE = Organisation.assign, Organisation.leave_role


@pytest.mark.parametrize(
    ("change", "what", "outcome"),
    [
        (ASSIGN, ("AUV00", "Rescue", "Diver"), Outcome.NOT_GROUP),
        (ASSIGN, ("AUV00", "Team", "Diver"), Outcome.NOT_ROLE),  # a group that names its roles has no others
        (ASSIGN, ("AUV01", "Team", "Hand"), Outcome.ROLE_ALREADY_HANDLED),
        (ASSIGN, ("AUV01", "Team", "Head"), Outcome.NO_ROOM),
        (LEAVE, ("AUV01", "Team", "Digger"), Outcome.ROLE_NOT_HANDLED),
        (LEAVE, ("AUV02", "Team", "Digger"), Outcome.NOT_IN_GROUP),
    ],
)
def test_what_is_refused_changes_nothing(change: Any, what: tuple[str, str, str], outcome: Outcome) -> None:
    after, found = change(LED, *what)
    assert after is LED
    assert found is outcome


NEW = Rules(FLEET, at_sea={"New": Group("New", TEAM.roles, formed_by="Team")})


@pytest.mark.parametrize(
    ("asked", "rules", "outcome"),
    [
        (Request("AUV00", Act.CREATE, "Team"), RULES, Outcome.ALREADY_GROUP),
        (Request("AUV00", Act.CREATE, "New", "Head", "AUV01"), NEW, Outcome.SUCCESS),
        (Request("AUV00", Act.ASSIGN, "Rescue", "Diver", "AUV00"), RULES, Outcome.NOT_GROUP),
        (Request("AUV01", Act.ASSIGN, "Team", "Head", "AUV01"), RULES, Outcome.NO_AUTHORITY),
    ],
)
def test_groups_are_formed_once_and_their_heads_are_named_by_others(
    asked: Request, rules: Rules, outcome: Outcome
) -> None:
    assert may_assign(asked, LED, rules) is outcome


def test_an_accepted_request_creates_the_role_in_that_group_only() -> None:
    organisation = played(("AUV00", "Open", "Diver"))
    assert organisation.members("Open", "Diver") == ("AUV00",)
    assert organisation.members("Other", "Diver") == ()
    organisation, _ = played(("AUV00", "Open", "Diver"), ("AUV01", "Other", "Diver")).leave_role(
        "AUV00", "Open", "Diver"
    )
    assert (organisation.members("Open", "Diver"), organisation.members("Other", "Diver")) == ((), ("AUV01",))


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


@pytest.mark.parametrize("missing", [("", "Open", "Diver"), ("AUV00", "", "Diver"), ("AUV00", "Open", "")])
@pytest.mark.parametrize("operation", ["assign", "leave_role"])
def test_a_missing_argument_is_an_error_and_no_code(operation: str, missing: tuple[str, str, str]) -> None:
    with pytest.raises(OrganisationError, match="needs a group, a role and a vehicle"):
        getattr(EMPTY, operation)(*missing)


def test_several_roles_and_several_groups_at_once() -> None:
    organisation = played(("AUV00", "Team", "Head"), ("AUV00", "Team", "Digger"), ("AUV00", "Open", "Diver"))
    assert [one.role for one in organisation.roles_of("AUV00", "Team")] == ["Digger", "Head"]
    assert {one.group for one in organisation.roles_of("AUV00")} == {"Team", "Open"}


def test_holders_come_once_each_in_one_order() -> None:
    names = ("AUV02", "AUV00", "AUV01")
    forth = played(*((name, "Team", "Hand") for name in names))
    back = played(*((name, "Team", "Hand") for name in reversed(names)))
    assert forth.members("Team", "Hand") == back.members("Team", "Hand") == ("AUV00", "AUV01", "AUV02")


def test_a_member_is_who_plays_a_role() -> None:
    for name in FLEET.names:
        assert LED.is_member(name, "Team") == bool(LED.roles_of(name, "Team")) == (name in LED.members("Team"))


def test_leaving_the_last_role_ends_membership() -> None:
    organisation, outcome = LED.leave_role("AUV01", "Team", "Hand")
    assert outcome is Outcome.SUCCESS
    assert not organisation.is_member("AUV01", "Team")


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


def test_a_role_without_holders_ceases_to_exist() -> None:
    organisation, _ = played(("AUV00", "Open", "Diver")).leave_role("AUV00", "Open", "Diver")
    assert organisation == EMPTY
    assert organisation.members("Open") == organisation.heads("Open") == ()


def test_who_is_lost_is_removed_from_every_role() -> None:
    organisation = played(("AUV00", "Team", "Head"), ("AUV00", "Open", "Diver"), ("AUV01", "Team", "Hand"))
    left = organisation.without({"AUV00"})
    assert left.roles_of("AUV00") == ()
    step_by_step, _ = organisation.leave_role("AUV00", "Team", "Head")
    step_by_step, _ = step_by_step.leave_role("AUV00", "Open", "Diver")
    assert left == step_by_step
    assert left.assignments == {RoleAssignment("Team", "Hand", "AUV01")}
