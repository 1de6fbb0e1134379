"""How activities perceive themselves, and where they lead."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from samples import AUV, auv

from remoras.behaviours import (
    ADVANCING,
    DONE,
    DUE,
    IDLE,
    RETREATING,
    STANDING,
    Behaviour,
    Evading,
    FollowingLeader,
    Homing,
    LeadingFollowers,
    Picture,
    Planning,
    Positioning,
    Reference,
    ReturningHome,
    ReturningToArea,
    Supervision,
    ZigzagExploring,
)
from remoras.motion import Motion, advance


def at(x_m: float, y_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m)


# Exploring ----------------------------------------------------------------------------------------


def test_a_survey_runs_its_waypoints_and_is_done() -> None:
    """Transit at 2 m/s to the first one, then 1.25 m/s, which its sensor allows, although it surveys at 1.5."""
    exploring, picture = ZigzagExploring([(10.0, 0.0), (20.0, 0.0), (20.0, 5.0)], AUV), Picture()
    assert exploring.perceive(at(0.0), picture, False).stimulus > 0.99
    assert exploring.reference(at(0.0), picture) == Reference((10.0, 0.0), 2.0)
    assert exploring.perceive(at(9.0), picture, True).stimulus == 1.0  # within a metre: the first one is reached
    assert exploring.reference(at(9.0), picture) == Reference((20.0, 0.0), 1.25)
    assert exploring.perceive(at(14.0), picture, True) == ADVANCING
    assert exploring.perceive(at(14.0), picture, True) == STANDING
    exploring.perceive(at(20.0), picture, True)
    assert exploring.reference(at(20.0), picture).target_m == (20.0, 5.0)
    assert exploring.perceive(at(20.0, 5.0), picture, True) == DONE
    assert exploring.perceive(at(0.0), picture, False) == DONE


def test_turning_at_the_end_of_a_row_is_no_setback() -> None:
    exploring, picture = ZigzagExploring([(10.0, 0.0), (10.0, 25.0)], AUV), Picture()
    exploring.perceive(at(5.0), picture, True)
    assert exploring.perceive(at(4.0), picture, True) == ADVANCING


def test_what_was_not_performed_has_made_no_progress() -> None:
    exploring, picture = ZigzagExploring([(10.0, 0.0)], AUV), Picture()
    exploring.perceive(at(0.0), picture, True)
    assert exploring.perceive(at(5.0), picture, False).progress is None
    assert exploring.perceive(at(6.0), picture, True) == DUE


def test_of_areas_not_begun_the_nearest_attracts_most() -> None:
    """10 km away it attracts half as much; one that has been begun attracts wholly, from wherever."""
    near, far = (ZigzagExploring([(x_m, 0.0), (x_m, 50.0)], AUV) for x_m in (10.0, 10_000.0))
    stimuli = [exploring.perceive(at(0.0), Picture(), False).stimulus for exploring in (near, far)]
    assert stimuli[0] > stimuli[1] == 0.5
    near.perceive(at(10.0), Picture(), True)  # its first waypoint is reached
    assert near.perceive(at(5_000.0), Picture(), False).stimulus == 1.0


legs = st.tuples(st.floats(10.0, 100.0), st.floats(-math.pi, math.pi))


@given(st.lists(legs, min_size=1, max_size=6))
def test_an_agile_vehicle_reaches_every_waypoint(way: list[tuple[float, float]]) -> None:
    """At 0.5 rad/s and 2 m/s it turns within 4 m, at 1.25 m/s within 2.5 m; what lies 10 m away lies outside that
    circle. Six legs of 100 m take 600 / 1.25 = 480 s, and no turn takes longer than 2 pi / 0.5 = 13 s."""
    waypoints, point = [], (0.0, 0.0)
    for length_m, course in way:
        point = point[0] + length_m * math.cos(course), point[1] + length_m * math.sin(course)
        waypoints.append(point)
    exploring, picture, motion = ZigzagExploring(waypoints, AUV), Picture(), Motion(0.0, 0.0)
    track = []
    while len(track) < 480 + 6 * 13 and exploring.perceive(motion, picture, True) != DONE:
        reference = exploring.reference(motion, picture)
        advance(motion, AUV, reference.target_m, reference.speed_mps, 1.0)
        track.append(motion.position_m)
    assert exploring.perceive(motion, picture, True) == DONE
    assert all(min(math.dist(point, waypoint) for point in track) <= 1.0 for waypoint in waypoints)


# Rally points -------------------------------------------------------------------------------------


def test_homing_goes_waits_and_ends_when_the_group_is_together() -> None:
    homing, picture = Homing((100.0, 0.0), 20.0, "Operational", AUV), Picture()
    assert homing.perceive(at(0.0), picture, True) == DUE
    assert homing.perceive(at(2.0), picture, True) == ADVANCING
    assert homing.perceive(at(1.0), picture, True) == RETREATING
    assert homing.perceive(at(1.04), picture, True) == STANDING  # less than 5 cm in a tick
    assert homing.reference(at(79.0), picture) == Reference((100.0, 0.0), 2.0)
    assert homing.reference(at(80.0), picture) == Reference((100.0, 0.0), 0.0)
    picture.gathered.add("Coordination")
    assert homing.perceive(at(80.0), picture, True).stimulus == 1.0  # another group's meeting is not this one's
    picture.gathered.add("Operational")
    assert homing.perceive(at(80.0), picture, True) == IDLE


# Leading and following ----------------------------------------------------------------------------


def test_following_keeps_up_with_the_leader() -> None:
    following, picture = FollowingLeader(("AUV01", "AUV00"), 40.0, AUV), Picture()
    assert following.perceive(at(0.0), picture, False) == IDLE  # nobody has been heard
    assert following.reference(at(0.0), picture) is None
    picture.saw("AUV00", (100.0, 0.0))
    assert following.perceive(at(0.0), picture, True) == DUE
    assert following.reference(at(0.0), picture) == Reference((100.0, 0.0), 2.0)
    assert following.perceive(at(2.0), picture, True) == ADVANCING
    picture.saw("AUV00", (110.0, 0.0))
    assert following.perceive(at(4.0), picture, True) == STANDING  # a leader that leads on is no setback
    assert following.perceive(at(70.0), picture, True) == IDLE


def test_a_leader_waits_for_who_falls_behind() -> None:
    leading, picture = LeadingFollowers(("AUV01", "AUV02"), "Operational", 80.0), Picture()
    picture.saw("AUV01", (0.0, 100.0))
    assert leading.perceive(at(0.0), picture, False) == IDLE  # they are not moving together yet
    picture.gathered.add("Operational")
    assert leading.perceive(at(0.0), picture, False) == DUE
    assert leading.reference(at(3.0, 4.0), picture) == Reference((3.0, 4.0), 0.0)
    assert leading.perceive(at(0.0, 20.0), picture, False) == IDLE


@pytest.mark.parametrize(
    ("offset", "place"),
    [((0.0, 15.0), (85.0, 0.0)), ((0.0, -15.0), (115.0, 0.0)), ((-15.0, 0.0), (100.0, -15.0))],
)
def test_places_in_the_formation_turn_with_the_leader(offset: tuple[float, float], place: tuple[float, float]) -> None:
    """The leader goes north: to its left is west."""
    positioning, picture = Positioning(("AUV00",), "Operational", offset, AUV), Picture()
    picture.gathered.add("Operational")
    picture.saw("AUV00", (100.0, -10.0))
    assert positioning.perceive(at(0.0), picture, False) == IDLE  # its course is not known yet
    picture.saw("AUV00", (100.0, 0.0))
    assert positioning.perceive(at(0.0), picture, False) == DUE
    reference = positioning.reference(at(0.0), picture)
    assert reference is not None
    assert reference.target_m == pytest.approx(place)
    in_place = positioning.reference(at(*place), picture)
    assert in_place is not None
    assert in_place.speed_mps == 0.0


def test_a_formation_is_taken_when_the_group_is_together() -> None:
    positioning, picture = Positioning(("AUV00",), "Operational", (0.0, 15.0), AUV), Picture()
    picture.saw("AUV00", (0.0, 0.0))
    picture.saw("AUV00", (10.0, 0.0))
    assert positioning.perceive(at(0.0), picture, False) == IDLE
    assert positioning.reference(at(0.0), picture) is None


def test_a_heading_comes_from_two_different_positions() -> None:
    picture = Picture()
    picture.saw("AUV00", (0.0, 0.0))
    picture.saw("AUV00", (0.0, 0.0))
    assert picture.headings == {}
    picture.saw("AUV00", (-5.0, 0.0))
    assert picture.headings == {"AUV00": math.pi}
    picture.saw("AUV00", (-5.0, 0.0))
    assert picture.headings == {"AUV00": math.pi}


# Supervising --------------------------------------------------------------------------------------


def test_planning_is_due_while_there_is_something_to_plan() -> None:
    planning, picture = Planning(), Picture()
    assert planning.perceive(at(0.0), picture, False) == IDLE
    picture.planning_due = True
    assert planning.perceive(at(0.0), picture, False) == DUE


def test_a_supervisor_is_content_while_news_come() -> None:
    supervision, picture = Supervision(60.0), Picture()
    assert supervision.perceive(at(0.0), picture, True) == DUE  # nothing has been heard yet
    picture.now_s, picture.last_news_s = 160.0, 100.0
    assert supervision.perceive(at(0.0), picture, True) == ADVANCING
    picture.now_s = 160.1
    assert supervision.perceive(at(0.0), picture, True) == DUE


# Vital needs --------------------------------------------------------------------------------------


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 1.0))
def test_two_on_collision_course_part(bearing: float, urgency: float) -> None:
    """Each sees the other on the opposite bearing; both turn to their left of it, so they go opposite ways."""
    references = []
    for seen in (bearing, bearing + math.pi):
        picture = Picture(collision=(seen, urgency))
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
    home, picture = ReturningHome(auv(start_m=(10.0, 0.0))), Picture(battery=0.3, reserve=0.2)
    assert home.perceive(at(0.0), picture, False) == IDLE
    picture.battery = 0.2
    assert home.perceive(at(0.0), picture, False) == DUE
    assert home.reference(at(0.0), picture) == Reference((10.0, 0.0), 1.5)
    picture.reserve = 0.0  # at home there is no way left to keep energy for, and yet
    assert home.perceive(at(10.0), picture, True) == DUE
    assert home.reference(at(10.0), picture) == Reference((10.0, 0.0), 0.0)


def test_a_vehicle_outside_the_area_comes_back() -> None:
    back, picture = ReturningToArea((350.0, 350.0), AUV), Picture()
    assert back.perceive(at(0.0), picture, False) == IDLE
    picture.outside_m = 0.1
    assert back.perceive(at(0.0), picture, False) == DUE
    assert back.reference(at(0.0), picture) == Reference((350.0, 350.0), 2.0)


@pytest.mark.parametrize(
    "behaviour",
    [
        ZigzagExploring([(10.0, 0.0)], AUV),
        Homing((10.0, 0.0), 1.0, "Operational", AUV),
        FollowingLeader(("AUV01",), 40.0, AUV),
        LeadingFollowers(("AUV01",), "Operational", 40.0),
        Positioning(("AUV01",), "Operational", (0.0, 15.0), AUV),
        Evading(AUV),
        ReturningHome(AUV),
        ReturningToArea((0.0, 0.0), AUV),
        Planning(),
        Supervision(60.0),
    ],
    ids=lambda behaviour: type(behaviour).__name__,
)
def test_every_behaviour_copes_with_knowing_nothing(behaviour: Behaviour) -> None:
    """Before anything has been heard each one answers, and a guide to nowhere is None."""
    perceived = behaviour.perceive(at(0.0), Picture(), False)
    assert 0.0 <= perceived.stimulus <= 1.0
    reference = behaviour.reference(at(0.0), Picture())
    assert reference is None or reference.speed_mps >= 0.0
