"""What a vehicle needs to live: whom it evades, when it goes home, and that no mission can change it."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from samples import AUV, activity_set, auv

from remoras.activities import ActivityKind, ActivityType
from remoras.behaviours import DUE, IDLE, Perception, Reference
from remoras.executive.layer import ExecutiveLayer
from remoras.executive.satisfaction import DecisionConstants
from remoras.functional.vital import (
    VITAL_NAMES,
    VITAL_SETS,
    Evading,
    Neighbour,
    ReturningHome,
    ReturningToArea,
    time_to_collision_s,
)
from remoras.motion import Motion
from remoras.picture import Body, Picture


def at(x_m: float, y_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m)


# Collisions ---------------------------------------------------------------------------------------


def time_of(neighbour: Neighbour, own: tuple[float, float] = (0.0, 0.0)) -> float | None:
    return time_to_collision_s(neighbour, *own, safety_m=5.0, horizon_s=30.0)


def test_head_on() -> None:
    """40 m apart, closing at 1 + 1 m/s: in 20 s."""
    assert time_of(Neighbour(40.0, 0.0, -1.0, 0.0), (1.0, 0.0)) == 20.0


def test_no_concern() -> None:
    assert time_of(Neighbour(40.0, 0.0, 1.0, 0.0), (1.0, 0.0)) is None  # side by side at one speed
    assert time_of(Neighbour(40.0, 0.0, 1.0, 0.0)) is None  # going away
    assert time_of(Neighbour(40.0, 5.0, -2.0, 0.0)) is None  # passes at 5 m
    assert time_of(Neighbour(62.0, 0.0, -2.0, 0.0)) is None  # in 31 s
    assert time_of(Neighbour(60.0, 4.9, -2.0, 0.0)) == 30.0


offsets = st.floats(-60.0, 60.0)
velocities = st.floats(-3.0, 3.0)


courses, times = st.floats(-math.pi, math.pi), st.floats(0.1, 29.9)


@given(velocities, velocities, st.floats(0.1, 3.0), courses, times, st.floats(-7.0, 7.0))
def test_the_time_is_that_of_the_closest_approach(
    vx: float, vy: float, closing_mps: float, course: float, time_s: float, miss_m: float
) -> None:
    """Set up backwards: at ``time_s`` the neighbour passes at ``miss_m``, square to the course it is seen on."""
    along, across = (math.cos(course), math.sin(course)), (-math.sin(course), math.cos(course))
    neighbour = Neighbour(
        miss_m * across[0] - closing_mps * along[0] * time_s,
        miss_m * across[1] - closing_mps * along[1] * time_s,
        vx + closing_mps * along[0],
        vy + closing_mps * along[1],
    )
    assume(abs(abs(miss_m) - 5.0) > 1e-6)
    found = time_of(neighbour, (vx, vy))
    assert found == (pytest.approx(time_s) if abs(miss_m) < 5.0 else None)


@given(st.builds(Neighbour, offsets, offsets, velocities, velocities), velocities, velocities)
def test_both_see_the_same_collision(neighbour: Neighbour, vx: float, vy: float) -> None:
    mirrored = Neighbour(-neighbour.dx_m, -neighbour.dy_m, vx, vy)
    assert time_of(neighbour, (vx, vy)) == time_of(mirrored, (neighbour.vx_mps, neighbour.vy_mps))


# Vital needs --------------------------------------------------------------------------------------


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 1.0))
def test_two_on_collision_course_part(bearing: float, urgency: float) -> None:
    """Each sees the other on the opposite bearing; both turn to their left of it, so they go opposite ways."""
    references = []
    for seen in (bearing, bearing + math.pi):
        picture = Picture(Body(collision=(seen, urgency)))
        evading = Evading(AUV)
        assert evading.perceive(at(0.0), picture, False).stimulus == urgency
        references.append(evading.reference(at(0.0), picture))
    (one_x, one_y), (other_x, other_y) = (reference.target_m for reference in references if reference)
    assert (one_x, one_y) == pytest.approx((-other_x, -other_y), abs=1e-9)
    assert one_x * math.cos(bearing) + one_y * math.sin(bearing) == pytest.approx(0.0, abs=1e-9)


def test_without_a_collision_there_is_nothing_to_evade() -> None:
    assert Evading(AUV).perceive(at(0.0), Picture(), True) == IDLE
    assert Evading(AUV).reference(at(0.0), Picture()) is None


def test_a_vehicle_goes_home_on_its_reserve_and_stays_there() -> None:
    home, picture = ReturningHome(auv(start_m=(10.0, 0.0))), Picture(Body(battery=0.3, reserve=0.2))
    assert home.perceive(at(0.0), picture, False) == IDLE
    picture.body.battery = 0.2
    assert home.perceive(at(0.0), picture, False) == DUE
    assert home.reference(at(0.0), picture) == Reference((10.0, 0.0), 1.5)
    picture.body.reserve = 0.0  # at home there is no way left to keep energy for, and yet
    assert home.perceive(at(10.0), picture, True) == DUE
    assert home.reference(at(10.0), picture) == Reference((10.0, 0.0), 0.0)


def test_a_vehicle_outside_the_area_comes_back() -> None:
    back, picture = ReturningToArea((350.0, 350.0), AUV), Picture()
    assert back.perceive(at(0.0), picture, False) == IDLE
    picture.body.outside_m = 0.1
    assert back.perceive(at(0.0), picture, False) == DUE
    assert back.reference(at(0.0), picture) == Reference((350.0, 350.0), 2.0)


def test_what_is_vital_comes_before_anything_of_a_mission() -> None:
    """The faintest stimulus is enough against what is performed in perfect satisfaction, and called for."""
    working = activity_set(("Homing", ActivityType.GUIDANCE), importance=1.0, role="Performer")
    executive = ExecutiveLayer(DecisionConstants(weight_continuing=1e6, weight_external=1e6))
    executive.adopt([*VITAL_SETS, working], [("Operational", "Performer")])
    executive.satisfaction["Operational", "Performer"] = 127.0
    executive.hear(("Operational", "Performer"), "AUV01", "Performer", -128, 0.0)
    quiet = [IDLE] * len(VITAL_SETS)
    executive.decide([*quiet, DUE], 0.0, 0.0)
    assert executive.decision.chosen == (len(VITAL_SETS),)
    for index, one in enumerate(VITAL_SETS):
        if one.kind is ActivityKind.VITAL:
            executive.decide([*quiet[:index], Perception(1e-6), *quiet[index + 1 :], DUE], 0.0, 0.0)
            assert executive.decision.chosen == (index,)
            assert executive.motivations[-1] > 1e6 > executive.motivations[index]


def test_every_vital_need_guides() -> None:
    """Each leaves no room for another guide; their names are reserved."""
    sending, *needs = VITAL_SETS
    assert sending.types == 1 << ActivityType.COMMUNICATION
    assert {1 << ActivityType.GUIDANCE} == {one.types for one in needs}
    assert {"SendingInfluenceSignals", "Evading", "ReturningHome", "ReturningToArea"} == VITAL_NAMES
