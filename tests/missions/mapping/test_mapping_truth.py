"""The truth of mapping, told a fleet by hand: milestones in their order, and who is missing at the end."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from missions.mapping.truth import MappingTruth
from missions.meeting import Meeting
from remoras.activities import Objective
from remoras.mission import FleetView, Milestone
from remoras.organisation import Group, Organisation, RoleAssignment, RoleSpecification

TEAM = Group(
    "Team",
    (RoleSpecification("Head", 1, 1, head=True, founding=True), RoleSpecification("Hand", 1, None, founding=True)),
    "jetty",
    "AreaMapping",
)
JETTY_M = (100.0, 100.0)
EXPLORING = Objective("Team", "Hand", "Exploring", "bank")
PLAYED = (RoleAssignment("Team", "Head", "A"), RoleAssignment("Team", "Hand", "B"))


@dataclass
class Seen:
    """A vehicle as the truth sees it; by default all is agreed, nothing is being done, and it is far away."""

    name: str
    position_m: tuple[float, float] = (0.0, 0.0)
    is_alive: bool = True
    organisation: Organisation = field(default_factory=lambda: Organisation.of([TEAM], PLAYED))
    performed: tuple[str, ...] = ()
    finished: Sequence[Objective] = ()
    issued: Iterable[Any] = ()
    issued_objectives: Iterable[Objective] = ()
    has: tuple[Objective, ...] = ()
    planned: bool = True
    busy: bool = False
    is_in_contact: bool = True
    able: tuple[str, ...] = ("Hand",)
    met: bool = False

    def can_play(self, role: str) -> bool:
        return role in self.able

    def has_met(self, group: str) -> bool:
        return self.met

    def objectives_of(self, vehicle: str) -> tuple[Objective, ...]:
        return self.has

    def leads(self, group: str) -> bool:
        return self.name == "A"

    def has_planned(self, group: str) -> bool:
        return self.planned

    def gives_out(self, group: str) -> bool:
        return self.busy


@dataclass
class Fleet(FleetView):
    """Head A and hand B."""

    a: Seen = field(default_factory=lambda: Seen("A"))
    b: Seen = field(default_factory=lambda: Seen("B"))

    @property
    def vehicles(self) -> Sequence[Any]:
        return self.a, self.b


def truth(*groups: Group) -> MappingTruth:
    named = {group.name: group for group in groups or (TEAM,)}
    return MappingTruth(Meeting(named, {"jetty": JETTY_M}, 15.0, 20.0, 60.0, 900.0, {}))


def names(watching: MappingTruth) -> list[str]:
    return [milestone.name for milestone in watching.milestones]


def test_consultation_ends_when_what_was_given_out_counts_where_it_was_meant_to() -> None:
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


def test_who_finishes_an_area_has_not_stopped() -> None:
    watching, fleet = truth(), Fleet()
    fleet.b.performed = ("ZigzagExploring", "Mapping")
    watching.observe(fleet, 1.0)
    fleet.b.performed, fleet.b.finished = ("Homing",), (EXPLORING,)
    watching.observe(fleet, 9.0)
    watching.observe(fleet, 10.0)
    watching.close(fleet, 10.0)
    assert watching.milestones[1:] == [Milestone(9.0, "mapping_done", "B")]


def test_who_turns_away_has_stopped_unless_it_turns_back() -> None:
    watching, fleet = truth(), Fleet()
    for time_s, performed in enumerate([("ZigzagExploring",), ("Homing",), ("ZigzagExploring",), ("Homing",)], 1):
        fleet.b.performed = performed
        watching.observe(fleet, float(time_s))
    watching.close(fleet, 9.0)
    assert watching.milestones[1:] == [Milestone(4.0, "mapping_stopped", "B")]


def test_the_group_is_together_within_the_radius_and_with_nothing_left_to_give_out() -> None:
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


def test_at_the_end_it_is_said_who_is_missing_and_who_has_no_energy() -> None:
    watching, fleet = truth(), Fleet()
    assert truth().close(fleet, 60.0) == "consultation had not ended after 60 s"
    watching.observe(fleet, 1.0)
    assert watching.close(fleet, 60.0) == "not together after 60 s: Team"
    fleet.b.is_alive = False
    assert watching.close(fleet, 60.0) == "not together after 60 s: Team; battery exhausted: B"


def test_nobody_waits_for_the_dead_unless_somebody_is_free_to_take_the_place() -> None:
    watching, fleet = truth(), Fleet()
    fleet.a.position_m = JETTY_M
    fleet.b.is_in_contact = False
    assert watching.observe(fleet, 1.0)
    spare = Seen("C", organisation=Organisation.of([TEAM], [*PLAYED, RoleAssignment("Team", "Extra", "C")]))
    spare.position_m = JETTY_M
    watching, fleet.b = truth(), spare
    assert not watching.observe(fleet, 1.0)
    assert watching.close(fleet, 1.0) == "not together after 1 s: Team (without Hand)"
    spare.able = ()
    assert watching.observe(fleet, 2.0)


def test_a_fleet_of_which_nobody_is_left_has_not_met() -> None:
    watching, fleet = truth(), Fleet()
    fleet.a.is_alive = fleet.b.is_alive = False
    assert not watching.observe(fleet, 1.0)


def test_whom_a_head_that_waited_to_the_deadline_met_without_is_said() -> None:
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


def test_who_met_may_have_gone_on_when_the_last_one_comes() -> None:
    watching, fleet = truth(), Fleet()
    fleet.a.position_m, fleet.a.met = JETTY_M, True
    assert not watching.observe(fleet, 1.0)
    fleet.a.position_m, fleet.b.position_m = (500.0, 500.0), JETTY_M
    assert watching.observe(fleet, 2.0)


def test_the_group_that_supervises_gathers_last() -> None:
    """Only the one that was given its mission waits, and both can come together in one look."""
    crew = Group("Crew", TEAM.roles, "jetty", None)
    played = (*PLAYED, RoleAssignment("Crew", "Head", "A"), RoleAssignment("Crew", "Hand", "B"))
    organisation = Organisation.of([TEAM, crew], played)
    fleet = Fleet(Seen("A", JETTY_M, organisation=organisation), Seen("B", JETTY_M, organisation=organisation))
    watching = truth(TEAM, crew)
    assert watching.observe(fleet, 1.0)
    assert [m.group for m in watching.milestones if m.name == "gathered"] == ["Crew", "Team"]
