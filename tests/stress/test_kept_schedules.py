"""Regression: schedules that once violated an invariant; the first line of each file states the violation."""

from pathlib import Path

import pytest
from stress.schedules import read_schedule
from stress.trial import judge

FAULTS = Path(__file__).parents[1] / "faults"
LONG = ("given-up-and-not-heard", "waits-for-the-absent")
"""Schedules that take ten seconds and more."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, id=file.stem, marks=[pytest.mark.thorough] * (number % 3 > 0 or file.stem in LONG))
        for number, file in enumerate(sorted(FAULTS.glob("*.toml")))
    ],
)
def test_a_kept_schedule_violates_no_invariant(file: Path) -> None:
    assert file.read_text(encoding="utf-8").startswith("# ")
    schedule = read_schedule(file)
    outcome = judge(schedule)
    assert outcome.happened == schedule.kinds
    assert outcome.broken is None, outcome.broken
