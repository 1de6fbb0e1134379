"""A job falsely reported done: the fleet meets in vain, detects the false report, and does the job."""

from dataclasses import replace

import pytest
from stress.fault_injection import is_found_out
from stress.schedules import GROUND, SMALL, Schedule, StressFault, loaded
from stress.trial import Outcome, judge

from missions.mapping import mission
from missions.runs.setup import resolved
from remoras.work import Work

LIES = (
    StressFault(kind="forged-done", vehicle="AUV02", at_s=31.0),  # of areas that others are at
    StressFault(kind="forged-done", vehicle="AUV00", at_s=51.0),
)
NEAR_RALLY = 'rally_point."coordination rally".position_m=[240,200]'


def schedule_of(strategy: str, *faults: StressFault) -> Schedule:
    return Schedule(1, 250.0, 1500.0, (*SMALL[:-1], f"strategy.name={strategy}"), faults)


def outcome(strategy: str, *faults: StressFault) -> Outcome:
    return judge(schedule_of(strategy, *faults))


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["remoras", "contract-net"])
def test_a_job_falsely_reported_done_is_done_in_the_end(strategy: str) -> None:
    found = outcome(strategy, *LIES)
    assert found.happened == {"forged-done"}
    assert "finishes" in found.judged
    assert found.completed, found.broken


@pytest.mark.slow
def test_a_false_report_stands_without_checks_of_its_traces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mission, "given_anew", lambda *args: [])
    assert not judge(schedule_of("remoras", *LIES), ()).completed


@pytest.mark.slow
def test_a_false_report_stands_if_relayed_copies_confirm_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Under this strategy everybody repeats again and again which jobs are done."""
    nearer = (*(one for one in SMALL[:-1] if "coordination" not in one), NEAR_RALLY, "strategy.name=status-broadcast")
    lies = (replace(LIES[0], at_s=29.7), replace(LIES[1], at_s=48.7))
    schedule = Schedule(1, 97.5, 1261.2, nearer, lies)
    assert judge(schedule, ()).completed
    monkeypatch.setattr(Work, "knowing", lambda self, done: replace(self, done=self.done.union(done)))
    assert not judge(schedule, ()).completed


def test_without_a_false_report_no_job_is_reassigned(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = outcome("remoras")
    monkeypatch.setattr(mission, "given_anew", lambda *args: [])
    assert outcome("remoras").digest == honest.digest
    assert honest.completed


@pytest.mark.parametrize(
    ("scenario", "strategy", "is_so"),
    [
        (GROUND, "remoras", True),
        (GROUND, "fixed-partition", False),  # nobody tells anybody
        ("mapping-inspection", "remoras", False),  # that a find was inspected only the word tells
        ("trident-intervention", "remoras", False),
    ],
)
def test_a_false_report_is_detected_where_work_leaves_traces(scenario: str, strategy: str, is_so: bool) -> None:
    setup = resolved(loaded(scenario, (f"strategy.name={strategy}",)))
    assert is_found_out(setup.mission.jobs.values(), setup.strategy.declaration) is is_so
