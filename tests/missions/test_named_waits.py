"""A run that ends by its time limit says who waits for what, and until when."""

import re
from types import SimpleNamespace
from typing import Any

import pytest
from recorded import flown
from watched import JETTY_M, TEAM, seen

from missions.meeting import Meeting
from missions.meeting.truth import JOBS, JobTruth
from remoras.activities import Wait
from remoras.recorder import Recorder


@pytest.mark.parametrize(
    ("waits", "said"),
    [(None, ""), (Wait("energy at hole 1", 2400.0), "; A waits for energy at hole 1 until 2400 s")],
)
def test_the_reason_names_who_has_not_come_and_what_is_waited_for(waits: Wait | None, said: str) -> None:
    meeting = Meeting({"Team": TEAM}, {"jetty": JETTY_M}, 3.0, 20.0, 60.0, 900.0, {})
    truth = JobTruth(meeting, "Surveying", Recorder([JOBS]))
    fleet = SimpleNamespace(vehicles=(seen("A", position_m=JETTY_M, waits=waits), seen("B")))
    truth.observe(fleet, 10.0)
    assert truth.close(fleet, 60.0) == f"not together after 60 s: Team (waits for B){said}"


class Judged(JobTruth):
    """Nothing is really done, whatever vehicles say."""

    jobs_done = ()


def test_a_run_is_over_once_all_have_met_and_take_for_done_what_is_not() -> None:
    """Nobody goes back. Before, such a run went on to its limit and gave no reason."""
    reef: Any = SimpleNamespace(name="reef", needs=(), is_able=lambda data: True)
    meeting = Meeting({"Team": TEAM}, {"jetty": JETTY_M}, 3.0, 20.0, 60.0, 900.0, {}, jobs={"reef": reef})
    truth = Judged(meeting, "Surveying", Recorder([JOBS]))
    fleet: Any = SimpleNamespace(vehicles=[seen(name, position_m=JETTY_M, met=True) for name in "AB"])
    truth.observe(fleet, 10.0)
    assert not truth.is_over
    truth.note("A", "reef", 20.0)
    truth.observe(fleet, 20.0)
    assert truth.is_over
    assert truth.close(fleet, 20.0) == "reported as done, but not done: reef"


def test_what_was_said_to_be_impossible_and_is_done_is_no_reason() -> None:
    """A vehicle that was not heard for a while did it: before, a completed run had that for its reason."""
    reef: Any = SimpleNamespace(name="reef", needs=(), is_able=lambda data: True)
    meeting = Meeting({"Team": TEAM}, {"jetty": JETTY_M}, 3.0, 20.0, 60.0, 900.0, {}, jobs={"reef": reef},
                      says_impossible=True)  # fmt: skip
    recorder = Recorder([JOBS])
    truth = JobTruth(meeting, "Surveying", recorder)
    fleet: Any = SimpleNamespace(vehicles=[seen(name, position_m=JETTY_M, met=True) for name in "AB"])
    recorder.items.append(("0-1", "A", 5.0, 5.0, "reef", "isImpossible", "true", "told", ""))
    truth.observe(fleet, 10.0)
    assert "reef declared impossible at 10 s" in truth.close(fleet, 10.0)
    truth.note("B", "reef", 20.0)
    assert truth.observe(fleet, 20.0)
    assert truth.close(fleet, 20.0) == ""


def test_a_run_says_of_what_its_analysts_await_strips() -> None:
    """At a loss of 0.8 all were home long before the end, and nobody said what for they stayed."""
    finished = flown("minehunting-contacts", "scenario.duration_s=700")
    viewed = {row[2] for row in finished.recorder.rows("jobs") if row[2].startswith("contact")}
    classified = {row[2] for row in finished.recorder.rows("classifications")}
    said = re.search(r"analysts wait for strips of (.+) until the end", finished.reason)
    assert said is not None
    assert set(said[1].split(", ")) == viewed - classified
