"""The allocator shared by all strategies: plans, revisions, assistance."""

from collections.abc import Mapping
from itertools import product
from types import MappingProxyType

import pytest
from samples import auv, database

from remoras.database import AUVDatabase
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.allocation import joining, planned
from remoras.testing.sample_worlds import Visit
from remoras.work import Outlook, Work

PLACES_M = [(100.0, 0.0), (0.0, 300.0), (-200.0, 50.0), (250.0, 250.0), (-50.0, -150.0), (400.0, -100.0)]
STAYS_S = [100.0, 30.0, 200.0, 60.0, 90.0, 45.0]


def group(maximum: int | None = 1, order: int = 1, apart: Mapping[int, int] = MappingProxyType({})) -> Group:
    """A job for each place; ``apart`` says which of them no vehicle may do beside which."""
    excluded = {n: frozenset({("Team", f"Role{other}")}) for n, other in apart.items()}
    roles = [
        RoleSpecification(f"Role{n}", 1, maximum, job=f"job {n}", incompatible=excluded.get(n, frozenset()))
        for n in range(len(PLACES_M))
    ]
    return Group("Team", (RoleSpecification("Hand", 1, founding=True), *roles[::order]))


def fleet(names: tuple[str, ...] = ("AUV00", "AUV01", "AUV02")) -> AUVDatabase:
    roles = ("Hand", *(f"Role{n}" for n in range(len(PLACES_M))))
    return database(*(auv(name, node=n, playable_roles=roles) for n, name in enumerate(names)))


def work(vehicles: AUVDatabase, of: Group, *held: tuple[str, str]) -> Work:
    jobs = {
        f"job {n}": Visit(f"job {n}", place_m, stay_s)
        for n, (place_m, stay_s) in enumerate(zip(PLACES_M, STAYS_S, strict=True))
    }
    played = [RoleAssignment("Team", "Hand", name) for name in vehicles]
    played += [RoleAssignment("Team", role, name) for name, role in held]
    return Work(of, Organisation.of([of], played), vehicles, jobs)


def outlooks(vehicles: AUVDatabase) -> dict[str, Outlook]:
    return {name: Outlook(0.0, (60.0 * n, 0.0)) for n, name in enumerate(vehicles)}


@pytest.mark.parametrize("apart", [{}, {0: 3, 1: 4}, {2: 0}])
def test_no_division_of_six_jobs_among_three_ends_earlier(apart: dict[int, int]) -> None:
    """All 3^6 = 729 divisions are tried, but for those that give to one vehicle what no vehicle may do together."""
    vehicles = fleet()
    of, starts = work(vehicles, group(apart=apart)), outlooks(vehicles)

    def end_s(owners: tuple[str, ...]) -> float:
        parts = {n: [r for r, owner in zip(of.roles, owners, strict=True) if owner == n] for n in vehicles}
        return max(of.after_all(starts[name], vehicles[name], roles).free_s for name, roles in parts.items())

    divisions = product(vehicles, repeat=len(of.roles))
    best_s = min(end_s(one) for one in divisions if all(one[n] != one[other] for n, other in apart.items()))
    assert planned(of, of.roles, of.workers, starts).end_s == pytest.approx(best_s, abs=0.01)


def test_neither_the_order_of_roles_nor_names_change_a_plan() -> None:
    found = []
    for names, order in (
        (("AUV00", "AUV01", "AUV02"), 1),
        (("AUV00", "AUV01", "AUV02"), -1),
        (("V12", "V11", "V10"), 1),
    ):
        vehicles = fleet(names)
        of = work(vehicles, group(order=order))
        plan = planned(of, of.roles, of.workers, outlooks(vehicles))
        found.append([[role.job for role in plan.roles[name]] for name in vehicles])
    assert found[0] == found[1] == found[2]


@pytest.mark.parametrize(("maximum", "least_s", "helps"), [(1, 0.0, False), (2, 0.0, True), (2, 220.0, False)])
def test_idle_vehicles_assist_where_capacity_and_saving_suffice(maximum: int, least_s: float, helps: bool) -> None:
    """The job takes another 480 s, the way of 100 m at 2 m/s takes 50 s: help saves (480 - 50) / 2 = 215 s."""
    vehicles = fleet()
    of = work(vehicles, group(maximum), ("AUV00", "Role0"))
    found = list(joining(of, [vehicles["AUV01"]], {"Role0": 480.0}, 0.0, least_s))
    assert found == ([RoleAssignment("Team", "Role0", "AUV01")] if helps else [])
