"""Agent/Group/Role: the axioms of Ferber, Gutknecht and Michel (2003), and what REMORAS adds to them.

The names of the tests follow the behaviour that AGR platforms agree on; the outcomes carry the names they use.
"""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from remoras.errors import OrganisationError
from remoras.organisation import Group, Organisation, Outcome, RoleSpecification

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


@pytest.mark.parametrize(
    ("held", "change", "outcome"),
    [
        ("Performer", ("assign", "AUV00", "Rescue", "Diver"), Outcome.NOT_GROUP),
        ("Performer", ("leave_role", "AUV00", "Rescue", "Diver"), Outcome.NOT_GROUP),
        ("Performer", ("assign", "AUV00", "Operational", "Diver"), Outcome.NOT_ROLE),
        ("Coordinator", ("assign", "AUV00", "Operational", "Coordinator"), Outcome.ROLE_ALREADY_HANDLED),  # not NO_ROOM
        ("Coordinator", ("assign", "AUV01", "Operational", "Coordinator"), Outcome.NO_ROOM),
        ("Performer", ("leave_role", "AUV00", "Operational", "Wingers"), Outcome.ROLE_NOT_HANDLED),
        ("Performer", ("leave_role", "AUV01", "Operational", "Wingers"), Outcome.NOT_IN_GROUP),
    ],
)
def test_a_refusal_gives_its_reason_and_changes_nothing(held: str, change: tuple[str, ...], outcome: Outcome) -> None:
    organisation, name = founded(("AUV00", "Operational", held)), change[0]
    assert getattr(organisation, name)(*change[1:]) == (organisation, outcome)


# Interaction ------------------------------------------------------------------------------------


@pytest.mark.parametrize("missing", [("", "Open", "Diver"), ("AUV00", "Open", "")])
def test_a_missing_name_is_an_error_and_no_outcome(missing: tuple[str, str, str]) -> None:
    with pytest.raises(OrganisationError, match="needs a group, a role and a vehicle"):
        EMPTY.assign(*missing)


# Properties -------------------------------------------------------------------------------------

vehicles = st.sampled_from(["ASV00", "AUV00", "AUV01", "AUV02"])
groups = st.sampled_from(["Coordination", "Operational", "Open", "Rescue"])
roles = st.sampled_from(["Tactician", "Observer", "Coordinator", "Performer", "Wingers", "Diver"])
operations = st.one_of(
    st.tuples(st.just("assign"), vehicles, groups, roles), st.tuples(st.just("leave_role"), vehicles, groups, roles)
)


@given(st.lists(operations, max_size=30))
def test_the_axioms_hold_after_any_requests(asked: list[tuple[str, ...]]) -> None:
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
    for vehicle in ("ASV00", "AUV00", "AUV01", "AUV02"):
        in_all = tuple(sorted(one for one in organisation.assignments if one.vehicle == vehicle))
        assert organisation.roles_of(vehicle) == in_all
    # a refusal keeps every maximum
    for group in organisation.groups.values():
        for role in group.roles:
            assert role.maximum is None or len(organisation.members(group.name, role.name)) <= role.maximum
