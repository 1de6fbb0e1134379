"""Stimuli, progress and references of behaviours."""

import math

import pytest
from sample_vehicles import AUV

from remoras.behaviours import (
    ADVANCING,
    DUE,
    IDLE,
    STANDING,
    Behaviour,
    FollowingLeader,
    Homing,
    LeadingFollowers,
    Perception,
    Positioning,
    Reference,
    Supervision,
    Working,
)
from remoras.fleet.radio import note_position
from remoras.motion import Motion
from remoras.picture import Body, Picture


def at(x_m: float, y_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m)


def seen(behaviour: Behaviour, motion: Motion, picture: Picture, performed: bool) -> Perception:
    """A perception with its advance now, and without how long it is valid."""
    found = behaviour.perceive(motion, picture, performed)
    return found._replace(advance=found.progress(motion, picture), answers=1.0, until_s=-math.inf, peers=())


# Rally points -------------------------------------------------------------------------------------


def test_homing_goes_waits_and_ends_when_the_group_is_together() -> None:
    homing, picture = Homing((100.0, 0.0), 20.0, "Operational", AUV), Picture()
    perceived = []
    for now_s, x_m in ((0.0, 0.0), (1.0, 2.0), (2.0, 1.0), (3.0, 1.04)):  # the last is less than 5 cm
        picture.body.now_s = now_s
        perceived.append(seen(homing, at(x_m), picture, True))
    assert perceived == [DUE, ADVANCING, Perception(1.0, -0.5), STANDING]  # its transit speed is 2 m/s
    assert homing.reference(at(79.0), picture) == Reference((100.0, 0.0), 2.0, 20.0)
    assert homing.reference(at(80.0), picture) == Reference((100.0, 0.0), 0.0, 0.0)
    picture.groups.gathered |= {"Coordination"}
    assert seen(homing, at(80.0), picture, True).stimulus == 1.0  # another group's meeting is not this one's
    picture.groups.gathered |= {"Operational"}
    assert seen(homing, at(80.0), picture, True) == IDLE


# Leading and following ----------------------------------------------------------------------------


def test_following_keeps_up_with_the_leader() -> None:
    following, picture = FollowingLeader(("AUV01", "AUV00"), "Operational", 40.0, AUV), Picture()
    assert seen(following, at(0.0), picture, False) == IDLE  # nobody has been heard
    assert following.reference(at(0.0), picture) is None
    note_position(picture.peers, "AUV00", (100.0, 0.0))
    assert seen(following, at(0.0), picture, True) == DUE
    assert following.reference(at(0.0), picture) == Reference((100.0, 0.0), 2.0)
    picture.body.now_s = 1.0
    assert seen(following, at(2.0), picture, True) == ADVANCING
    note_position(picture.peers, "AUV00", (110.0, 0.0))
    picture.body.now_s = 2.0
    assert seen(following, at(4.0), picture, True) == STANDING  # a leader that leads on is no setback
    assert seen(following, at(92.0), picture, True).stimulus == 1.0  # near to where the leader was
    assert following.reference(at(92.0), picture) == Reference((110.0, 0.0), 0.0)
    note_position(picture.peers, "AUV00", (114.0, 0.0))
    assert seen(following, at(92.0), picture, True).stimulus == 1.0  # less than 40 m, but not half of that
    note_position(picture.peers, "AUV00", (110.0, 0.0))
    assert seen(following, at(92.0), picture, True) == IDLE  # now it knows that it has caught up
    assert seen(following, at(60.0), picture, False) == IDLE  # and not yet that it has fallen behind again
    note_position(picture.peers, "AUV00", (110.0, 0.0))
    assert seen(following, at(60.0), picture, False) == DUE
    picture.groups.awaited = {"Operational": 0.25, "Coordination": 0.75}
    assert following.perceive(at(60.0), picture, False).settled == 0.25  # the share of its wait due to this vehicle


def test_a_leader_waits_for_stragglers() -> None:
    leading, picture = LeadingFollowers(("AUV01", "AUV02"), "Operational", 80.0, AUV), Picture(frame_s=0.0)
    note_position(picture.peers, "AUV01", (0.0, 100.0))
    assert seen(leading, at(0.0), picture, False) == IDLE  # they are not moving together yet
    picture.groups.gathered |= {"Operational"}
    assert seen(leading, at(0.0), picture, False) == IDLE  # it has never come
    note_position(picture.peers, "AUV01", (0.0, 100.0))
    assert seen(leading, at(0.0, 40.0), picture, False) == IDLE  # now it has
    assert seen(leading, at(0.0), picture, False) == IDLE  # the leader has gone on, and the other one may have, too
    note_position(picture.peers, "AUV01", (0.0, 100.0))
    assert seen(leading, at(0.0), picture, False) == DUE
    assert leading.reference(at(3.0, 4.0), picture) == Reference((3.0, 4.0), 0.0)
    note_position(picture.peers, "AUV01", (0.0, 70.0))
    assert seen(leading, at(0.0), picture, False) == DUE  # a quarter of 80 m is not made up for yet
    note_position(picture.peers, "AUV01", (0.0, 60.0))
    assert seen(leading, at(0.0), picture, False) == IDLE


@pytest.mark.parametrize(
    ("offset", "place"), [((0.0, 15.0), (85.0, 0.0)), ((0.0, -15.0), (115.0, 0.0)), ((-15.0, 0.0), (100.0, -15.0))]
)
def test_places_in_the_formation_turn_with_the_leader(offset: tuple[float, float], place: tuple[float, float]) -> None:
    """The leader goes north: to its left is west."""
    positioning, picture = Positioning(("AUV00",), "Operational", offset, AUV), Picture()
    picture.groups.gathered |= {"Operational"}
    note_position(picture.peers, "AUV00", (100.0, -10.0))
    assert seen(positioning, at(0.0), picture, False) == IDLE  # its course is not known yet
    note_position(picture.peers, "AUV00", (100.0, 0.0))
    assert seen(positioning, at(0.0), picture, False) == DUE
    reference = positioning.reference(at(0.0), picture)
    assert reference.target_m == pytest.approx(place)
    in_place = positioning.reference(at(*place), picture)
    assert in_place.speed_mps == 0.0


# Supervising --------------------------------------------------------------------------------------


def test_a_supervisor_is_satisfied_while_updates_arrive() -> None:
    supervision, picture = Supervision(60.0), Picture()
    assert seen(supervision, at(0.0), picture, True) == DUE  # nothing has been heard yet
    picture.body.now_s, picture.peers.last_news_s = 160.0, 100.0
    assert seen(supervision, at(0.0), picture, True) == ADVANCING
    picture.body.now_s = 175.0  # 15 of 60 s late: three quarters
    assert seen(supervision, at(0.0), picture, False) == Perception(1.0, 0.75)
    picture.body.now_s = 300.0
    assert seen(supervision, at(0.0), picture, True) == STANDING


def test_only_the_sensor_of_the_work_shows_its_progress() -> None:
    """At 100 s the sonar last yielded at 10 s, beyond the patience of 60 s, a thermometer at 95 s."""
    body = Body(now_s=100.0, yields_s={"sonar": 10.0, "thermometer": 95.0})
    seen = {name: Working(60.0, name).perceive(at(0.0), Picture(body), True) for name in ("sonar", "", "lamp")}
    assert body.last_yield_s == 95.0
    assert (seen["sonar"], seen["lamp"]) == (STANDING, DUE)
    assert seen[""] == Perception(1.0, 1.0, until_s=155.0)
