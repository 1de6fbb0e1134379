"""The allocator that all strategies share: plans, revisions, help."""

from collections.abc import Mapping
from functools import partial
from itertools import product
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import auv, database

from remoras.database import AUVDatabase, VehicleData
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.allocation import Engagement, Expectations, helped, planned, revised
from remoras.strategies.search import Search
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


@pytest.mark.parametrize(("margin", "moved"), [(0.0, True), (0.99, False)])
def test_what_is_queued_moves_only_if_that_ends_earlier_by_the_margin(margin: float, moved: bool) -> None:
    """One vehicle has all six jobs in its queue, the other two are idle."""
    vehicles = fleet()
    of, starts = work(vehicles, group()), outlooks(vehicles)
    engaged = {
        name: Engagement((), of.roles if name == "AUV00" else (), partial(starts.__getitem__, name))
        for name in vehicles
    }
    plan = revised(of, [], of.workers, engaged, 0.0, margin)
    assert bool(plan.roles["AUV01"] or plan.roles["AUV02"]) is moved


def test_a_begun_job_stays_and_counts_from_when_it_was_begun() -> None:
    """AUV00 takes 100 m at 2 m/s and 100 s at the place: done at 150 s, whenever it is asked."""
    vehicles = fleet()
    of, expectations = work(vehicles, group(), ("AUV00", "Role0"), ("AUV00", "Role3")), Expectations()
    for now_s in (0.0, 70.0, 140.0):
        engaged = expectations.of(vehicles["AUV00"], of.held_by("AUV00"), of, now_s)
        assert [role.name for role in engaged.begun] == ["Role0"]
        assert [role.name for role in engaged.queued] == ["Role3"]
        assert engaged.outlook.free_s == pytest.approx(150.0)


@pytest.mark.parametrize(("maximum", "least_s", "helps"), [(1, 0.0, False), (2, 0.0, True), (2, 220.0, False)])
def test_who_is_idle_helps_where_there_is_room_and_it_saves_enough(maximum: int, least_s: float, helps: bool) -> None:
    """The job takes another 480 s, the way of 100 m at 2 m/s takes 50 s: help saves (480 - 50) / 2 = 215 s."""
    vehicles = fleet()
    of = work(vehicles, group(maximum), ("AUV00", "Role0"))
    found = list(helped(of, [vehicles["AUV01"]], {"Role0": 480.0}, 0.0, least_s))
    assert found == ([RoleAssignment("Team", "Role0", "AUV01")] if helps else [])


class Counted(Visit):
    """A visit that counts how often it is asked for what it takes."""

    n_asked = 0

    def after(self, outlook: Outlook, data: VehicleData) -> Outlook | None:
        Counted.n_asked += 1
        return super().after(outlook, data)


def test_of_vehicles_that_are_alike_one_is_asked_how_long_a_job_is() -> None:
    """80 jobs and 80 vehicles take all paths that one search may look at before it could exchange any.

    Each vehicle is asked from its start, 80 x 80 = 6400 times; when the k-th job goes out, at most k - 1 vehicles hold
    one and are asked how they go on from it, 80 x 79 / 2 = 3160 times in all; once for the length of each job, 80; and
    each vehicle for its own jobs in the end, 80. To ask each vehicle for each length would be 6400 more.
    """
    size = 80
    roles = tuple(RoleSpecification(f"Role{n}", 1, 1, job=f"job {n}") for n in range(size))
    of = Group("Team", (RoleSpecification("Hand", 1, founding=True), *roles))
    names = tuple(role.name for role in of.roles)
    vehicles = database(*(auv(f"AUV{n:02d}", node=n, playable_roles=names) for n in range(size)))
    jobs = {role.job or "": Counted(role.job or "", (37.0 * n % 101, 53.0 * n % 97)) for n, role in enumerate(roles)}
    played = [RoleAssignment("Team", "Hand", name) for name in vehicles]
    jobs_of_all = Work(of, Organisation.of([of], played), vehicles, jobs)
    starts = {name: Outlook(0.0, (11.0 * n % 103, 29.0 * n % 89)) for n, name in enumerate(vehicles)}
    Counted.n_asked = 0
    planned(jobs_of_all, roles, jobs_of_all.workers, starts)
    assert 6400 < Counted.n_asked <= 6400 + 3160 + 80 + 80


class Forgetful(dict[tuple[int, int], list[int]]):
    """Keeps nothing."""

    def __setitem__(self, key: tuple[int, int], value: list[int]) -> None:
        """Let it go."""


@given(
    places_m=st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=1, max_size=9),
    starts=st.lists(st.tuples(st.integers(0, 3), st.integers(-4, 4)), min_size=1, max_size=7),
    stays_s=st.lists(st.sampled_from([50.0, 100.0, 400.0]), min_size=9, max_size=9),
    apart=st.booleans(),
)
def test_exchanges_that_cannot_help_are_left_out_and_nothing_else(
    places_m: list[tuple[int, int]], starts: list[tuple[int, int]], stays_s: list[float], apart: bool
) -> None:
    """On a grid many vehicles end at the same time: then an exchange that fails may help later."""
    names = [f"AUV{n:02}" for n in range(len(starts))]
    roles = [
        RoleSpecification(
            f"Role{n}", 1, 1, job=f"job {n}", incompatible=frozenset({("Team", "Role0")} if apart and n == 1 else ())
        )
        for n in range(len(places_m))
    ]
    of = Group("Team", (RoleSpecification("Hand", 1, founding=True), *roles))
    playable = ("Hand", *(role.name for role in roles))
    vehicles = database(*(auv(name, node=n, playable_roles=playable) for n, name in enumerate(names)))
    jobs = {f"job {n}": Visit(f"job {n}", (100.0 * x, 100.0 * y), stays_s[n]) for n, (x, y) in enumerate(places_m)}
    known = Work(of, Organisation.of([of], [RoleAssignment("Team", "Hand", name) for name in vehicles]), vehicles, jobs)
    free = {name: Outlook(50.0 * at, (100.0 * x, 0.0)) for name, (at, x) in zip(names, starts, strict=True)}
    remembering, forgetting = (Search(known, known.roles, known.workers, free) for _ in range(2))
    forgetting._barren = Forgetful()
    assert remembering.found() == forgetting.found()
    assert remembering._n_paths == forgetting._n_paths


def test_a_large_fleet_looks_at_few_exchanges(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 40 vehicles most have no part in what a job moved elsewhere changes; without the memory all are tried."""
    vehicles = fleet(tuple(f"AUV{n:02}" for n in range(40)))
    of, starts = work(vehicles, group()), outlooks(vehicles)
    n_tried, tried = [], Search._end_s

    def counted(search: Search, vehicle: int, jobs: int) -> float:
        n_tried[-1] += 1
        return tried(search, vehicle, jobs)

    monkeypatch.setattr(Search, "_end_s", counted)
    for barren in (Forgetful(), {}):
        search = Search(of, of.roles, of.workers, starts)
        search._barren = barren
        n_tried.append(0)
        search.found()
    assert n_tried[1] < 0.5 * n_tried[0]
