"""Agent/Group/Role: the axioms of Ferber, Gutknecht and Michel (2003), and what REMORAS adds to them.

The names of the tests follow the behaviour that AGR platforms agree on; the outcomes carry the names they use.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import activity_set

from remoras.activities import ActivityType
from remoras.errors import OrganisationError
from remoras.organisation import Group, Organisation, Outcome, RoleAssignment, RoleSpecification

COORDINATION = Group("Coordination", (RoleSpecification("Tactician", 1, 1), RoleSpecification("Observer")))
OPERATIONAL = Group(
    "Operational",
    (
        RoleSpecification("Coordinator", 1, 1, head=True),
        RoleSpecification("Performer", 1),
        RoleSpecification("Wingers", 0, 2),
    ),
)
OPEN = Group("Open")  # names no roles: a role exists as soon as somebody asks for it
EMPTY = Organisation.of((COORDINATION, OPERATIONAL, OPEN))


def founded(*assignments: tuple[str, str, str]) -> Organisation:
    """An organisation in which (vehicle, group, role) have been assigned one after the other."""
    organisation = EMPTY
    for vehicle, group, role in assignments:
        organisation, outcome = organisation.assign(vehicle, group, role)
        assert outcome is Outcome.SUCCESS
    return organisation


# Groups and roles -------------------------------------------------------------------------------


def test_a_group_that_exists_is_not_created_again() -> None:
    organisation = founded(("AUV00", "Operational", "Coordinator"))
    after, outcome = organisation.create_group(Group("Operational"))
    assert outcome is Outcome.ALREADY_GROUP
    assert after is organisation


def test_a_new_group_is_empty_and_the_others_stay() -> None:
    after, outcome = founded(("AUV00", "Operational", "Coordinator")).create_group(Group("Rescue"))
    assert outcome is Outcome.SUCCESS
    assert after.members("Rescue") == ()
    assert after.members("Operational") == ("AUV00",)


@pytest.mark.parametrize("change", ["assign", "leave_role"])
def test_a_role_in_an_unknown_group_is_refused(change: str) -> None:
    after, outcome = getattr(EMPTY, change)("AUV00", "Rescue", "Diver")
    assert (after, outcome) == (EMPTY, Outcome.NOT_GROUP)


def test_the_first_holder_creates_a_role_in_that_group_only() -> None:
    organisation, _ = EMPTY.create_group(Group("Rescue"))
    organisation, outcome = organisation.assign("AUV00", "Open", "Diver")
    assert outcome is Outcome.SUCCESS
    assert organisation.members("Open", "Diver") == ("AUV00",)
    assert organisation.members("Rescue", "Diver") == ()


def test_a_group_that_names_its_roles_has_no_others() -> None:
    assert EMPTY.assign("AUV00", "Operational", "Diver") == (EMPTY, Outcome.NOT_ROLE)


def test_one_name_in_two_groups_is_two_roles() -> None:
    organisation, _ = EMPTY.create_group(Group("Rescue"))
    organisation, _ = organisation.assign("AUV00", "Open", "Diver")
    organisation, outcome = organisation.assign("AUV00", "Rescue", "Diver")
    assert outcome is Outcome.SUCCESS
    organisation, _ = organisation.leave_role("AUV00", "Open", "Diver")
    assert organisation.members("Rescue", "Diver") == ("AUV00",)
    assert organisation.with_role("Diver") == (RoleAssignment("Rescue", "Diver", "AUV00"),)


def test_a_role_held_already_is_not_given_twice() -> None:
    organisation = founded(("AUV00", "Operational", "Coordinator"))
    after, outcome = organisation.assign("AUV00", "Operational", "Coordinator")
    assert outcome is Outcome.ROLE_ALREADY_HANDLED  # and not ACCESS_DENIED, although it has its one holder
    assert after is organisation


def test_a_second_head_is_refused() -> None:
    organisation = founded(("AUV00", "Operational", "Coordinator"))
    after, outcome = organisation.assign("AUV01", "Operational", "Coordinator")
    assert outcome is Outcome.ACCESS_DENIED
    assert after is organisation
    assert not after.is_member("AUV01", "Operational")


def test_a_role_becomes_free_when_its_holder_leaves_it() -> None:
    organisation = founded(("AUV00", "Operational", "Coordinator"))
    organisation, _ = organisation.leave_role("AUV00", "Operational", "Coordinator")
    _, outcome = organisation.assign("AUV01", "Operational", "Coordinator")
    assert outcome is Outcome.SUCCESS


def test_a_vehicle_plays_several_roles_in_several_groups() -> None:
    organisation = founded(
        ("AUV00", "Coordination", "Tactician"),
        ("AUV00", "Operational", "Coordinator"),
        ("AUV00", "Operational", "Wingers"),
    )
    assert organisation.groups_of("AUV00") == ("Coordination", "Operational")
    assert [a.role for a in organisation.roles_of("AUV00", "Operational")] == ["Coordinator", "Wingers"]


def test_holders_come_once_each_and_in_one_order() -> None:
    names = ("AUV02", "AUV00", "AUV01")
    forth = founded(*((name, "Operational", "Performer") for name in names))
    back = founded(*((name, "Operational", "Performer") for name in reversed(names)))
    both, _ = forth.assign("AUV00", "Operational", "Coordinator")
    assert forth.members("Operational", "Performer") == ("AUV00", "AUV01", "AUV02")
    assert both.members("Operational") == ("AUV00", "AUV01", "AUV02")
    assert forth == back


# Leaving ----------------------------------------------------------------------------------------


def test_leaving_the_last_role_ends_membership() -> None:
    organisation = founded(("AUV00", "Operational", "Performer"), ("AUV00", "Operational", "Wingers"))
    organisation, _ = organisation.leave_role("AUV00", "Operational", "Performer")
    assert organisation.is_member("AUV00", "Operational")
    organisation, _ = organisation.leave_role("AUV00", "Operational", "Wingers")
    assert not organisation.is_member("AUV00", "Operational")


def test_leaving_a_group_leaves_its_roles_and_none_elsewhere() -> None:
    organisation = founded(
        ("AUV00", "Operational", "Performer"),
        ("AUV00", "Operational", "Wingers"),
        ("AUV00", "Coordination", "Observer"),
        ("AUV01", "Operational", "Performer"),
    )
    after, outcome = organisation.leave_group("AUV00", "Operational")
    assert outcome is Outcome.SUCCESS
    assert after == founded(("AUV00", "Coordination", "Observer"), ("AUV01", "Operational", "Performer"))


def test_leaving_what_is_not_held_says_why() -> None:
    organisation = founded(("AUV00", "Operational", "Performer"))
    assert organisation.leave_role("AUV00", "Operational", "Wingers")[1] is Outcome.ROLE_NOT_HANDLED
    assert organisation.leave_role("AUV01", "Operational", "Wingers")[1] is Outcome.NOT_IN_GROUP
    assert organisation.leave_group("AUV01", "Operational")[1] is Outcome.NOT_IN_GROUP
    assert organisation.leave_group("AUV00", "Rescue")[1] is Outcome.NOT_GROUP


def test_a_role_without_holders_is_no_longer_there() -> None:
    organisation, _ = EMPTY.assign("AUV00", "Open", "Diver")
    organisation, _ = organisation.leave_role("AUV00", "Open", "Diver")
    assert organisation.with_role("Diver") == ()
    assert organisation == EMPTY


def test_losing_a_vehicle_is_its_leaving_every_role() -> None:
    organisation = founded(
        ("AUV00", "Operational", "Performer"),
        ("AUV00", "Coordination", "Tactician"),
        ("AUV01", "Operational", "Performer"),
    )
    one_by_one = organisation
    for held in organisation.roles_of("AUV00"):
        one_by_one, _ = one_by_one.leave_role("AUV00", held.group, held.role)
    assert organisation.remove("AUV00") == one_by_one
    assert one_by_one.members("Operational") == ("AUV01",)


# Interaction ------------------------------------------------------------------------------------


def test_who_is_spoken_to() -> None:
    organisation = founded(
        ("AUV00", "Operational", "Coordinator"),
        ("AUV01", "Operational", "Performer"),
        ("AUV02", "Operational", "Performer"),
        ("ASV00", "Coordination", "Observer"),
    )
    # a group, a role in it, and never the sender
    assert organisation.recipients("AUV00", "Operational") == (("AUV01", "AUV02"), Outcome.SUCCESS)
    assert organisation.recipients("AUV01", "Operational", "Performer") == (("AUV02",), Outcome.SUCCESS)
    # nobody else plays it
    assert organisation.recipients("AUV00", "Operational", "Coordinator") == ((), Outcome.NO_RECIPIENT_FOUND)
    # who is no member does not speak in the group
    assert organisation.recipients("ASV00", "Operational") == ((), Outcome.NOT_IN_GROUP)
    assert organisation.recipients("AUV00", "Rescue") == ((), Outcome.NOT_GROUP)


def test_vehicles_interact_only_if_they_share_a_group() -> None:
    organisation = founded(
        ("ASV00", "Coordination", "Observer"),
        ("AUV00", "Coordination", "Tactician"),
        ("AUV00", "Operational", "Coordinator"),
        ("AUV01", "Operational", "Performer"),
    )
    assert organisation.share_a_group("ASV00", "AUV00")
    assert organisation.share_a_group("AUV00", "AUV01")
    assert not organisation.share_a_group("ASV00", "AUV01")
    assert not organisation.share_a_group("AUV01", "AUV09")


def test_only_members_assign_in_a_group() -> None:
    """REMORAS IV.B (3): none but its members assigns roles and objectives in a group."""
    organisation = founded(("AUV00", "Operational", "Coordinator"), ("ASV00", "Coordination", "Observer"))
    assert organisation.may_assign("AUV00", "Operational")
    assert not organisation.may_assign("ASV00", "Operational")


def test_heads_of_a_group() -> None:
    organisation = founded(("AUV01", "Operational", "Performer"))
    assert organisation.heads("Operational") == ()
    organisation, _ = organisation.assign("AUV00", "Operational", "Coordinator")
    assert organisation.heads("Operational") == ("AUV00",)
    assert organisation.heads("Open") == organisation.heads("Rescue") == ()


def test_ill_formed_organisations_are_described() -> None:
    organisation = founded(("AUV00", "Operational", "Coordinator"))
    assert organisation.ill_formed() == (
        "Coordination: Tactician has 0 holders, 1 are needed",
        "Operational: Performer has 0 holders, 1 are needed",
    )
    crowded = Organisation.of(
        [Group("G", (RoleSpecification("R", 0, 1),))], [RoleAssignment("G", "R", name) for name in "ab"]
    )
    assert crowded.ill_formed() == ("G: R has 2 holders, 1 are allowed",)


@pytest.mark.parametrize("missing", [("", "Open", "Diver"), ("AUV00", "Open", "")])
def test_a_missing_name_is_an_error_and_no_outcome(missing: tuple[str, str, str]) -> None:
    with pytest.raises(OrganisationError, match="needs a group, a role and a vehicle"):
        EMPTY.assign(*missing)


# Properties -------------------------------------------------------------------------------------

vehicles = st.sampled_from(["ASV00", "AUV00", "AUV01", "AUV02"])
groups = st.sampled_from(["Coordination", "Operational", "Open", "Rescue"])
roles = st.sampled_from(["Tactician", "Observer", "Coordinator", "Performer", "Wingers", "Diver"])
operations = st.one_of(
    st.tuples(st.just("assign"), vehicles, groups, roles),
    st.tuples(st.just("leave_role"), vehicles, groups, roles),
    st.tuples(st.just("leave_group"), vehicles, groups),
)


@given(st.lists(operations, max_size=30))
def test_whatever_is_asked_the_axioms_hold(asked: list[tuple[str, ...]]) -> None:
    organisation = EMPTY
    for name, *arguments in asked:
        before = organisation
        assignments, known = before.assignments, dict(before.groups)
        organisation, outcome = getattr(before, name)(*arguments)
        # an operation changes nothing in place, and a refused one nothing at all
        assert (before.assignments, dict(before.groups)) == (assignments, known)
        assert (organisation is before) == (outcome is not Outcome.SUCCESS)
        if outcome is Outcome.SUCCESS:
            assert organisation != before
    for group in organisation.groups:
        members = organisation.members(group)
        assert list(members) == sorted(set(members))
        for vehicle in ("ASV00", "AUV00", "AUV01", "AUV02"):
            plays = bool(organisation.roles_of(vehicle, group))
            assert organisation.is_member(vehicle, group) == (vehicle in members) == plays
            assert (group in organisation.groups_of(vehicle)) == plays
    # a refusal keeps every maximum
    assert not [fault for fault in organisation.ill_formed() if "allowed" in fault]


@given(st.lists(operations, max_size=20), vehicles)
def test_removing_a_vehicle_twice_is_removing_it_once(asked: list[tuple[str, ...]], lost: str) -> None:
    organisation = EMPTY
    for name, *arguments in asked:
        organisation, _ = getattr(organisation, name)(*arguments)
    without = organisation.remove(lost)
    assert without.remove(lost) == without
    assert without.groups_of(lost) == ()
    assert {a for a in organisation.assignments if a.vehicle != lost} == without.assignments


def test_the_types_of_a_set_are_a_bit_word() -> None:
    """Section V.B names eight types; a set's word has the bit of each of its activities."""
    both = activity_set(("Homing", ActivityType.GUIDANCE), ("Locating", ActivityType.NAVIGATION))
    assert len(ActivityType) == 8
    assert both.types == 0b1100
    assert both.name == "Homing"
