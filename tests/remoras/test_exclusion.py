"""Roles that exclude each other are given to no vehicle together, by whatever gives roles out."""

import itertools
from collections.abc import Iterator

from hypothesis import given
from hypothesis import strategies as st
from samples import auv, database
from team import visits

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.organisation.leadership import role_after
from remoras.strategies.founding import common_roles, founded
from remoras.work import Work

NAMES = ("Head", "Hand", "Eye", "Miner")
CREW = tuple(f"AUV{n:02d}" for n in range(3))
PAIRS = st.sets(st.sampled_from([frozenset(pair) for pair in itertools.combinations(NAMES, 2)]), min_size=1, max_size=3)
HELD = st.sets(st.tuples(st.sampled_from(CREW), st.sampled_from(NAMES)))


def group_with(excluding: set[frozenset[str]], founding: bool) -> Group:
    """One group; ``Miner`` has a job, ``Head`` leads, and who leads no longer takes what is left of the others."""
    roles = []
    for name in NAMES:
        others = frozenset(("Team", other) for pair in excluding if name in pair for other in pair - {name})
        job = "job 0" if name == "Miner" else None
        is_founding = name == "Head" or (founding and job is None)
        roles.append(RoleSpecification(name, 1, 3, name == "Head", is_founding, job, incompatible=others))
    return Group("Team", tuple(roles), succession=("Hand", "Eye"))


def fleet_of(group: Group, n: int = len(CREW)) -> AUVDatabase:
    paths = tuple(group.path(name) for name in NAMES)
    return database(*(auv(name, playable_roles=paths) for name in CREW[:n]))


def both(organisation: Organisation, group: Group) -> Iterator[tuple[str, str, frozenset[tuple[str, str]]]]:
    """Vehicles with two roles that exclude each other."""
    for role in group.roles:
        for name in organisation.members(group.name, role.name):
            if held := frozenset(other for other in role.incompatible if organisation.plays(name, *other)):
                yield name, role.name, held


@given(PAIRS, st.integers(1, 3))
def test_a_founding_keeps_them_apart_even_where_it_cannot_fill_all_roles(
    excluding: set[frozenset[str]], n_vehicles: int
) -> None:
    group = group_with(excluding, founding=True)
    assert list(both(founded(fleet_of(group, n_vehicles), (group,)), group)) == []


@given(PAIRS, HELD)
def test_nobody_is_given_a_role_that_one_of_its_own_excludes(
    excluding: set[frozenset[str]], held: set[tuple[str, str]]
) -> None:
    """Of what is held already any part may exclude another: what comes to it may not."""
    group, (job,) = group_with(excluding, founding=False), visits([(0.0, 0.0)])
    fleet = fleet_of(group)
    has = Organisation.of((group,), (RoleAssignment("Team", role, name) for name, role in held))
    work = Work(group, has, fleet, {job.name: job})
    for given_out in common_roles(work):
        role = group.role(given_out.role)
        assert role is not None
        assert not has.is_excluded(given_out.vehicle, role)
    for name in CREW:
        miner = work.unfinished[0]
        assert work.able(fleet[name], miner) == (not has.is_excluded(name, miner))
        after = role_after(fleet, name, group, has)
        assert after is None or not any(has.plays(name, *other) for other in group.role(after.role).incompatible)
