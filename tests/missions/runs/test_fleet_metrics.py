"""Metrics of a fleet at work, from tables that are written by hand, and from short runs."""

from types import SimpleNamespace
from typing import Any

import pytest

from missions.metric import NOT_APPLICABLE
from missions.runs.fleet_metrics import (
    closest_approach_m,
    conflicts,
    idle_s,
    job_roles,
    recovery_time_s,
    vehicles_for_jobs,
)
from missions.runs.run import Run
from missions.runs.run import run as run_scenario
from missions.runs.summary import summary
from missions.scenarios import load
from remoras.contents import Content
from remoras.holders import HolderCount
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification
from remoras.recorder import Recorder

SCENARIO = load("mapping-rendezvous")
G = "Operational"


def finished(completed: bool = True, end_s: float = 1000.0, **rows: list[tuple[Any, ...]]) -> Run:
    """A run of the shipped scenario with these rows."""
    recorder = Recorder()
    for name, own in rows.items():
        recorder.rows(name).extend(own)
    made: Any = SimpleNamespace(recorder=recorder, scenario=SCENARIO, completed=completed, end_s=end_s)
    return made  # type: ignore[no-any-return]


def test_work_is_the_roles_with_a_job_and_those_who_may_play_them() -> None:
    assert {role for _, role in job_roles(SCENARIO)} == {"LeftWinger", "Midfield", "RightWinger"}
    assert vehicles_for_jobs(SCENARIO) == ("AUV00", "AUV01", "AUV02")  # the surface vehicle leads


def test_idle_is_the_time_in_which_no_role_with_a_job_is_served() -> None:
    """AUV00 works 100..400 and 600..end: idle 300 s. AUV01 has two roles, 0..500: 500 s. AUV02 never: 1000 s."""
    roles = [
        (0.0, "AUV01", G, "LeftWinger", "active"), (50.0, "AUV01", G, "Midfield", "active"),
        (90.0, "AUV00", G, "Coordinator", "active"), (100.0, "AUV00", G, "Midfield", "active"),
        (300.0, "AUV01", G, "LeftWinger", "inactive"), (400.0, "AUV00", G, "Midfield", "inactive"),
        (500.0, "AUV01", G, "Midfield", "inactive"), (600.0, "AUV00", G, "Midfield", "active"),
    ]  # fmt: skip
    assert idle_s(finished(roles=roles)) == pytest.approx((300 + 500 + 1000) / 3)
    lost = [(200.0, "AUV02", "lost", ""), (700.0, "AUV01", "mute", "")]
    assert idle_s(finished(roles=roles, faults=lost)) == pytest.approx((300 + 500 + 200) / 3, abs=1e-4)


def test_who_joins_late_is_neither_idle_nor_close_before() -> None:
    """AUV02 joins at 400 s, so of 1000 s it is idle for 600 s; it stands on AUV01 until then and 50 m off after."""
    joins = [(0.0, "AUV02", "joins", "away until 400 s"), (400.0, "AUV02", "joins", "over")]
    assert idle_s(finished(faults=joins)) == pytest.approx((1000 + 1000 + 600) / 3, abs=1e-4)
    places_m = {"AUV00": 900.0, "AUV01": 0.0, "AUV02": 0.0, "ASV00": 0.0}
    names = [vehicle.name for vehicle in SCENARIO.vehicle]
    depth_m = {vehicle.name: vehicle.depth_m for vehicle in SCENARIO.vehicle}
    rows = [(60.0, name, places_m[name], 0.0, 0.0, 0.0, 0.0, depth_m[name]) for name in names]
    places_m["AUV02"] = 50.0
    rows += [(400.0, name, places_m[name], 0.0, 0.0, 0.0, 0.0, depth_m[name]) for name in names]
    assert closest_approach_m(finished(faults=joins, trajectories=rows)) == 50.0
    assert closest_approach_m(finished(trajectories=rows)) == 0.0


def test_only_vehicles_in_one_layer_come_close() -> None:
    """AUV00 and AUV01 are 2.5 m apart (1.5, 2) at 60 s, ASV00 nearer, but at the surface; at first all are far off."""
    names = [vehicle.name for vehicle in SCENARIO.vehicle]
    depth_m = {vehicle.name: vehicle.depth_m for vehicle in SCENARIO.vehicle}
    at_60_m = {"AUV00": (0.0, 0.0), "AUV01": (1.5, 2.0), "AUV02": (900.0, 0.0), "ASV00": (0.0, 1.0)}
    rows = [(0.0, name, 40.0 * number, 0.0, 0.0, 0.0, 0.0, depth_m[name]) for number, name in enumerate(names)]
    rows += [(60.0, name, *at_60_m[name], 0.0, 0.0, 0.0, depth_m[name]) for name in names]
    assert abs(depth_m["AUV00"] - depth_m["AUV01"]) <= 3.0 < abs(depth_m["AUV00"] - depth_m["ASV00"])
    both, first = finished(trajectories=rows), finished(trajectories=rows[: len(names)])
    assert (closest_approach_m(both), conflicts(both)) == (2.5, 1)
    assert (closest_approach_m(first), conflicts(first)) == (40.0, 0)
    assert closest_approach_m(finished(trajectories=[])) is None


HELD = [(0.0, "AUV01", G, "LeftWinger", "assigned"), (0.0, "AUV02", G, "RightWinger", "assigned")]
LOST = [(300.0, "AUV01", "lost", "")]


@pytest.mark.parametrize(
    ("faults", "roles", "completed", "expected"),
    [
        ([], HELD, True, NOT_APPLICABLE),
        ([(300.0, "AUV01", "slow", "")], HELD, True, NOT_APPLICABLE),
        (LOST, [*HELD, (340.0, "AUV02", G, "LeftWinger", "assigned")], True, 40.0),
        (LOST, [*HELD, (340.0, "AUV01", G, "LeftWinger", "assigned")], False, None),  # by itself: nobody took over
        (LOST, HELD, False, None),
        (LOST, HELD, True, NOT_APPLICABLE),  # it had done its work
        (LOST, [*HELD, (200.0, "AUV01", G, "LeftWinger", "left")], False, NOT_APPLICABLE),
        ([(9.0, "AUV02", "refused assignment", ""), *LOST], [*HELD, (340.0, "AUV00", G, "LeftWinger", "assigned")],
         True, 40.0),
    ],
)  # fmt: skip
def test_recovery_lasts_until_others_hold_the_work(
    faults: list[tuple[Any, ...]], roles: list[tuple[Any, ...]], completed: bool, expected: object
) -> None:
    assert recovery_time_s(finished(completed, faults=faults, roles=roles)) == expected


def test_a_wrong_belief_names_somebody_who_does_not_hold_the_job() -> None:
    """A and B hold jobs. A names B rightly; B names C for A's job, wrongly; C names nobody, which is not wrong."""
    group = Group(
        "g", (RoleSpecification("one", job="j1"), RoleSpecification("two", job="j2"), RoleSpecification("no"))
    )

    def sees(*held: tuple[str, str]) -> Organisation:
        return Organisation.of([group], [RoleAssignment("g", role, vehicle) for vehicle, role in held])

    count = HolderCount()
    assert count.wrong_fraction is None
    a = sees(("A", "one"), ("B", "two"), ("C", "no"))
    count.compare([("A", a), ("B", sees(("C", "one"), ("B", "two"))), ("C", sees(("A", "no")))])
    assert (count.n_believed, count.n_wrong) == (2, 1)  # own jobs and roles without a job are not asked about
    assert count.wrong_fraction == 0.5


@pytest.mark.parametrize("strategy", ["remoras", "contract-net", "cbba", "fixed-partition"])
def test_bits_by_content_add_up_to_all_bits(strategy: str) -> None:
    overrides = [("--set", "scenario.duration_s=300"), ("--set", "channel.per=0.3")]
    made = run_scenario(load("mapping-patches", [*overrides, ("--strategy", f"strategy.name={strategy}")]), 2)
    found = summary(made)
    bits = {one: found[f"bits_{one.value}"] for one in Content}
    assert sum(bits.values()) == 8 * found["n_bytes"]
    assert (bits[Content.SIGNALS] > 0) == (strategy == "remoras")
    assert (bits[Content.CLAIMS] > 0) == (strategy in ("contract-net", "cbba"))
    assert (bits[Content.STATUS] > 0) == (strategy != "fixed-partition")


def test_a_metric_that_does_not_apply_has_no_field() -> None:
    found = summary(run_scenario(load("mapping-rendezvous", [("--set", "scenario.duration_s=30")]), 1))
    assert "recovery_time_s" not in found
    assert found["time_to_95_s"] is None
