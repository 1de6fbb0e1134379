"""Meeting of the mapping mission: positions in formation, presence, and open work that delays it."""

from types import SimpleNamespace
from typing import Any

import pytest
from surveying import mapper
from watched import Facts

from missions.mapping import MappingMission
from missions.mapping.behaviours import positioning, room_of
from missions.mapping.jobs import SurveyJob
from missions.mapping.tasks import AfterWork, Unfinished
from missions.meeting.meeting import NEWS_FRAMES
from missions.runs.assembly import assemble
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.behaviours import Standing
from remoras.fleet.radio import note_position
from remoras.motion import Motion
from remoras.organisation import Organisation, RoleAssignment
from remoras.picture import Picture

GROUP = "Operational"


def place_m(turn_rate_radps: float, separation_m: float) -> tuple[float, float]:
    """Position of a left wing vehicle whose leader is at the origin, heads east and turns at this rate."""
    leader, own = mapper("AUV00", turn_rate_radps=turn_rate_radps), mapper("AUV01")
    room_m = room_of((leader, own), separation_m)
    behaviour = positioning(("top", "left"), ("AUV00",), GROUP, own, 15.0, room_m)
    picture = Picture()
    picture.groups.gathered |= {GROUP}
    note_position(picture.peers, "AUV00", (-10.0, 0.0))
    note_position(picture.peers, "AUV00", (0.0, 0.0))
    reference = behaviour.reference(Motion(500.0, 0.0), picture)
    assert reference is not None
    return reference.target_m


def test_place_has_the_spacing_of_the_mission_if_the_leader_has_room() -> None:
    """At 2 m/s and 0.5 rad/s the leader turns on a circle of 4 m: it keeps 1.1 * 5 + 4 = 9.5 m from others."""
    assert place_m(0.5, 5.0) == (0.0, 15.0)


def test_place_is_farther_for_wide_turns_or_a_larger_separation() -> None:
    """1.25 (1.1 * 5 + 2 / 0.1) and 1.25 (1.1 * 12 + 2 / 0.5)."""
    assert place_m(0.1, 5.0) == pytest.approx((0.0, 31.875))
    assert place_m(0.5, 12.0) == pytest.approx((0.0, 21.5))


WEST = SurveyJob("west", ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0), (100.0, 0.0)))
EAST = SurveyJob("east", ((100.0, 0.0), (100.0, 100.0), (200.0, 100.0), (200.0, 0.0)))
"""Areas of 16 cells of 25 m each."""


def answers(facts: Facts, goal: float, finds: tuple[str, ...] = ()) -> float:
    meeting = AfterWork(Standing(), Unfinished([WEST, EAST], goal, finds))
    return meeting.perceive(Motion(0.0, 0.0), Picture(facts=facts), True).settled


@pytest.mark.parametrize(
    ("n_cells", "goal", "expected"), [(29, 0.9, 1.0), (28, 0.9, 0.0), (31, 1.0, 0.0), (0, 0.0, 1.0)]
)
def test_calls_are_answered_once_the_goal_is_reached(n_cells: int, goal: float, expected: float) -> None:
    """Of 32 cells a goal of 0.9 spares three (28.8 are asked for)."""
    facts = Facts()
    facts.cells["west"] = {float(n) for n in range(min(16, n_cells))}
    facts.cells["east"] = {float(n) for n in range(max(0, n_cells - 16))}
    assert answers(facts, goal) == expected


def test_area_reported_as_done_counts_as_complete() -> None:
    facts = Facts()
    facts.known["areaDone", "west"] = "AUV01"
    assert answers(facts, 0.5) == 1.0
    assert answers(facts, 0.6) == 0.0


def test_find_that_is_not_inspected_counts_as_open_work() -> None:
    facts = Facts()
    facts.known["foundAt", "find 1"] = (0.0, 0.0)
    assert answers(facts, 0.0, ("find 1",)) == 0.0
    facts.known["inspectedBy", "find 1"] = "AUV01"
    assert answers(facts, 0.0, ("find 1",)) == 1.0


SETUP = resolved(load("mapping-rendezvous"))
NOW_S, FRAME_S = 1000.0, 7.0
LATE_S = NEWS_FRAMES * FRAME_S
RALLY_M, ELSEWHERE_M = (450.0, 450.0), (100.0, 100.0)


def are_there(age_s: float, position_m: tuple[float, float], contacts_m: tuple[Any, ...] = ()) -> bool:
    """True if a head has all members present, one of whom was last received at this place and age."""
    mission = SETUP.mission
    assert isinstance(mission, MappingMission)
    group = SETUP.agreement.organisation.groups["Operational"]
    played = [
        RoleAssignment("Operational", role, name) for role, name in (("Coordinator", "AUV00"), ("Performer", "AUV01"))
    ]
    beliefs: Any = SimpleNamespace(observed_s=lambda key: NOW_S - age_s)
    picture: Any = SimpleNamespace(
        frame_s=FRAME_S,
        body=SimpleNamespace(now_s=NOW_S, contacts_m=contacts_m),
        peers=SimpleNamespace(positions_m={"AUV01": position_m}, heard_s={}),
        groups=SimpleNamespace(meets_unheard=False),
    )
    return mission.meeting._all_are_there(group, Organisation.of([group], played), beliefs, picture)


@pytest.mark.parametrize(
    ("age_s", "position_m", "contacts_m", "expected"),
    [
        (LATE_S - 1.0, RALLY_M, (), True),
        (LATE_S - 1.0, ELSEWHERE_M, (RALLY_M,), False),
        (LATE_S + 1.0, RALLY_M, (), False),
        (LATE_S + 1.0, RALLY_M, (RALLY_M,), True),
        (LATE_S + 1.0, RALLY_M, (ELSEWHERE_M,), False),
    ],
    ids=["heard", "heard elsewhere", "heard long ago", "seen", "somebody seen elsewhere"],
)
def test_member_is_present_if_received_or_seen_there_recently(
    age_s: float, position_m: tuple[float, float], contacts_m: tuple[Any, ...], expected: bool
) -> None:
    assert are_there(age_s, position_m, contacts_m) is expected


def test_once_enough_is_mapped_for_the_goal_no_area_is_given_again() -> None:
    """The goal of 95 % leaves cells of an area unmapped when all have met."""
    fleet = assemble(SETUP, 1)
    fleet.run()
    ended_s = fleet.ended_s
    assert fleet.completed
    assert len(fleet.recorder.rows("coverage")) < 300  # all cells
    for _ in range(100):
        fleet.step()
    late = {row[5] for row in fleet.recorder.items if row[2] > ended_s}
    assert "position" in late
    assert "objectiveExploring" not in late
