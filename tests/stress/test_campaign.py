"""Campaign: random faults in random settings violate no invariant; Hypothesis shrinks failing cases."""

import pytest
from hypothesis import given, note, settings
from stress.schedules import CAMPAIGN, Schedule, read_schedule, schedules
from stress.trial import judge


def check(schedule: Schedule) -> None:
    note(schedule.as_toml())
    outcome = judge(schedule)
    assert outcome.broken is None, outcome.broken


@pytest.mark.slow
@settings(max_examples=15, derandomize=True, **CAMPAIGN)
@given(schedules())
def test_no_schedule_violates_an_invariant(schedule: Schedule) -> None:
    check(schedule)


@pytest.mark.slow
@pytest.mark.thorough
@settings(max_examples=1000, **CAMPAIGN)
@given(schedules())
def test_no_further_schedule_violates_an_invariant(schedule: Schedule) -> None:
    check(schedule)


@settings(max_examples=1, derandomize=True, **CAMPAIGN)
@given(schedules(needs=("loss", "restarts")))
def test_a_schedule_is_a_file_and_gives_the_same_tables(tmp_path_factory, schedule: Schedule) -> None:
    file = tmp_path_factory.mktemp("schedule") / "schedule.toml"
    file.write_text(schedule.as_toml(), encoding="utf-8")
    assert read_schedule(file) == schedule
    first, second = judge(schedule), judge(schedule)
    assert first.broken is None
    assert first.digest == second.digest
