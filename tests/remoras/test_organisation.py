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


@pytest.mark.parametrize("change", ["assign", "leave_role"])
def test_a_role_in_an_unknown_group_is_refused(change: str) -> None:
    after, outcome = getattr(EMPTY, change)("AUV00", "Rescue", "Diver")
    assert (after, outcome) == (EMPTY, Outcome.NOT_GROUP)


def test_the_first_holder_creates_a_role_in_that_group_only() -> None:
    organisation = Organisation.of((OPEN, Group("Rescue")))
    organisation, outcome = organisation.assign("AUV00", "Open", "Diver")
    assert outcome is Outcome.SUCCESS
    assert organisation.members("Open", "Diver") == ("AUV00",)
    assert organisation.members("Rescue", "Diver") == ()


def test_a_group_that_names_its_roles_has_no_others() -> None:
    assert EMPTY.assign("AUV00", "Operational", "Diver") == (EMPTY, Outcome.NOT_ROLE)


def test_one_name_in_two_groups_is_two_roles() -> None:
    organisation, _ = Organisation.of((OPEN, Group("Rescue"))).assign("AUV00", "Open", "Diver")
    organisation, outcome = organisation.assign("AUV00", "Rescue", "Diver")
    assert outcome is Outcome.SUCCESS
    organisation, _ = organisation.leave_role("AUV00", "Open", "Diver")
    assert organisation.members("Rescue", "Diver") == ("AUV00",)
    assert organisation.assignments == {RoleAssignment("Rescue", "Diver", "AUV00")}


def test_a_role_held_already_is_not_given_twice() -> None:
    organisation = founded(("AUV00", "Operational", "Coordinator"))
    after, outcome = organisation.assign("AUV00", "Operational", "Coordinator")
    assert outcome is Outcome.ROLE_ALREADY_HANDLED  # and not NO_ROOM, although it has its one holder
    assert after is organisation


def test_a_second_head_is_refused() -> None:
    organisation = founded(("AUV00", "Operational", "Coordinator"))
    after, outcome = organisation.assign("AUV01", "Operational", "Coordinator")
    assert outcome is Outcome.NO_ROOM
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
    assert {one.group for one in organisation.roles_of("AUV00")} == {"Coordination", "Operational"}
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


def test_leaving_what_is_not_held_says_why() -> None:
    organisation = founded(("AUV00", "Operational", "Performer"))
    assert organisation.leave_role("AUV00", "Operational", "Wingers")[1] is Outcome.ROLE_NOT_HANDLED
    assert organisation.leave_role("AUV01", "Operational", "Wingers")[1] is Outcome.NOT_IN_GROUP


def test_a_role_without_holders_is_no_longer_there() -> None:
    organisation, _ = EMPTY.assign("AUV00", "Open", "Diver")
    organisation, _ = organisation.leave_role("AUV00", "Open", "Diver")
    assert organisation == EMPTY


# Interaction ------------------------------------------------------------------------------------


def test_heads_of_a_group() -> None:
    organisation = founded(("AUV01", "Operational", "Performer"))
    assert organisation.heads("Operational") == ()
    organisation, _ = organisation.assign("AUV00", "Operational", "Coordinator")
    assert organisation.heads("Operational") == ("AUV00",)
    assert organisation.heads("Open") == organisation.heads("Rescue") == ()


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
    # a refusal keeps every maximum
    for group in organisation.groups.values():
        for role in group.roles:
            assert role.maximum is None or len(organisation.members(group.name, role.name)) <= role.maximum


def test_the_types_of_a_set_are_a_bit_word() -> None:
    """Section V.B names eight types; a set's word has the bit of each of its activities with an effect."""
    both = activity_set(("Homing", ActivityType.GUIDANCE), ("Locating", ActivityType.NAVIGATION))
    assert len(ActivityType) == 8
    assert both.types == 0b1000
    assert both.name == "Homing"


@given(st.lists(operations, max_size=30))
def test_a_changed_organisation_answers_as_one_made_anew(asked: list[tuple[str, ...]]) -> None:
    """Its index is that of the organisation before with one change; every question has the same answer."""
    organisation = EMPTY
    for name, *arguments in asked:
        organisation, _ = getattr(organisation, name)(*arguments)
    anew = Organisation(organisation.groups, organisation.assignments)
    for group in organisation.groups:
        for role in (None, "Tactician", "Observer", "Coordinator", "Performer", "Wingers", "Diver"):
            assert organisation.members(group, role) == anew.members(group, role)
    for vehicle in ("ASV00", "AUV00", "AUV01", "AUV02"):
        assert (
            organisation.roles_of(vehicle)
            == anew.roles_of(vehicle)
            == tuple(sorted(one for one in organisation.assignments if one.vehicle == vehicle))
        )
        for group in organisation.groups:
            assert organisation.roles_of(vehicle, group) == anew.roles_of(vehicle, group)
