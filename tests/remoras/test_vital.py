"""What a vehicle needs to live: when it goes home and back, and that no mission can change it."""

from samples import AUV, activity_set, auv

from remoras.activities import ActivityKind, ActivityType
from remoras.behaviours import DUE, IDLE, Perception, Reference
from remoras.executive.layer import ExecutiveLayer
from remoras.executive.satisfaction import DecisionConstants
from remoras.functional.vital import (
    VITAL_NAMES,
    VITAL_SETS,
    ReturningHome,
    ReturningToArea,
)
from remoras.motion import Motion
from remoras.picture import Body, Picture


def at(x_m: float, y_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m)


# Vital needs --------------------------------------------------------------------------------------


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
    assert {"SendingInfluenceSignals", "ReturningHome", "ReturningToArea"} == VITAL_NAMES
