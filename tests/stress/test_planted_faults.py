"""Each invariant names its planted faults: in random schedules, or in the schedule that first showed them."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import Phase, find, settings
from hypothesis import strategies as st
from planted import PLANTS, Planted
from stress.schedules import SMALL, Schedule, ground_of, read_schedule, schedules
from stress.trial import INVARIANTS, Outcome, judge

APART = (*SMALL, "guidance.separation_m=8")  # so who sees nobody comes nearer than half of it
FAULTS = Path(__file__).parents[1] / "faults"
LONG = ("exceptions", "newest", "rest")
"""Invariants whose fault shows only late, or in few schedules."""
SEARCH = settings(max_examples=60, phases=[Phase.generate], derandomize=True, database=None)


def named(outcome: Outcome) -> str:
    return "" if outcome.broken is None else outcome.broken[0]


def test_each_invariant_has_a_planted_fault() -> None:
    assert {one.name for one in INVARIANTS} == {planted.invariant for planted in PLANTS}


@pytest.mark.slow
@pytest.mark.parametrize(
    "planted",
    [
        pytest.param(
            one,
            id=f"{one.invariant}-{one.plant.__name__}",
            marks=[pytest.mark.thorough] * (number % 2 or one.invariant in LONG),
        )
        for number, one in enumerate(one for one in PLANTS if not one.once)
    ],
)
def test_a_planted_fault_is_named_by_its_invariant(planted: Planted, monkeypatch: pytest.MonkeyPatch) -> None:
    ground_of(APART)  # the run without faults has none planted either
    planted.plant(monkeypatch)

    def is_named(schedule: Schedule) -> bool:
        must_finish = schedule.must_finish and planted.invariant != "ends"
        return named(judge(replace(schedule, must_finish=must_finish))) == planted.invariant

    find(schedules(needs=planted.needs, given=st.just(APART)), is_named, settings=SEARCH)


@pytest.mark.slow
@pytest.mark.parametrize("planted", [pytest.param(one, id=one.once) for one in PLANTS if one.once])
def test_a_kept_schedule_fails_without_its_fix(planted: Planted, monkeypatch: pytest.MonkeyPatch) -> None:
    schedule = read_schedule(FAULTS / f"{planted.once}.toml")
    planted.plant(monkeypatch)
    assert named(judge(schedule)) == planted.invariant
