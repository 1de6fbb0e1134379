"""Vital behaviours: return on the energy reserve and into the area of operations, beyond any mission."""

from samples import AUV, auv

from remoras.behaviours import Reference
from remoras.functional.vital import ReturningHome, ReturningToArea
from remoras.motion import Motion
from remoras.picture import Body, Picture


def at(x_m: float, y_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m)


# Vital needs --------------------------------------------------------------------------------------


def test_a_vehicle_goes_home_on_its_reserve_and_stays_there() -> None:
    home, picture = ReturningHome(auv(start_m=(10.0, 0.0))), Picture(Body(battery=0.3, reserve=0.2))
    assert home.perceive(at(0.0), picture, False).stimulus == 0.0
    picture.body.battery = 0.2
    assert home.perceive(at(0.0), picture, False).stimulus == 1.0
    assert home.reference(at(0.0), picture) == Reference((10.0, 0.0), 1.5, 1.0)
    picture.body.reserve = 0.0  # at home there is no way left to keep energy for, and yet
    assert home.perceive(at(10.0), picture, True).stimulus == 1.0
    assert home.reference(at(10.0), picture) == Reference((10.0, 0.0), 0.0, 0.0)


def test_a_vehicle_outside_the_area_comes_back() -> None:
    back, picture = ReturningToArea((0.0, 0.0, 700.0, 700.0), AUV), Picture()
    assert back.perceive(at(0.0), picture, False).stimulus == 0.0
    picture.body.outside_m = 0.1
    assert back.perceive(at(0.0), picture, False).stimulus == 1.0
    assert back.reference(at(0.0), picture) == Reference((350.0, 350.0), 2.0)
