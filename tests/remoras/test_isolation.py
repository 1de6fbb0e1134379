"""Isolation grace period: the owner of each job, and the time an isolated vehicle leaves it alone."""

from collections.abc import Mapping, Sequence
from itertools import permutations
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import auv, database
from team import visits

from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.organisation.membership import LATE, Patience, owners, patience_with
from remoras.work import Outlook, Point, Work

RALLY_M = (0.0, 0.0)
NAMES = A, B, C = ("AUV00", "AUV01", "AUV02")


def work_of(
    places_m: Sequence[Point], *held: tuple[str, str], positions_m: Mapping[str, Point] = MappingProxyType({})
) -> Work:
    """Work of A, who leads, B and C: visits, one role each."""
    jobs = {job.name: job for job in visits(places_m)}
    roles = [RoleSpecification(f"Role{n}", 1, 1, job=name) for n, name in enumerate(jobs)]
    hand = RoleSpecification("Hand", 0, founding=True)
    group = Group("Team", (RoleSpecification("Head", 1, 1, head=True, founding=True), hand, *roles), "jetty")
    names = [role.name for role in group.roles]
    fleet = database(*(auv(name, node=n, playable_roles=names) for n, name in enumerate(NAMES)))
    founding = [RoleAssignment("Team", "Head", A), *(RoleAssignment("Team", "Hand", name) for name in (B, C))]
    organisation = Organisation.of([group], [*founding, *(RoleAssignment("Team", role, name) for role, name in held)])
    return Work(group, organisation, fleet, jobs, positions_m=positions_m)


points_m = st.tuples(st.integers(-300, 300).map(float), st.integers(-300, 300).map(float))


@given(st.lists(points_m, min_size=1, max_size=6, unique=True), st.permutations(NAMES))
def test_the_owner_of_a_job_does_not_depend_on_present_holders(places_m, order) -> None:
    """Every job has one owner, the same in the view of each, whatever it heard of roles, positions and jobs done."""
    held = [(f"Role{n}", name) for n, name in enumerate(order[: len(places_m)])]
    found = owners(work_of(places_m))
    assert found == owners(work_of(places_m, *held))
    assert set(found) == {f"Role{n}" for n in range(len(places_m))}


def patience(
    work: Work,
    me: str = A,
    known_s: float = 100.0,
    now_s: float = 400.0,
    division: Mapping[str, str] = MappingProxyType({}),
) -> Patience:
    whole = work_of([job.place_m for job in work.jobs.values()])
    known = dict.fromkeys([name for name in NAMES if name != me], known_s)
    return patience_with([(whole, work, division)], me, known, {"jetty": RALLY_M, "buoy": (0.0, 100.0)}, now_s, 280.0)


def test_the_grace_period_covers_expected_arrival_and_a_margin() -> None:
    place_m = (0.0, 300.0)
    work = work_of([place_m], ("Role0", B), positions_m={B: (0.0, 0.0)})
    data = work.database[B]
    done = work.after_all(Outlook(100.0, (0.0, 0.0)), data, work.unfinished)
    back_s = done.free_s + 300.0 / data.transit_speed_mps
    found = patience(work)
    assert found.theirs_until_s == pytest.approx(100.0 + LATE * (back_s - 100.0))
    assert found.ends_s == pytest.approx(found.theirs_until_s + LATE * 100.0 / data.transit_speed_mps + 280.0)
    assert found.barred == {(A, "Role0"), (C, "Role0")}


@pytest.mark.parametrize("order", list(permutations(NAMES)))
def test_isolated_vehicles_leave_each_job_to_exactly_one(order: tuple[str, ...]) -> None:
    """Who is cut off may have heard of other roles: a job of which nobody has heard is still nobody else's."""
    places_m = [(0.0, 300.0), (260.0, -150.0), (-260.0, -150.0), (0.0, 60.0)]
    takes = {name: {f"Role{n}" for n in range(4)} for name in NAMES}
    for me in NAMES:
        work = work_of(places_m, ("Role3", order[0]))
        takes[me] -= {role for name, role in patience(work, me).barred if name == me}
    assert sorted(role for roles in takes.values() for role in roles) == ["Role0", "Role1", "Role2", "Role3"]
    assert "Role3" in takes[order[0]]


def test_the_strategy_messages_determine_the_owner_of_a_job() -> None:
    """Else it is whose it would have been before the mission; and a holder that is known comes before both."""
    work = work_of([(0.0, 300.0), (260.0, -150.0), (-260.0, -150.0)], ("Role2", C))
    before = owners(work_of([job.place_m for job in work.jobs.values()]))
    other = next(name for name in NAMES if name != before["Role0"])
    found = patience(work, division={"Role0": other, "Role2": A}).barred
    assert {name for name, role in found if role == "Role0"} == set(NAMES) - {other}
    assert {name for name, role in found if role == "Role1"} == set(NAMES) - {before["Role1"]}
    assert {name for name, role in found if role == "Role2"} == {A, B}
