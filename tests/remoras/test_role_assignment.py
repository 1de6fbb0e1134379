"""Initial role assignment of groups."""

import itertools

from hypothesis import given
from hypothesis import strategies as st
from samples import auv, database

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.initial_roles import founded

# One assignment over all roles ----------------------------------------------------------------------


def seats(*groups: Group) -> tuple[tuple[Group, RoleSpecification], ...]:
    return tuple((group, role) for group in groups for role in group.roles if role.founding)


def is_complete(organisation: Organisation, groups: tuple[Group, ...]) -> bool:
    """True if every founding role is held as it demands, by those who may hold it together."""
    for group, role in seats(*groups):
        holders = organisation.members(group.name, role.name)
        most = len(holders) if role.maximum is None else role.maximum
        if not max(role.minimum, int(role.head)) <= len(holders) <= most:
            return False
        for name in holders:
            if organisation.is_excluded(name, role):
                return False
            if role.played_by is not None and not organisation.plays(name, *role.played_by):
                return False
    return True


def can_be_complete(fleet: AUVDatabase, groups: tuple[Group, ...]) -> bool:
    """The same of some founding, by trying all of them."""
    choices = []
    for group, role in seats(*groups):
        able = [d.name for d in fleet.able_to_play(group.name, role.name) if d.social_layer or not role.head]
        some = [set(names) for n in range(len(able) + 1) for names in itertools.combinations(able, n)]
        choices.append([[RoleAssignment(group.name, role.name, name) for name in sorted(names)] for names in some])
    tried = (Organisation.of(groups, itertools.chain(*chosen)) for chosen in itertools.product(*choices))
    return any(is_complete(one, groups) for one in tried)


ROLES = ("Head", "Hand", "Eye")
PATHS = [(group, role) for group in ("Upper", "Lower") for role in ROLES[:2]]


@st.composite
def specifications(draw: st.DrawFn) -> tuple[Group, ...]:
    """Two groups with two founding roles each, some of which hang together."""
    excluded = {
        frozenset(pair) for pair in draw(st.sets(st.sampled_from([*itertools.combinations(PATHS, 2)]), max_size=2))
    }
    groups = []
    for group in ("Upper", "Lower"):
        roles = []
        for name in ROLES[:2]:
            minimum = draw(st.integers(0, 2))
            maximum = draw(st.sampled_from([None, 1, 2]))
            above = (
                draw(st.sampled_from([None, *(("Upper", role) for role in ROLES[:2])])) if group == "Lower" else None
            )
            apart = frozenset(other for pair in excluded if (group, name) in pair for other in pair - {(group, name)})
            most = maximum if maximum is None else max(maximum, minimum)
            roles.append(RoleSpecification(name, minimum, most, name == "Head", True, None, above, incompatible=apart))
        groups.append(Group(group, tuple(roles)))
    return tuple(groups)


FLEETS = st.lists(
    st.tuples(st.sets(st.sampled_from([f"{group}.{role}" for group, role in PATHS])), st.booleans()), max_size=3
)


@given(specifications(), FLEETS)
def test_all_founding_roles_are_filled_whenever_possible(groups, vehicles) -> None:
    """Against all foundings there are, tried one by one."""
    fleet = database(
        *(
            auv(f"AUV{n:02d}", playable_roles=tuple(sorted(names)), social_layer=social)
            for n, (names, social) in enumerate(vehicles)
        )
    )
    formed = founded(fleet, groups)
    assert is_complete(formed, groups) == can_be_complete(fleet, groups)
    for one in formed.assignments:
        assert fleet[one.vehicle].can_play(one.group, one.role)
