"""Reported energy and sensors determine job assignment; without them missions are worse.

Two vehicles, two visits: `far` at (600, 0), `near` at (-100, 0). AUV00, the head, starts at (0, 0), AUV01 at (50, 0),
so by time alone AUV01 goes far. That takes it 275 s in transit at 20 + 10 * 2^3 = 100 W, a stay of 40 s, and 458 s home
with the margin, at 20 + 10 * 1.5^3 = 54 W: 27.5 + 2.2 + 24.6 = 54 kJ. To go near takes 7.5 + 2.2 + 6.7 = 16 kJ.
"""

import pytest
from visiting_mission import VisitTable, visiting_scenario

from missions.runs.assembly import assemble
from missions.runs.run import Run, run
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.social.workload import Workload
from remoras.strategies import strategies
from remoras.strategies.allocation import Engagement, affordable, planned
from remoras.testing.sample_worlds import Visit
from remoras.work import Outlook, Work
from tests.remoras.samples import auv, database
from worldmodel import merge

ENOUGH_TO_GO_NEAR_J = 30e3
CASES = ["remoras", "contract-net", "cbba", "fixed-partition"]


def visits(strategy: str, energy_j: float) -> Run:
    shipped = visiting_scenario(0.0)
    starts = {"AUV00": (0.0, 0.0), "AUV01": (50.0, 0.0)}
    places = {"place 0": (600.0, 0.0), "place 1": (-100.0, 0.0)}
    table = tuple(VisitTable(name=name, place_m=at_m, stay_s=40.0) for name, at_m in places.items())
    group = shipped.group[0]
    roles = tuple(role for role in group.role if role.job is None or role.job in places)
    vehicles = tuple(
        one.model_copy(
            update={
                "start_m": starts[one.name], "playable_roles": one.playable_roles[:-3],
                "energy_j": energy_j if one.name == "AUV01" else one.energy_j,
            }
        )
        for one in shipped.vehicle
        if one.name in starts
    )  # fmt: skip
    world = shipped.world.model_copy(update={"x_m": (-300.0, 900.0)})
    parts = {"vehicle": vehicles, "visit": table, "group": (group.model_copy(update={"role": roles}),), "world": world}
    return run(shipped.model_copy(update=parts), seed=3, strategy=strategies()[strategy])


def visitors(finished: Run) -> list[str]:
    found = {one.name: one.vehicle for one in reversed(finished.milestones)}
    return [found["visited place 0"], found["visited place 1"]]


@pytest.mark.slow
@pytest.mark.parametrize("strategy", CASES)
def test_low_energy_limits_assignment_to_feasible_jobs(strategy: str, monkeypatch: pytest.MonkeyPatch) -> None:
    ample, short = visits(strategy, 2e6), visits(strategy, ENOUGH_TO_GO_NEAR_J)
    assert ample.completed
    assert short.completed
    assert visitors(ample) == ["AUV01", "AUV00"]
    assert visitors(short) == ["AUV00", "AUV01"]
    assert short.end_s < ample.end_s + 60.0  # the way from 0 instead of 50 m, and rounds of consultation
    monkeypatch.setattr("remoras.social.agreement.scarce_energy_j", lambda *of: {})
    monkeypatch.setattr(Workload, "scarce_energy_j", lambda *of: {})
    unseen = visits(strategy, ENOUGH_TO_GO_NEAR_J)
    assert not unseen.completed or unseen.end_s > short.end_s + 100.0


# What was told -----------------------------------------------------------------------------------

JOB_ROLES = [RoleSpecification(name, 1, 1, job=name.lower()) for name in ("Far", "Near")]
TEAM = Group("Team", (RoleSpecification("Head", 1, 1, head=True, founding=True), *JOB_ROLES))
JOBS = {"far": Visit("far", (600.0, 0.0)), "near": Visit("near", (100.0, 0.0))}
FLEET = database(*(auv(name, playable_roles=("Head", "Far", "Near")) for name in ("AUV00", "AUV01")))


def work(energy_j: dict[str, float], *held: str) -> Work:
    played = [RoleAssignment("Team", "Head", name) for name in FLEET]
    played += [RoleAssignment("Team", role, "AUV01") for role in held]
    return Work(TEAM, Organisation.of([TEAM], played), FLEET, JOBS, energy_j=energy_j)


def roles_of(energy_j: dict[str, float]) -> dict[str, list[str]]:
    team = work(energy_j)
    outlooks = {name: Outlook(0.0, data.start_m) for name, data in FLEET.items()}
    plan = planned(team, team.vacant, team.workers, outlooks)
    return {name: [role.name for role in roles] for name, roles in plan.roles.items()}


def needs_j(team: Work, vehicle: str, role: str) -> float:
    """The least energy, to the joule, that lasts for a job."""
    data, of = FLEET[vehicle], next(one for one in JOB_ROLES if one.name == role)
    low, high = 0, 10**7
    while low < high:
        middle = (low + high) // 2
        fits = work({vehicle: float(middle)}).affords(Outlook(0.0, data.start_m), data, of)
        low, high = (low, middle) if fits else (middle + 1, high)
    return float(low)


def test_a_plan_moves_infeasible_jobs_to_able_vehicles_only() -> None:
    far_j, near_j = (needs_j(work({}), "AUV01", role) for role in ("Far", "Near"))
    assert far_j > near_j > 0.0
    assert roles_of({"AUV01": far_j - 1.0})["AUV00"] == ["Far"]
    assert roles_of({"AUV01": near_j - 1.0}) == {"AUV00": ["Near", "Far"], "AUV01": []}
    nobody = roles_of({"AUV00": 0.0, "AUV01": near_j})
    assert nobody == {"AUV00": [], "AUV01": ["Near"]}


def test_a_held_job_beyond_the_energy_of_its_vehicle_is_not_counted() -> None:
    far, near = JOB_ROLES
    engaged = Engagement((), (near, far), lambda: Outlook(0.0, (0.0, 0.0)))
    assert affordable(work({}), FLEET["AUV01"], engaged) == (near, far)
    near_j = needs_j(work({}), "AUV01", "Near")
    assert affordable(work({"AUV01": near_j}), FLEET["AUV01"], engaged) == (near,)


def test_energy_is_the_last_report_minus_consumption_since() -> None:
    short = [("--set", f"vehicle.AUV01.energy_j={2e5}"), ("--set", "scenario.duration_s=7200")]
    fleet = assemble(resolved(load("mapping-rendezvous", short)), seed=1)
    head, told = fleet.vehicles[1], fleet.vehicles[2]
    workload, data = head.social.workload, told.data
    survey_w = data.hotel_w + data.drag_w_per_mps3 * data.survey_speed_mps**3
    assert workload.scarce_energy_j(100.0) == {"AUV01": pytest.approx(2e5 - 100.0 * survey_w)}
    block = told.beliefs.model.record([told.beliefs.fact("AUV01", "batteryFraction", 0.5)], 60.0).block
    head.consider(merge(head.beliefs.model, [block]).changes, 61.0)
    assert workload.scarce_energy_j(100.0) == {"AUV01": pytest.approx(1e5 - 40.0 * survey_w)}
    fleet.close()


def test_a_vehicle_reporting_dead_sensors_is_assigned_no_job_needing_them() -> None:
    """It still takes what does not, and nobody says so of another."""
    fleet = assemble(resolved(load("mapping-rendezvous", [("--set", "strategy.name='central'")])), seed=1)
    head, blind, other = fleet.vehicles[1], fleet.vehicles[2], fleet.vehicles[3]
    for says, counts in ((other, False), (blind, True)):
        block = says.beliefs.model.record([says.beliefs.fact("AUV01", "sensorsWork", False)], 1.0).block
        head.consider(merge(head.beliefs.model, [block]).changes, 1.0)
        workers = [data.name for data in head.social._work()["Operational"].workers]
        assert ("AUV01" not in workers) is counts
    order = [head.beliefs.fact("AUV01", "playsRole", "Operational.LeftWinger")]
    head.conclude(order, 2.0)
    consulted = head.social.consult()
    [ruling] = [one for one in consulted.rulings if one.asked.role == "LeftWinger"]
    assert ruling.outcome.value == "assignee takes no jobs"
    assert not head.social.takes_no_jobs
    fleet.close()
