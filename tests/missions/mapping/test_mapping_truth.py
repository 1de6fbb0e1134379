"""Ground truth of mapping on a hand-made fleet: milestones, end of the run, reason for failure."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest
from sample_vehicles import AUV
from watched import JETTY_M, PLAYED, TEAM, seen

from missions.mapping.sensors import COVERAGE, Seabed, SeabedFeature, SwathSettings
from missions.mapping.truth import GOAL, MappingTruth
from missions.meeting import Meeting
from missions.meeting.meeting import MeetingSettings
from remoras.activities import Objective
from remoras.mission import Milestone
from remoras.organisation import Group, Organisation, RoleAssignment
from remoras.recorder import Recorder

EXPLORING = Objective("Team", "Hand", "Exploring", "bank")
NOTHING = Seabed(25.0, {})
BANK = Seabed.of_areas(25.0, {"bank": [(200.0, 0.0), (300.0, 0.0), (300.0, 25.0), (200.0, 25.0)]})
"""Four cells in a row, whose centres are at 212.5, 237.5, 262.5 and 287.5."""


class Fleet:
    """Head A and hand B."""

    def __init__(self, a: Any = None, b: Any = None) -> None:
        self.a, self.b = a or seen("A"), b or seen("B")

    @property
    def vehicles(self) -> Sequence[Any]:
        return self.a, self.b


def truth(*groups: Group, seabed: Seabed = NOTHING, goal: float = 1.0, able: Sequence[str] = ("B",)) -> MappingTruth:
    """The truth of areas that those named are able to map; without an area there is nothing to be done."""
    named = {group.name: group for group in groups or (TEAM,)}
    swaths_m = {area: dict.fromkeys(able, 25.0) for area, _ in seabed.cells.values()}
    meeting = Meeting(named, {"jetty": JETTY_M}, MeetingSettings(arrival_radius_m=15.0, follow_distance_m=20.0), {})
    return MappingTruth(meeting, seabed, swaths_m, goal, Recorder([COVERAGE, GOAL]), 4.0)


def names(watching: MappingTruth) -> list[str]:
    return [milestone.name for milestone in watching.milestones]


def test_consultation_ends_when_issued_roles_and_objectives_are_known() -> None:
    watching, fleet = truth(), Fleet()
    fleet.a.planned = False
    assert not watching.observe(fleet, 1.0)
    fleet.a.planned = True
    fleet.a.issued = (RoleAssignment("Team", "Hand", "B"),)
    fleet.b.organisation = Organisation.of([TEAM], PLAYED[:1])
    watching.observe(fleet, 2.0)
    fleet.b.organisation = Organisation.of([TEAM], PLAYED)
    fleet.a.issued_objectives = (EXPLORING,)
    watching.observe(fleet, 3.0)
    assert watching.milestones == []
    fleet.b.has = (EXPLORING,)
    watching.observe(fleet, 4.0)
    assert watching.milestones == [Milestone(4.0, "consultation_done")]
    fleet.a.planned = False  # what is agreed later is no consultation
    watching.observe(fleet, 5.0)
    assert names(watching) == ["consultation_done"]


def test_mapping_stopped_is_recorded_for_the_last_turn_away() -> None:
    watching, fleet = truth(), Fleet()
    for time_s, performed in enumerate([("ZigzagExploring",), ("Homing",), ("ZigzagExploring",), ("Homing",)], 1):
        fleet.b.performed = performed
        watching.observe(fleet, float(time_s))
    watching.close(fleet, 9.0)
    assert watching.milestones[1:] == [Milestone(4.0, "mapping_stopped", "B")]


def test_group_is_together_within_the_radius_with_no_open_assignment() -> None:
    """15 m is the radius: at 16 m a member is not there."""
    watching, fleet = truth(), Fleet()
    fleet.a.position_m, fleet.b.position_m = JETTY_M, (116.0, 100.0)
    assert not watching.observe(fleet, 1.0)
    fleet.b.position_m, fleet.a.busy = (115.0, 100.0), True
    assert not watching.observe(fleet, 2.0)
    fleet.a.busy = False
    assert watching.observe(fleet, 3.0)
    assert watching.milestones[1:] == [Milestone(3.0, "gathered", group="Team"), Milestone(3.0, "mission_complete")]
    assert watching.close(fleet, 3.0) == ""


def test_reason_names_missing_groups_and_vehicles_out_of_action() -> None:
    watching, fleet = truth(), Fleet()
    assert truth().close(fleet, 60.0) == "not all assignments had taken effect after 60 s"
    watching.observe(fleet, 1.0)
    assert watching.close(fleet, 60.0) == "not together after 60 s: Team"
    fleet.b.is_alive = False
    assert watching.close(fleet, 60.0) == "not together after 60 s: Team; out of action: B"


def test_dead_vehicle_is_awaited_only_if_a_spare_can_replace_it() -> None:
    watching, fleet = truth(), Fleet()
    fleet.a.position_m = JETTY_M
    fleet.b.is_in_contact = False
    assert watching.observe(fleet, 1.0)
    spare = seen("C", organisation=Organisation.of([TEAM], [*PLAYED, RoleAssignment("Team", "Extra", "C")]))
    spare.position_m = JETTY_M
    watching, fleet.b = truth(), spare
    assert not watching.observe(fleet, 1.0)
    assert watching.close(fleet, 1.0) == "not together after 1 s: Team (without Hand)"
    spare.able = ()
    assert watching.observe(fleet, 2.0)


def test_vehicles_missing_at_the_meeting_deadline_are_recorded() -> None:
    """The deadline is 900 s after the head came, if it takes the group for gathered then."""
    watching, fleet = truth(), Fleet()
    fleet.a.position_m = JETTY_M
    assert not watching.observe(fleet, 100.0)
    assert not watching.observe(fleet, 1000.0)  # it still waits
    fleet.a.met = True
    assert not watching.observe(fleet, 999.0)
    assert watching.observe(fleet, 1000.0)
    gathered = Milestone(1000.0, "gathered", group="Team"), Milestone(1000.0, "missed_meeting", "B", "Team")
    assert tuple(watching.milestones[1:3]) == gathered


# What is covered, and the goal --------------------------------------------------------------------

MAPPING = replace(AUV, sensors=(SwathSettings(name="mapping", swath_m=25.0, speed_limit_mps=1.25),))


def sweep(watching: MappingTruth, fleet: Fleet, *xs_m: float, from_s: float = 1.0) -> None:
    """B passes the middle of the bank at these places with its sensor on, one a second."""
    fleet.b.data, fleet.b.sensing = MAPPING, ("mapping",)
    for number, x_m in enumerate(xs_m):
        fleet.b.position_m = (x_m, 12.5)
        watching.observe(fleet, from_s + number)


def test_cells_in_reach_of_a_vehicle_beside_the_area_are_covered() -> None:
    watching, fleet = truth(seabed=BANK), Fleet()
    wide = SwathSettings(name="mapping", swath_m=50.0, speed_limit_mps=1.25)
    fleet.b.data, fleet.b.sensing = replace(AUV, sensors=(wide,)), ("mapping",)
    fleet.b.position_m = (250.0, -10.0)  # the area ends at 0 m, and its two nearest centres are 25.7 m away
    watching.observe(fleet, 1.0)
    assert watching.goal_fraction == 0.0
    fleet.b.position_m = (250.0, -9.0)  # 24.9 m
    watching.observe(fleet, 2.0)
    assert watching.goal_fraction == pytest.approx(0.5)


def test_gathering_below_the_goal_does_not_complete_the_mission() -> None:
    """Half of the cells at a goal of 0.8: the run ends once no vehicle works during the 60 s of patience."""
    watching, fleet = truth(seabed=BANK, goal=0.8), Fleet()
    sweep(watching, fleet, 212.5, 237.5)
    fleet.a.position_m = fleet.b.position_m = JETTY_M
    watching.observe(fleet, 5.0)
    fleet.a.met = True
    assert not watching.observe(fleet, 10.0)
    assert not watching.is_over
    watching.observe(fleet, 70.0)
    assert not watching.is_over
    watching.observe(fleet, 71.0)
    assert watching.is_over
    assert watching.goal_fraction == pytest.approx(0.625)
    share = "63 % of the goal (50 % of the work is done, 80 % is due)"
    assert watching.close(fleet, 71.0) == f"together after 71 s: {share}"
    assert "mission_complete" not in names(watching)


FIND = SeabedFeature("find 1", (212.5, 12.5), 30.0, 10.0, 0.5)


@pytest.mark.parametrize(("seabed", "xs_m"), [
    (BANK, (212.5, 237.5)), (replace(BANK, features={(8, 0): FIND}), (212.5, 237.5, 262.5, 287.5)),
])  # fmt: skip
def test_work_no_survivor_can_do_counts_and_is_unreachable(seabed: Seabed, xs_m: tuple[float, ...]) -> None:
    """B alone is able: when it is lost, half of the goal is reached. A find counts for as much as the four cells."""
    watching, fleet = truth(seabed=seabed, able=("B",)), Fleet()
    sweep(watching, fleet, *xs_m)
    assert (watching.goal_fraction, watching.reachable_fraction(fleet)) == (pytest.approx(0.5), pytest.approx(1.0))
    fleet.b.is_alive = False
    watching.observe(fleet, 9.0)
    assert (watching.goal_fraction, watching.reachable_fraction(fleet)) == (pytest.approx(0.5), pytest.approx(0.5))
    assert watching.close(fleet, 9.0).startswith("no vehicle left that is able to map: 50 % open; ")


def test_run_ends_once_no_able_vehicle_is_left_and_survivors_are_home() -> None:
    """Only B is able. After its loss A goes on to the rally point; a vehicle that will return is awaited."""
    watching, fleet = truth(seabed=BANK, goal=0.8), Fleet()
    sweep(watching, fleet, 212.5, 237.5)
    fleet.a.position_m = JETTY_M
    fleet.b.is_alive, fleet.b.is_in_contact, fleet.b.will_return = False, False, True
    watching.observe(fleet, 10.0)
    assert not watching.is_over
    fleet.b.will_return, fleet.a.position_m = False, (500.0, 500.0)
    watching.observe(fleet, 11.0)
    assert not watching.is_over
    fleet.a.position_m = JETTY_M
    assert not watching.observe(fleet, 12.0)
    assert watching.is_over
