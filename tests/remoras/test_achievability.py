"""Achievable share of the goal with the remaining vehicles: jobs, predecessors, roles and working parts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_vehicles import AUV

from missions.mapping.sensors import SwathSettings
from remoras.activities import Objective
from remoras.condition import Condition
from remoras.database import VehicleData
from remoras.faults import Fault, condition_under
from remoras.organisation import Group, RoleSpecification
from remoras.truth import VehicleView, reachable_by_jobs, within_reach

DEAD = Condition(dead_sensors=frozenset({"mapping"}))
SENSING = replace(AUV, sensors=(SwathSettings(name="mapping", swath_m=25.0, speed_limit_mps=1.25),))
BLIND = replace(AUV, sensors=())


@dataclass(frozen=True)
class Look:
    """A job that takes a sensor."""

    name: str
    needs: tuple[str, ...] = ()

    def is_able(self, data: VehicleData) -> bool:
        return bool(data.sensors)


def vehicle(data: VehicleData | None, *roles: str, finished: tuple[str, ...] = ()) -> Any:
    done = tuple(Objective("Team", "Hand", "Looking", job) for job in finished)
    return SimpleNamespace(able_data=data, can_play=lambda group, role: role in roles, finished=done)


def fleet(*vehicles: Any) -> Any:
    return SimpleNamespace(vehicles=vehicles)


JOBS: dict[str, Any] = {one.name: one for one in (Look("a"), Look("b"), Look("c", ("b",)), Look("d", ("c",)))}
TEAM = Group("Team", tuple(RoleSpecification(f"R{name}", 0, 1, job=name) for name in JOBS), None, "Looking")


def test_a_job_needs_role_sensor_and_achievable_predecessors() -> None:
    """Somebody may play the roles of a, c and d: b, and with it c and d, is out of reach, until b is done."""
    one = vehicle(SENSING, "Ra", "Rc", "Rd")
    assert within_reach(JOBS, [TEAM], fleet(one), ()) == {"a"}
    assert within_reach(JOBS, [TEAM], fleet(one), ("b",)) == set(JOBS)
    assert within_reach(JOBS, [TEAM], fleet(vehicle(BLIND, "Ra", "Rb")), ("b",)) == {"b"}
    assert within_reach(JOBS, [TEAM], fleet(vehicle(None, "Ra", "Rb")), ()) == set()
    assert within_reach(JOBS, [], fleet(vehicle(SENSING)), ()) == set(JOBS)


@given(
    st.floats(0.0, 1.0),
    st.sets(st.sampled_from(sorted(JOBS))),
    st.lists(st.sets(st.sampled_from([f"R{name}" for name in JOBS])), min_size=1, max_size=4),
)
def test_achievable_share_shrinks_with_the_fleet_down_to_the_achieved_share(reached, done, crews) -> None:
    vehicles = [vehicle(SENSING, *roles) for roles in crews]
    shares = [reachable_by_jobs(reached, JOBS, [TEAM], fleet(*vehicles[:n]), done) for n in range(len(vehicles) + 1)]
    assert shares == sorted(shares)
    assert all(reached <= share <= 1.0 for share in shares)


@pytest.mark.parametrize(
    ("condition", "is_exhausted", "has_resigned", "sensors"),
    [
        ((), False, False, 1),
        ((Fault("lost", "A", 0.0, 50.0, Condition(is_running=False)),), False, False, 1),
        ((Fault("lost", "A", 0.0, leaves=Condition(is_running=False)),), False, False, None),
        ((Fault("sensor", "A", 0.0, 50.0, DEAD),), False, False, 1),
        ((Fault("sensor", "A", 0.0, leaves=DEAD),), False, False, 0),
        ((Fault("mute", "A", 0.0, leaves=Condition(is_mute=True)),), False, False, 1),
        ((), True, False, None),
        ((), False, True, None),
    ],
)
def test_faults_and_exhaustion_limit_abilities(condition, is_exhausted, has_resigned, sensors) -> None:
    body: Any = SimpleNamespace(
        name="A", social=None, has_resigned=has_resigned, condition=condition_under(condition),
        functional=SimpleNamespace(exhausted=is_exhausted, data=SENSING, headway=SimpleNamespace(is_lost=False)),
    )  # fmt: skip
    data = VehicleView(body).able_data
    assert (None if data is None else len(data.sensors)) == sensors
    body.functional.headway.is_lost = True
    assert VehicleView(body).able_data is None
