"""End of missions of jobs, and the waits and open jobs in its reason."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from recorded import flown
from watched import JETTY_M, PLAYED, TEAM, seen

from missions.meeting import Meeting
from missions.meeting.meeting import MeetingSettings
from missions.meeting.truth import JOBS, JobTruth
from remoras.activities import Wait
from remoras.organisation import Organisation, RoleSpecification
from remoras.recorder import Recorder

MEETING = Meeting({"Team": TEAM}, {"jetty": JETTY_M}, MeetingSettings(arrival_radius_m=15.0), {})
CLOSE = replace(MEETING, settings=MeetingSettings(arrival_radius_m=3.0))
REEF: Any = SimpleNamespace(name="reef", needs=(), is_able=lambda data: True)
ALONE = Organisation.of([TEAM], PLAYED[:1])
UNASKED: Any = None


def test_mission_of_jobs_waits_for_vehicles_that_will_return() -> None:
    """A meets alone while B is out of contact: B may do what is left once it is back."""
    watching = JobTruth(MEETING, "Servicing", Recorder([JOBS]))
    a, b = (seen(name, organisation=ALONE) for name in "AB")
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


def test_goal_fraction_is_the_share_of_distinct_jobs_done() -> None:
    """Three jobs, one of which only a role has; a repeated job counts once."""
    digging = RoleSpecification("Digger", job="pit")
    team = replace(TEAM, roles=(*TEAM.roles, digging), mission="Surveying")
    meeting = replace(MEETING, groups={"Team": team}, jobs={"reef": UNASKED, "wreck": UNASKED})
    truth = JobTruth(meeting, "Servicing", Recorder([JOBS]))
    assert truth.goal_fraction == 0.0
    for number, job in enumerate(("wreck", "pit", "wreck", "reef")):
        truth.note("A", job, 10.0 * number)
        assert truth.goal_fraction == pytest.approx((1 / 3, 2 / 3, 2 / 3, 1.0)[number])


def test_wait_of_a_head_continues_while_it_is_pushed_aside() -> None:
    """Two have no room within 3 m of the rally point: each is out for every other minute."""
    truth, (x_m, y_m) = JobTruth(CLOSE, "Surveying", Recorder([JOBS])), JETTY_M

    def observed(minute: int, has_met: bool) -> bool:
        off_m = (1.0, 6.0) if minute % 2 else (6.0, 1.0)
        vehicles = [seen(name, position_m=(x_m + m, y_m), met=has_met) for name, m in zip("AB", off_m, strict=True)]
        return truth.observe(SimpleNamespace(vehicles=tuple(vehicles)), 60.0 * minute)

    assert not any(observed(minute, False) for minute in range(1, 17))
    assert observed(17, True)
    assert [one.name for one in truth.milestones][-1] == "mission_complete"


# Reasons


@pytest.mark.parametrize(
    ("waits", "said"),
    [(None, ""), (Wait("energy at hole 1", 2400.0), "; A waits for energy at hole 1 until 2400 s")],
)
def test_reason_names_absent_vehicles_and_open_waits(waits: Wait | None, said: str) -> None:
    truth = JobTruth(CLOSE, "Surveying", Recorder([JOBS]))
    fleet = SimpleNamespace(vehicles=(seen("A", position_m=JETTY_M, waits=waits), seen("B")))
    truth.observe(fleet, 10.0)
    assert truth.close(fleet, 60.0) == f"not together after 60 s: Team (waits for B){said}"


class Judged(JobTruth):
    """Ground truth in which no job is really done, whatever vehicles report."""

    jobs_done = ()


def test_run_ends_once_all_have_met_with_falsely_reported_jobs_as_reason() -> None:
    """No vehicle resumes work. Earlier, such a run lasted to its time limit and gave no reason."""
    truth = Judged(replace(CLOSE, jobs={"reef": REEF}), "Surveying", Recorder([JOBS]))
    fleet: Any = SimpleNamespace(vehicles=[seen(name, position_m=JETTY_M, met=True) for name in "AB"])
    truth.observe(fleet, 10.0)
    assert not truth.is_over
    truth.note("A", "reef", 20.0)
    truth.observe(fleet, 20.0)
    assert truth.is_over
    assert truth.close(fleet, 20.0) == "reported as done, but not done: reef"


def test_job_declared_impossible_but_done_is_no_reason() -> None:
    """A vehicle temporarily out of contact did it; earlier, a completed run had this as its reason."""
    recorder = Recorder([JOBS])
    truth = JobTruth(replace(CLOSE, jobs={"reef": REEF}, says_impossible=True), "Surveying", recorder)
    fleet: Any = SimpleNamespace(vehicles=[seen(name, position_m=JETTY_M, met=True) for name in "AB"])
    recorder.items.append(("0-1", "A", 5.0, 5.0, "reef", "isImpossible", "true", "told", ""))
    truth.observe(fleet, 10.0)
    assert "reef declared impossible at 10 s" in truth.close(fleet, 10.0)
    truth.note("B", "reef", 20.0)
    assert truth.observe(fleet, 20.0)
    assert truth.close(fleet, 20.0) == ""


def test_reason_names_contacts_whose_strips_analysts_await() -> None:
    """At a loss of 0.8 all were home long before the end, but the reason did not name the open strips."""
    finished = flown("minehunting-contacts", "scenario.duration_s=700")
    viewed = {row[2] for row in finished.recorder.rows("jobs") if row[2].startswith("contact")}
    classified = {row[2] for row in finished.recorder.rows("classifications")}
    said = re.search(r"analysts wait for strips of (.+) until the end", finished.reason)
    assert said is not None
    assert set(said[1].split(", ")) == viewed - classified
