"""Places in the formation: how far from the leader they are, and what comes of places that are too near."""

import pytest
from surveying import mapper

from missions.mapping.behaviours import positioning, room_of
from missions.runs.run import run
from missions.scenarios import load
from remoras.motion import Motion
from remoras.picture import Picture
from remoras.radio import note_position

GROUP = "Operational"


def place_m(turn_rate_radps: float, separation_m: float) -> tuple[float, float]:
    """Where a left winger goes whose leader is at the origin, with its head to the east, and turns so fast."""
    leader, own = mapper("AUV00", turn_rate_radps=turn_rate_radps), mapper("AUV01")
    room_m = room_of((leader, own), separation_m)
    behaviour = positioning(("top", "left"), ("AUV00",), GROUP, own, 15.0, room_m)
    picture = Picture()
    picture.groups.gathered.add(GROUP)
    note_position(picture.peers, "AUV00", (-10.0, 0.0))
    note_position(picture.peers, "AUV00", (0.0, 0.0))
    reference = behaviour.reference(Motion(500.0, 0.0), picture)
    assert reference is not None
    return reference.target_m


def test_a_place_is_as_far_from_the_leader_as_the_mission_says_where_that_leaves_it_room() -> None:
    """At 2 m/s and 0.5 rad/s the leader turns on a circle of 4 m: it keeps 1.1 * 5 + 4 = 9.5 m from others."""
    assert place_m(0.5, 5.0) == (0.0, 15.0)


def test_a_place_is_farther_from_a_leader_that_turns_on_a_wide_circle_or_keeps_others_farther_off() -> None:
    """1.25 (1.1 * 5 + 2 / 0.1) and 1.25 (1.1 * 12 + 2 / 0.5)."""
    assert place_m(0.1, 5.0) == pytest.approx((0.0, 31.875))
    assert place_m(0.5, 12.0) == pytest.approx((0.0, 21.5))


def test_a_head_that_turns_on_a_wide_circle_is_not_driven_on_by_its_formation() -> None:
    """Its way to the second rally point, 28 m off, takes it less than two minutes.

    With places at 15 m it was 270 m off at the deadline of 180 s, its followers behind it, and still going away.
    """
    small = [
        "vehicle.AUV00.turn_rate_radps=0.131", 'rally_point."operational rally".position_m=[100.0, 100.0]',
        'rally_point."coordination rally".position_m=[120.0, 120.0]', "mission.meeting_deadline_s=180",
        "area.middle.corners_m=[[25.0, 25.0], [25.0, 75.0], [75.0, 75.0], [75.0, 25.0]]",
        "area.left.corners_m=[[75.0, 25.0], [75.0, 75.0], [125.0, 75.0], [125.0, 25.0]]",
        "area.right.corners_m=[[25.0, 75.0], [25.0, 125.0], [75.0, 125.0], [75.0, 75.0]]",
    ]  # fmt: skip
    finished = run(load("mapping-rendezvous", [("--set", setting) for setting in small]), 1)
    met_s = {milestone.group: milestone.time_s for milestone in finished.milestones if milestone.name == "gathered"}
    assert finished.completed
    assert all(milestone.name != "missed_meeting" for milestone in finished.milestones)
    assert met_s["Coordination"] - met_s["Operational"] < 120.0
