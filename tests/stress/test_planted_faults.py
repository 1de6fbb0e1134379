"""Each invariant names the faults that are planted against it, in schedules that Hypothesis draws."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import Phase, find, settings
from hypothesis import strategies as st
from planted import PLANTS, Planted
from stress.schedules import GROUND, SMALL, Schedule, ground_of, read_schedule, schedules
from stress.trial import INVARIANTS, judge, repeated

FAULTS = Path(__file__).parents[1] / "faults"
SEARCH = settings(max_examples=40, phases=[Phase.generate], derandomize=True, database=None)
SLOW = frozenset(
    {"finishes", "agreement", "separation", "authority", "remembered", "cardinality", "sound-packets", "rest"}
)
FIRST = {one.invariant: one for one in reversed(PLANTS) if not one.once and one.invariant not in SLOW}
MARKS = [pytest.mark.slow, pytest.mark.thorough]


def test_there_is_a_plant_for_each_invariant() -> None:
    assert {one.name for one in INVARIANTS} == {planted.invariant for planted in PLANTS}


@pytest.mark.slow
@pytest.mark.parametrize(
    "planted",
    [
        pytest.param(one, id=f"{one.invariant}-{one.plant.__name__}", marks=[] if one in FIRST.values() else MARKS)
        for one in PLANTS
    ],
)
def test_a_planted_fault_is_named(planted: Planted, monkeypatch: pytest.MonkeyPatch) -> None:
    given = (*SMALL, *planted.settings)
    ground_of(GROUND, given)  # the run without faults has none planted either
    planted.plant(monkeypatch)

    def is_named(schedule: Schedule) -> bool:
        if planted.invariant == "ends":
            schedule = replace(schedule, must_finish=False)
        outcome = (repeated if planted.invariant == "repeats" else judge)(schedule)
        return outcome.broken is not None and outcome.broken[0] == planted.invariant

    find(schedules(planted.kinds, planted.needs, st.just(given)), is_named, settings=SEARCH)


@pytest.mark.slow
@pytest.mark.parametrize("planted", [pytest.param(one, id=one.once) for one in PLANTS if one.once])
def test_a_kept_schedule_breaks_without_the_mend(planted: Planted, monkeypatch: pytest.MonkeyPatch) -> None:
    schedule = read_schedule(FAULTS / f"{planted.once}.toml")
    planted.plant(monkeypatch)
    outcome = judge(schedule)
    assert outcome.broken is not None
    assert outcome.broken[0] == planted.invariant
