"""When a mission of jobs is over: once all groups have met, and nobody is to return."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from watched import JETTY_M, PLAYED, TEAM, seen

from missions.arrows.detectors import CONTACTS
from missions.arrows.truth import IDENTIFIED, ArrowsTruth
from missions.meeting import Meeting
from missions.meeting.truth import JOBS, JobTruth
from missions.pandora.structure import LOOKS, TURNS
from missions.pandora.truth import MET, SERVICED, PandoraTruth
from remoras.organisation import Organisation, RoleSpecification
from remoras.recorder import Recorder

MEETING = Meeting({"Team": TEAM}, {"jetty": JETTY_M}, 15.0, 20.0, 60.0, 900.0, {})
ALONE = Organisation.of([TEAM], PLAYED[:1])
UNASKED: Any = None


def arrows() -> JobTruth:
    """The truth of a seafloor on which nothing lies."""
    empty: Any = SimpleNamespace(things={})
    return ArrowsTruth(MEETING, UNASKED, Recorder([JOBS, CONTACTS, IDENTIFIED]), empty, UNASKED, ("A", "B"))


def pandora() -> JobTruth:
    """The truth of a structure without parts."""
    empty: Any = SimpleNamespace(things=())
    return PandoraTruth(MEETING, "Servicing", Recorder([JOBS, LOOKS, TURNS, SERVICED, MET]), empty, {})


@pytest.mark.parametrize("truth", [arrows, pandora])
def test_a_mission_of_jobs_waits_for_who_will_be_back(truth: Callable[[], JobTruth]) -> None:
    """A meets alone while B is out of contact: B may do what is left once it is back."""
    watching, a, b = truth(), *(seen(name, organisation=ALONE) for name in "AB")
    fleet: Any = SimpleNamespace(vehicles=(a, b))
    b.is_in_contact, b.will_return = False, True
    watching.observe(fleet, 10.0)
    assert not watching.is_over
    a.position_m = JETTY_M
    watching.observe(fleet, 20.0)
    assert "gathered" in [milestone.name for milestone in watching.milestones]
    assert not watching.is_over
    b.will_return = False
    watching.observe(fleet, 30.0)
    assert watching.is_over


def test_what_is_reached_is_the_share_of_all_jobs_that_are_done() -> None:
    """Three jobs, one of which only a role has; who does a job again has done it once."""
    digging = RoleSpecification("Digger", job="pit")
    team = replace(TEAM, roles=(*TEAM.roles, digging), mission="Surveying")
    meeting = replace(MEETING, groups={"Team": team}, jobs={"reef": UNASKED, "wreck": UNASKED})
    truth = JobTruth(meeting, "Servicing", Recorder([JOBS]))
    assert truth.goal_fraction == 0.0
    for number, job in enumerate(("wreck", "pit", "wreck", "reef")):
        truth.note("A", job, 10.0 * number)
        assert truth.goal_fraction == pytest.approx((1 / 3, 2 / 3, 2 / 3, 1.0)[number])


def test_the_wait_of_a_head_goes_on_while_others_push_it_out_of_the_radius() -> None:
    """Two have no room within 3 m of the rally point: each is out for every other minute."""
    meeting = Meeting({"Team": TEAM}, {"jetty": JETTY_M}, 3.0, 20.0, 60.0, 900.0, {})
    truth, (x_m, y_m) = JobTruth(meeting, "Surveying", Recorder([JOBS])), JETTY_M

    def observed(minute: int, has_met: bool) -> bool:
        off_m = (1.0, 6.0) if minute % 2 else (6.0, 1.0)
        vehicles = [seen(name, position_m=(x_m + m, y_m), met=has_met) for name, m in zip("AB", off_m, strict=True)]
        return truth.observe(SimpleNamespace(vehicles=tuple(vehicles)), 60.0 * minute)

    assert not any(observed(minute, False) for minute in range(1, 17))
    assert observed(17, True)
    assert [one.name for one in truth.milestones][-1] == "mission_complete"
