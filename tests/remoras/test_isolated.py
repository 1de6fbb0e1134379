"""What a vehicle that is cut off has changed for itself: undone when it comes back, but its orders are told then."""

from resting import named, setup_of

from remoras.fleet.fleet import Fleet
from remoras.fleet.vehicle import Vehicle
from remoras.social.layer import Considered

FRAME_S = setup_of("mapping-rendezvous").schedule.frame_s
EXPLORE_LEFT = ("Operational.LeftWinger", "objectiveExploring", "left")
MAP_ALL = ("Operational", "hasMission", "AreaMapping")


def cut_off(vehicle: Vehicle) -> int:
    """The TDMA frame by which a vehicle that hears nobody is cut off."""
    for frame in range(1, 100):
        vehicle.social.look_around(frame * FRAME_S)
        if vehicle.social.is_cut_off:
            return frame
    raise AssertionError("it is never cut off")


def say_alone(vehicle: Vehicle, frame: int, *facts: tuple[str, str, str]) -> None:
    for fact in facts:
        change = vehicle.beliefs.model.record([vehicle.beliefs.fact(*fact)], frame * FRAME_S)
        vehicle.social.consider([change], told=False)
    vehicle.social.consult()


def hear_again(vehicle: Vehicle, frame: int, *names: str) -> Considered | None:
    at_s = frame * FRAME_S
    vehicle.social._picture.peers.heard_s.update(dict.fromkeys(names, at_s))
    return vehicle.social.look_around(at_s)


def test_a_head_that_was_cut_off_tells_what_it_gave_alone_and_once(fleet: Fleet) -> None:
    head = named(fleet, "AUV00")
    frame = cut_off(head)
    say_alone(head, frame, MAP_ALL, EXPLORE_LEFT, ("AUV01", "playsRole", "Operational.LeftWinger"))
    came_back = hear_again(head, frame + 1, "AUV01")
    assert came_back.passed_on == [head.beliefs.fact(*MAP_ALL), head.beliefs.fact(*EXPLORE_LEFT)]
    once_more = hear_again(head, frame + 2, "AUV02")
    assert once_more.passed_on == []
