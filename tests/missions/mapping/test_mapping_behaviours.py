"""How a vehicle explores an area: row by row, and how it perceives itself in doing so."""

import math

from hypothesis import given
from hypothesis import strategies as st
from sample_vehicles import AUV

from missions.mapping.behaviours import ZigzagExploring
from remoras.behaviours import ADVANCING, DONE, DUE, STANDING, Reference
from remoras.motion import Motion, advance
from remoras.picture import Picture


def at(x_m: float, y_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m)


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
    assert exploring.perceive(at(5.0), picture, False).advance is None
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
