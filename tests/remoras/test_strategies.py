"""Who gets which job when the head allocates all of them."""

from samples import GROUPS, WORKER, auv, database

from missions.mapping.jobs import SurveyJob
from remoras.database import AUVDatabase
from remoras.organisation import Organisation
from remoras.strategies import strategies
from remoras.strategies.remoras import STRATEGY
from remoras.work import Work

JOBS = {
    "left": SurveyJob("left", ((100.0, 0.0), (100.0, 100.0), (200.0, 100.0), (200.0, 0.0))),
    "right": SurveyJob("right", ((-200.0, 0.0), (-200.0, 100.0), (-100.0, 100.0), (-100.0, 0.0))),
}


def allocated(
    fleet: AUVDatabase, positions: dict[str, tuple[float, float]] | None = None, done: frozenset[str] = frozenset()
) -> tuple[Organisation, set[tuple[str, str]]]:
    """The founded organisation, and (role, vehicle) that the head allocates in it."""
    formed = STRATEGY.form(fleet, GROUPS)
    found = STRATEGY.adapt(Work(GROUPS[1], formed, fleet, JOBS, done, positions or {}))
    return formed, {(one.role, one.vehicle) for one in found}


def two_workers(**changes: object) -> AUVDatabase:
    return database(
        auv("AUV00", playable_roles=("Tactician", "Coordinator")),
        auv("AUV01", playable_roles=WORKER, **changes),
        auv("AUV02", playable_roles=WORKER),
    )


def test_jobs_go_to_who_is_near_and_other_roles_to_all_who_are_able() -> None:
    _, found = allocated(two_workers(), {"AUV01": (-300.0, 50.0), "AUV02": (300.0, 50.0)})
    assert found == {
        ("Cartographer", "AUV01"),
        ("Cartographer", "AUV02"),
        ("RightWinger", "AUV01"),
        ("LeftWinger", "AUV02"),
    }


def test_who_has_no_sensor_surveys_nothing() -> None:
    """Both areas are then left to the other one: a member takes another job when all have one."""
    _, found = allocated(two_workers(sensors=()))
    assert {role for role, name in found if name == "AUV02"} == {"Cartographer", "LeftWinger", "RightWinger"}
    assert {role for role, name in found if name == "AUV01"} == set()  # who has no work is told of no roles


def test_a_job_that_is_done_is_not_allocated() -> None:
    _, found = allocated(two_workers(), done=frozenset({"left"}))
    assert {role for role, _ in found} == {"Cartographer", "RightWinger"}


def test_what_is_held_is_not_allocated_again() -> None:
    fleet = two_workers()
    organisation, found = allocated(fleet)
    for role, name in sorted(found):
        organisation, _ = organisation.assign(name, "Operational", role)
    assert STRATEGY.adapt(Work(GROUPS[1], organisation, fleet, JOBS)) == ()


def test_the_job_of_a_vehicle_that_is_lost_goes_to_another() -> None:
    fleet = two_workers()
    organisation, found = allocated(fleet)
    for role, name in sorted(found):
        organisation, _ = organisation.assign(name, "Operational", role)
    held = organisation.roles_of("AUV01", "Operational")
    for one in held:
        organisation, _ = organisation.leave_role("AUV01", "Operational", one.role)
    again = STRATEGY.adapt(Work(GROUPS[1], organisation, fleet, JOBS))
    orphaned = [one.role for one in held if one.role.endswith("Winger")]
    assert orphaned
    assert [(one.role, one.vehicle) for one in again] == [(role, "AUV02") for role in orphaned]


def test_shipped_strategies_are_found_by_name() -> None:
    found = strategies()
    assert found["remoras"] is STRATEGY
    assert all(name == strategy.name for name, strategy in found.items())
