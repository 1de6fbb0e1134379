"""Campaigns: the same with any number of processes, and what breaks is shrunk to what it takes."""

import pytest
from planted import PLANTS
from small_sea import small_plan

from missions.errors import ConfigurationError
from stress.campaign import campaign, judge
from stress.drawing import schedule_of
from stress.schedule import Schedule
from stress.shrinking import MOST_RUNS, shrunk
from stress.trial import Outcome


@pytest.mark.slow
def test_a_breach_is_shrunk_to_the_one_fault_that_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, planted = small_plan(), next(one for one in PLANTS if one.invariant == "energy")
    seed = next(
        seed for seed in range(1, 200)
        if "restarts" in (schedule := schedule_of(plan, seed)).kinds and len(schedule.fault) >= 4
    )  # fmt: skip
    planted.plant(monkeypatch)
    report = campaign(plan, [seed])
    small = report.shrunk["energy"]
    assert [fault.kind for fault in small.schedule.fault] == ["restarts"]
    assert small.n_runs <= MOST_RUNS
    assert small.schedule.stress.bound_s <= small.broken.time_s + 2.0
    assert report.table()["energy", "restarts"].broken == [seed]


def test_what_the_scenario_does_not_allow_is_no_shorter_schedule(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fault of its own would come after an earlier end, say."""
    next(one for one in PLANTS if one.invariant == "meetings").plant(monkeypatch)
    broken = judge(schedule_of(small_plan("loss"), 1))

    def refused(schedule: Schedule) -> Outcome:
        raise ConfigurationError("scenario.toml", [])

    found = shrunk(broken, refused)
    assert found.schedule == broken.schedule
    assert found.n_runs > 0


@pytest.mark.slow
def test_two_processes_find_what_one_finds() -> None:
    plan = small_plan("links", "vehicles")
    one, two = (campaign(plan, range(1, 5), jobs=jobs) for jobs in (1, 2))
    assert [outcome.digest for outcome in one.outcomes] == [outcome.digest for outcome in two.outcomes]
    assert one.table() == two.table()
    assert one.recovered == two.recovered
    assert len(one.outcomes) == 4


@pytest.mark.slow
def test_two_processes_leave_no_block_out() -> None:
    """The others of a block wait for its first; those of the last one were forgotten."""
    report = campaign(small_plan("loss", draws="policy"), range(6, 12), jobs=2)
    assert [outcome.seed for outcome in report.outcomes] == list(range(6, 12))
