"""Jobs of a group: open, vacant, held and done ones, and chains of jobs joined by precedence."""

from dataclasses import dataclass, replace

from samples import auv, database

from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.strategies.fixed_partition import FixedPartition, chained, chains
from remoras.testing.sample_worlds import Visit
from remoras.work import Outlook, Work

ROLES = ("Dock", "Load", "Leave", "Look")
JOBS = {
    "dock": Visit("dock", (100.0, 0.0)),
    "load": Visit("load", (100.0, 0.0), needs=("dock",)),
    "leave": Visit("leave", (200.0, 0.0), needs=("dock", "load")),
    "look": Visit("look", (-100.0, 0.0), greatest_depth_m=200.0),
}
GROUP = Group(
    "Team",
    (
        RoleSpecification("Head", 1, 1, head=True, founding=True),
        RoleSpecification("Hand", 0, founding=True),
        *(RoleSpecification(name, 1, 1, job=name.lower()) for name in ROLES),
    ),
)
FLEET = database(
    auv("AUV00", playable_roles=("Head",)),
    auv("AUV01", playable_roles=("Hand", *ROLES)),
    auv("AUV02", playable_roles=("Hand", *ROLES), depth_limit_m=300.0),
)


def work(*held: tuple[str, str], done: tuple[str, ...] = ()) -> Work:
    """The work of the team after ``done``, where (role, vehicle) of ``held`` play roles."""
    organisation = FixedPartition().form(FLEET, [GROUP])
    for role, vehicle in held:
        organisation, _ = organisation.assign(vehicle, "Team", role)
    return Work(GROUP, organisation, FLEET, JOBS, frozenset(done))


def names(roles: object) -> list[str]:
    return [role.name for role in roles]  # type: ignore[attr-defined]


@dataclass(frozen=True)
class Heavy(Visit):
    """Takes both vehicles that go under water."""

    n_vehicles: int = 2


def test_a_vehicle_that_gave_up_a_shared_job_may_still_assist() -> None:
    """Before, a job that takes all was said to be impossible once one of them had given up."""
    both = replace(work(), jobs=JOBS | {"load": Heavy("load", (100.0, 0.0))}, unable=frozenset({("AUV01", "load")}))
    assert both.impossible == both.short_handed == frozenset()
    role = GROUP.role("Load")
    assert role is not None
    assert [both.able(FLEET[name], role) for name in ("AUV01", "AUV02")] == [False, True]
    neither = replace(both, unable=both.unable | {("AUV02", "load")})
    assert neither.impossible == {"load"}


def test_jobs_joined_by_precedence_form_a_chain() -> None:
    found = [names(chain) for chain in chains(work())]
    assert sorted(found) == [["Dock", "Load", "Leave"], ["Look"]]


def test_a_chain_is_assigned_as_one_job() -> None:
    """50 s there, 60 s and 60 s at the dock, 50 s on and 60 s there: 280 s."""
    plan = chained(work())
    assert names(plan.open) == ["Dock", "Look"]
    assert plan.after(Outlook(0.0, (0.0, 0.0)), FLEET["AUV01"], plan.open[0]) == Outlook(280.0, (200.0, 0.0))
    assert [a for a in FixedPartition().adapt(work()) if a.role in ROLES] == [
        RoleAssignment("Team", "Dock", "AUV01"),
        RoleAssignment("Team", "Look", "AUV02"),
    ]


def test_the_rest_of_a_chain_is_left_to_its_first_vehicle() -> None:
    begun = work(("Dock", "AUV02"), ("Look", "AUV02"), done=("dock",))
    assert FixedPartition().adapt(begun) == ()
    organisation = Organisation.of([GROUP], [a for a in begun.organisation.assignments if a.role != "Dock"])
    orphaned = Work(GROUP, organisation, FLEET, JOBS, frozenset({"dock"}))
    assert names(chained(orphaned).vacant) == ["Load"]


def test_going_at_once_ends_the_remaining_share_of_a_wait() -> None:
    """All start at (0, 0) and go 2 m/s, so the way to (200, 0) takes 100 s.

    AUV01 has 110 s to do at (100, 0), and 50 s more to the place: 160 s. So by going at once it ends 1 - 100 / 160 of
    the wait. Where AUV02 is free and as near it ends nothing. Where all others wait themselves it ends all.
    """
    place_m, busy = (200.0, 0.0), work(("Dock", "AUV01"))
    assert busy.ended("AUV01", "AUV00", place_m, {"AUV02"}, 0.0) == 1.0 - 100.0 / 160.0
    assert busy.ended("AUV01", "AUV00", place_m, (), 0.0) == 0.0
    assert busy.ended("AUV02", "AUV00", place_m, (), 0.0) == 1.0 - 100.0 / 160.0  # it holds nothing: who else comes
    assert busy.ended("AUV01", "AUV00", place_m, {"AUV01", "AUV02"}, 0.0) == 1.0


def test_with_two_helpers_needed_the_second_arrival_ends_the_wait() -> None:
    """Alone, AUV02 would be there at once, AUV01 after 160 s; without either of them the second never comes."""
    place_m, busy = (200.0, 0.0), work(("Dock", "AUV01"))
    assert busy.ended("AUV01", "AUV00", place_m, (), 0.0, 2) == 1.0 - 100.0 / 160.0
    assert busy.ended("AUV02", "AUV00", place_m, (), 0.0, 2) == 1.0
