"""Authority over the organisation: one pure decision, rule by rule."""

from dataclasses import replace

import pytest
from samples import auv, database

from remoras.authority import Act, Authority, Request, Rules, may_assign
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleSpecification

HQ = Group(
    "HQ",
    (RoleSpecification("Admiral", 1, 1, head=True, founding=True), RoleSpecification("Tactician", 1, 1, founding=True)),
    mission="Supervision",
)
TEAM = Group(
    "Team",
    (
        RoleSpecification("Coordinator", 1, 1, head=True, founding=True, played_by=("HQ", "Tactician")),
        RoleSpecification("Performer", founding=True),
        RoleSpecification("Scribe"),
        RoleSpecification("Digger", 0, 1, job="pit"),
    ),
    succession=("Performer",),
)
WORKER = ("Coordinator", "Performer", "Scribe", "Digger")
FLEET = database(
    auv("AUV00", playable_roles=("Admiral",)),
    auv("AUV01", playable_roles=("Tactician", *WORKER)),
    auv("AUV02", playable_roles=WORKER),
    auv("AUV03", playable_roles=("Performer", "Digger")),
    auv("AUV04", playable_roles=WORKER, social_layer=False),
    auv("AUV05", playable_roles=WORKER),
)
"""Admiral, Coordinator, two Performers with the social layer, one without, and one of no group."""
ORGANISATION = Organisation.of(
    [HQ, TEAM],
    [
        RoleAssignment("HQ", "Admiral", "AUV00"),
        RoleAssignment("HQ", "Tactician", "AUV01"),
        RoleAssignment("Team", "Coordinator", "AUV01"),
        RoleAssignment("Team", "Performer", "AUV02"),
        RoleAssignment("Team", "Performer", "AUV03"),
        RoleAssignment("Team", "Performer", "AUV04"),
    ],
)
DIVERS = Group(
    "Divers",
    (RoleSpecification("Scribe", 1, 1, head=True, founding=True), RoleSpecification("Digger", 0, 1)),
    formed_by="Team",
)
RULES = Rules(FLEET, supervisors={"Team": ("HQ",)}, at_sea={"Divers": DIVERS})
TAKING, RECRUITING, FOLLOWING = (replace(RULES, authorities=frozenset({one})) for one in Authority)
ALL = {"heads alone": RULES, "taking": TAKING, "recruiting": RECRUITING, "following": FOLLOWING}


def ask(issuer: str, act: Act, role: str = "Digger", assignee: str = "", group: str = "Team") -> Request:
    return Request(issuer, act, group, role, assignee)


FORMED = Organisation.of([HQ, TEAM, DIVERS], [*ORGANISATION.assignments, RoleAssignment("Divers", "Scribe", "AUV02")])
"""The same, once the Divers are formed under AUV02."""


@pytest.mark.parametrize(
    ("asked", "outcome"),
    [
        # who leads it, and who leads the group that forms it, give its roles to members of both
        (ask("AUV02", Act.ASSIGN, "Digger", "AUV03", "Divers"), Outcome.SUCCESS),
        (ask("AUV01", Act.ASSIGN, "Digger", "AUV03", "Divers"), Outcome.SUCCESS),
        (ask("AUV02", Act.ASSIGN, "Digger", "AUV05", "Divers"), Outcome.NOT_OF_GROUP),
        (ask("AUV02", Act.ASSIGN, "Digger", "AUV00", "Divers"), Outcome.NOT_OF_GROUP),
        (ask("AUV03", Act.ASSIGN, "Digger", "AUV03", "Divers"), Outcome.OUTSIDE),
        (ask("AUV00", Act.ASSIGN, "Digger", "AUV03", "Divers"), Outcome.OUTSIDE),
        (ask("AUV01", Act.SUCCEED, "Scribe", "AUV01", "Divers"), Outcome.OUTSIDE),
        (ask("AUV02", Act.ASSIGN, "Scribe", "AUV03", "Team"), Outcome.NO_AUTHORITY),  # it leads the Divers alone
        (Request("AUV01", Act.MISSION, "Divers", argument="Dig"), Outcome.SUCCESS),
        (Request("AUV00", Act.MISSION, "Divers", argument="Dig"), Outcome.NO_AUTHORITY),
        (ask("AUV01", Act.CREATE, "Scribe", "AUV02", "Divers"), Outcome.ALREADY_GROUP),
        (Request("AUV01", Act.DISSOLVE, "Divers"), Outcome.SUCCESS),
        (Request("AUV02", Act.DISSOLVE, "Divers"), Outcome.SUCCESS),
        (Request("AUV00", Act.DISSOLVE, "Divers"), Outcome.NO_AUTHORITY),
        (Request("AUV03", Act.DISSOLVE, "Divers"), Outcome.NO_AUTHORITY),
    ],
)
def test_authority_in_a_group_formed_during_the_mission(asked: Request, outcome: Outcome) -> None:
    assert may_assign(asked, FORMED, RULES) is outcome


@pytest.mark.parametrize(
    ("asked", "outcome"),
    [
        (ask("AUV01", Act.ASSIGN, assignee="AUV02"), Outcome.SUCCESS),
        (ask("AUV01", Act.ASSIGN, "Scribe", "AUV04"), Outcome.SUCCESS),  # who is plain does as the head tells it
        (ask("AUV01", Act.RELEASE, "Performer", "AUV02"), Outcome.SUCCESS),
        (ask("AUV02", Act.RELEASE, "Performer", "AUV02"), Outcome.SUCCESS),  # everybody may leave
        (ask("AUV01", Act.OBJECTIVE, "Performer"), Outcome.SUCCESS),
        (Request("AUV00", Act.MISSION, "Team", argument="Dig"), Outcome.SUCCESS),  # it is no member of the group
        (Request("AUV01", Act.MISSION, "Team", argument="Dig"), Outcome.SUCCESS),
        (ask("AUV02", Act.SUCCEED, "Coordinator", "AUV02"), Outcome.SUCCESS),
        (ask("AUV01", Act.CREATE, "Scribe", "AUV02", "Divers"), Outcome.SUCCESS),
        # group and role
        (ask("AUV01", Act.ASSIGN, "Digger", "AUV02", "Rescue"), Outcome.NOT_GROUP),
        (Request("AUV00", Act.MISSION, "Rescue"), Outcome.NOT_GROUP),
        (ask("AUV01", Act.ASSIGN, "Admiral", "AUV02"), Outcome.NOT_ROLE),
        (Request("AUV01", Act.CREATE, "HQ"), Outcome.ALREADY_GROUP),
        (Request("AUV01", Act.CREATE, "Rescue"), Outcome.NOT_GROUP),  # nobody declared it
        (Request("AUV01", Act.DISSOLVE, "Divers"), Outcome.NOT_GROUP),  # it is not there
        # member
        (ask("AUV00", Act.ASSIGN, assignee="AUV02"), Outcome.OUTSIDE),
        (ask("AUV05", Act.SUCCEED, "Coordinator", "AUV05"), Outcome.OUTSIDE),
        # social layer
        (ask("AUV04", Act.ASSIGN, assignee="AUV02"), Outcome.NO_SOCIAL_LAYER),
        (ask("AUV04", Act.SUCCEED, "Coordinator", "AUV04"), Outcome.NO_SOCIAL_LAYER),
        (Request("AUV04", Act.MISSION, "Team", argument="Dig"), Outcome.NO_SOCIAL_LAYER),
        # authority
        (ask("AUV02", Act.RELEASE, "Coordinator", "AUV01"), Outcome.NO_AUTHORITY),  # evict
        (ask("AUV02", Act.ASSIGN, "Scribe", "AUV03"), Outcome.NO_AUTHORITY),  # recruit
        (ask("AUV02", Act.ASSIGN, "Coordinator", "AUV02"), Outcome.NO_AUTHORITY),  # promote
        (ask("AUV02", Act.SUCCEED, "Coordinator", "AUV03"), Outcome.NO_AUTHORITY),  # for another
        (ask("AUV01", Act.SUCCEED, "Admiral", "AUV01", "HQ"), Outcome.NO_AUTHORITY),  # no succession there
        (ask("AUV02", Act.OBJECTIVE, "Performer"), Outcome.NO_AUTHORITY),
        (Request("AUV02", Act.MISSION, "Team", argument="Dig"), Outcome.NO_AUTHORITY),
        (Request("AUV01", Act.MISSION, "HQ", argument="Rest"), Outcome.NO_AUTHORITY),  # supervision has one direction
        (ask("AUV02", Act.CREATE, "Scribe", "AUV02", "Divers"), Outcome.NO_AUTHORITY),
        (ask("AUV00", Act.CREATE, "Scribe", "AUV02", "Divers"), Outcome.NO_AUTHORITY),  # it leads another group
        (ask("AUV04", Act.CREATE, "Scribe", "AUV02", "Divers"), Outcome.NO_SOCIAL_LAYER),
        (Request("AUV01", Act.DISSOLVE, "Team"), Outcome.NO_AUTHORITY),  # what was founded before the mission stays
        # assignee
        (ask("AUV01", Act.ASSIGN, assignee="AUV05"), Outcome.NOT_OF_GROUP),
        (ask("AUV01", Act.CREATE, "Scribe", "AUV05", "Divers"), Outcome.NOT_OF_GROUP),
        (ask("AUV01", Act.CREATE, "Scribe", "AUV03", "Divers"), Outcome.UNABLE),
        (ask("AUV01", Act.CREATE, "Scribe", "AUV04", "Divers"), Outcome.UNABLE),  # who leads needs the social layer
        (ask("AUV01", Act.ASSIGN, "Scribe", "AUV03"), Outcome.UNABLE),
        (ask("AUV01", Act.ASSIGN, "Coordinator", "AUV04"), Outcome.UNABLE),  # who leads needs the social layer
        (ask("AUV01", Act.ASSIGN, "Coordinator", "AUV02"), Outcome.INCOMPATIBLE),  # it is no Tactician
    ],
)  # fmt: skip
def test_authority_where_only_leaders_assign(asked: Request, outcome: Outcome) -> None:
    before = ORGANISATION.assignments
    assert may_assign(asked, ORGANISATION, RULES) is outcome
    assert ORGANISATION.assignments == before


TAKE, RECRUIT = ask("AUV02", Act.ASSIGN, assignee="AUV02"), ask("AUV02", Act.ASSIGN, assignee="AUV03")


@pytest.mark.parametrize(
    ("asked", "allowed_by"),
    [
        (TAKE, {"taking", "recruiting", "following"}),
        (RECRUIT, {"recruiting"}),
        (ask("AUV02", Act.RELEASE, assignee="AUV03"), {"recruiting"}),
        (ask("AUV02", Act.OBJECTIVE), {"recruiting"}),  # others only of the role that they have
        (ask("AUV02", Act.ASSIGN, "Scribe", "AUV02"), set()),  # roles with a job alone
        (ask("AUV02", Act.ASSIGN, "Coordinator", "AUV02"), set()),
        (ask("AUV02", Act.RELEASE, "Performer", "AUV03"), set()),
        (ask("AUV02", Act.ASSIGN, assignee="AUV04"), set()),  # who is plain follows the head alone
        (ask("AUV04", Act.ASSIGN, assignee="AUV04"), {"following"}),  # what was agreed before, without a word
        (ask("AUV04", Act.ASSIGN, assignee="AUV03"), set()),
        (ask("AUV05", Act.ASSIGN, assignee="AUV05"), set()),
    ],
)  # fmt: skip
def test_rules_of_a_strategy_determine_who_may_assign(asked: Request, allowed_by: set[str]) -> None:
    granted = {name for name, rules in ALL.items() if may_assign(asked, ORGANISATION, rules) is Outcome.SUCCESS}
    assert granted == allowed_by


def test_a_role_taker_sets_its_objective_and_releases_absent_holders() -> None:
    digging, _ = ORGANISATION.assign("AUV02", "Team", "Digger")
    assert may_assign(ask("AUV02", Act.OBJECTIVE), digging, TAKING) is Outcome.SUCCESS
    released = ask("AUV03", Act.RELEASE, assignee="AUV02")
    assert may_assign(released, digging, TAKING) is Outcome.NO_AUTHORITY
    assert may_assign(released, digging, TAKING, absent={"AUV02"}) is Outcome.SUCCESS


def test_authority_follows_the_leader_at_the_time_of_the_request() -> None:
    asked = ask("AUV02", Act.ASSIGN, "Scribe", "AUV02")
    assert may_assign(asked, ORGANISATION, RULES, lambda vehicle, group: vehicle == "AUV02") is Outcome.SUCCESS
    by_head = ask("AUV01", Act.ASSIGN, "Scribe", "AUV02")
    assert may_assign(by_head, ORGANISATION, RULES, lambda vehicle, group: False) is Outcome.NO_AUTHORITY


# What the specification says of roles --------------------------------------------------------------


def linked(**changes: dict[str, object]) -> Organisation:
    """The organisation in which roles of the Team have other demands."""
    roles = tuple(replace(role, **changes.get(role.name, {})) for role in TEAM.roles)  # type: ignore[arg-type]
    return Organisation.of([HQ, replace(TEAM, roles=roles)], ORGANISATION.assignments)


def test_a_role_has_authority_over_the_roles_it_names_only() -> None:
    """AUV02 and AUV04 are Performers; AUV04 has no social layer."""
    organisation = linked(Performer={"authority": ("Scribe",)})
    for act in (Act.ASSIGN, Act.RELEASE, Act.OBJECTIVE):
        asked = ask("AUV02", act, "Scribe", "" if act is Act.OBJECTIVE else "AUV04")
        assert may_assign(asked, ORGANISATION, RULES) is Outcome.NO_AUTHORITY
        assert may_assign(asked, organisation, RULES) is Outcome.SUCCESS
    assert may_assign(ask("AUV02", Act.ASSIGN, "Digger", "AUV03"), organisation, RULES) is Outcome.NO_AUTHORITY
    assert may_assign(ask("AUV04", Act.ASSIGN, "Scribe", "AUV02"), organisation, RULES) is Outcome.NO_SOCIAL_LAYER
    assert may_assign(ask("AUV05", Act.ASSIGN, "Scribe", "AUV02"), organisation, RULES) is Outcome.OUTSIDE


def test_a_role_incompatible_with_a_held_role_is_refused() -> None:
    apart = frozenset({("Team", "Performer")})
    organisation = linked(Digger={"incompatible": apart})
    asked = ask("AUV01", Act.ASSIGN, "Digger", "AUV03")
    assert may_assign(asked, ORGANISATION, RULES) is Outcome.SUCCESS
    assert may_assign(asked, organisation, RULES) is Outcome.EXCLUDED
    assert may_assign(ask("AUV01", Act.ASSIGN, "Digger", "AUV01"), organisation, RULES) is Outcome.SUCCESS
